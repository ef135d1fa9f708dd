"""What verify makes of an engine's numbers and motions; the calls of engines
are in test_arrival.py."""

import numpy as np
import pytest

from sysid import verification


class Engine:
    numbers = {"j.damping": 0.1, "j.friction": 0.2, "j.armature": 0.3}

    def number(self, name):
        return self.numbers.get(name)

    def passes_by(self, name):
        return name == "j.friction"


def row(name, value, arrival="arrived"):
    return {"name": name, "value": value, "arrival": arrival, "unit": "SI",
            "effect": None, "where": None, "remark": "why"}


def test_parameters_arrive_differ_or_are_lost():
    checked = verification.check_parameters(
        Engine(), [row("j.damping", 0.1), row("j.armature", 0.4),
                   row("j.friction", 0.2), row("j.static", 0.5, "lost"),
                   row("link.length", 1.0)])
    assert [of["arrival"] for of in checked] == [
        "arrived", "differs", "lost", "lost", "arrived"]
    result = verification.Verification("none", "robot.xml", checked, [], [])
    assert result.lost == ["j.armature", "j.friction", "j.static"]
    assert "differs  j.armature = 0.4 SI, the file has 0.3 (why)" in str(result)


def test_distances_are_those_of_the_sensor():
    joints = [{"name": "j", "q": 0, "nq": 1, "v": 1, "nv": 1, "ball": False}]
    ours, theirs = np.zeros((4, 2)), np.full((4, 2), 0.3)
    measured = {"j": np.array([0.1, 0.1, np.nan, 0.1])}
    predicted = {"j": np.full(4, 0.1)}  # the sensor's offset
    found, = verification.distances("run", joints, ours, theirs, measured,
                                    predicted, {"j": "m"})
    assert found["to_ours"] == pytest.approx(0.3)
    assert found["to_measured"] == pytest.approx(0.3)
    assert found["ours_to_measured"] == 0.0 and found["unit"] == "m"


def test_balls_are_apart_by_an_angle_whatever_the_sign():
    joints = [{"name": "b", "q": 0, "nq": 4, "v": 4, "nv": 3, "ball": True}]
    ours = np.array([[0, 0, 0, 1, 0, 0, 0.0]])
    theirs = np.array([[0, 0, -np.sin(0.1), -np.cos(0.1), 0, 0, 0]])
    found, = verification.distances("run", joints, ours, theirs, {}, {}, {})
    assert found["to_ours"] == pytest.approx(0.2)
    assert found["to_measured"] is None


def test_missing_inputs_hold_what_was_before():
    found = verification.inputs_of(
        {"j.tau": np.array([np.nan, 1.0, np.nan, 2.0]), "j.q": np.ones(4)},
        (".tau",))
    assert list(found) == ["j.tau"]
    np.testing.assert_array_equal(found["j.tau"], [0, 1, 1, 2])
