"""Fits, diagnoses and simulations from Python are those of the programs, to
the last bit."""

import csv
import json

import numpy as np
import pytest

import sysid
from conftest import TIMES, without


def columns_of(path):
    with open(path, newline="") as file:
        rows = list(csv.reader(line for line in file
                               if not line.startswith("#")))
    return {name: np.array([float(row[i]) if row[i] else np.nan
                            for row in rows[1:]])
            for i, name in enumerate(rows[0])}


def run_of(path):
    """A run of plain arrays, under the file's name."""
    columns = columns_of(path)
    t = columns.pop("t")
    q = {name[:-2]: values for name, values in columns.items()
         if name.endswith(".q")}
    balls = {name[:-3] for name in columns if name.endswith(".qw")}
    for ball in balls:
        q[ball] = np.column_stack(
            [columns[f"{ball}.{part}"] for part in ("qw", "qx", "qy", "qz")])
    return sysid.Run(t=t, q=q, name=path)


def assert_same(found, expected, also=()):
    keys = (*TIMES, *also)
    assert without(found, keys) == without(expected, keys)


@pytest.mark.parametrize("model, paths", [
    ("pendulum3", ["data/runs/pendulum3.csv"]),
    ("pendulum2_planar", ["data/runs/hidden_1.csv", "data/runs/hidden_2.csv"]),
])
@pytest.mark.parametrize("how", ["arrays", "read", "paths"])
def test_fit_is_the_programs(program_json, model, paths, how):
    loaded = sysid.load(model)
    runs = {"arrays": lambda path: run_of(path),
            "read": lambda path: sysid.read(path, loaded),
            "paths": lambda path: path}[how]
    fit = sysid.fit(loaded, [runs(path) for path in paths], check="numbers")
    assert_same(fit.json, program_json("sysid_fit", "--model", model,
                                       "--check", "numbers", "--traj",
                                       ",".join(paths)))


def test_diagnosis_is_the_programs(program_json):
    paths = [f"data/runs/hidden_{i}.csv" for i in (1, 2, 3)]
    found = sysid.diagnose(
        "pendulum2_planar", [run_of(path) for path in paths[:2]],
        holdout=[run_of(paths[2])], check="numbers")
    expected = program_json(
        "sysid_diagnose", "--model", "pendulum2_planar", "--traj",
        ",".join(paths[:2]), "--holdout", paths[2], "--check", "numbers")
    assert_same(found.json, expected, ("next_command", "next_experiment"))
    assert found.verdict == "missing_effect"
    assert found.effects == ["coulomb_friction@joint2"]
    assert found.json["next_command"] == (
        "sysid.fit(model, runs, holdout=held_out, check='numbers', "
        "add='coulomb_friction@joint2')")
    fit = found.fit()
    assert fit.effects == found.effects
    assert fit.json["error"]["train"]["normalized_rms"] < 1.1


def test_simulation_is_the_programs(program, tmp_path):
    options = {"duration": 2, "rate": 50, "seed": 7, "noise": 1e-3}
    run = sysid.simulate(
        "pendulum2_planar", add={"coulomb_friction@joint1": 0.02},
        set={"link1.length": 0.33}, **options)
    program("sysid_simulate", "--model", "pendulum2_planar", "--add",
            "coulomb_friction@joint1=0.02", "--set", "link1.length=0.33",
            "--out_csv", str(tmp_path / "run.csv"),
            *(word for name, value in options.items()
              for word in (f"--{name}", str(value))))
    expected = columns_of(tmp_path / "run.csv")
    assert list(run.columns) == list(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(run[name], values)


def test_simulation_follows_efforts_of_arrays():
    t = np.arange(200) * 0.01
    pushed = sysid.simulate(
        "cartpole", noise=0, rate=100, initial=sysid.Run(
            t=t, q={"slider": 0 * t, "hinge": 0 * t}),
        efforts=sysid.Run(t=t, tau={"slider": 1 + 0 * t}))
    assert pushed["slider.q"][-1] > 0.1
    np.testing.assert_array_equal(pushed["slider.tau"], 1.0)


@pytest.fixture(scope="module")
def fit():
    return sysid.fit("pendulum2_planar", ["data/runs/hidden_1.csv"],
                     holdout=["data/runs/hidden_3.csv"],
                     add=["coulomb_friction@joint2"])


def test_covariance_is_that_of_the_standard_errors(fit):
    assert fit.covariance_names == list(fit.parameters)
    errors = [of.std_error for of in fit.parameters.values()]
    np.testing.assert_allclose(np.sqrt(np.diag(fit.covariance)), errors,
                               rtol=1e-12)
    np.testing.assert_allclose(
        fit.covariance / np.outer(errors, errors), fit.json["correlation"],
        rtol=1e-12)


def test_predictions_are_those_of_the_files(fit, tmp_path):
    with pytest.warns(UserWarning) if not fit._ask(
            "files")["files"].get("report.html") else _nothing():
        names = fit.save(tmp_path / "out")
    assert {"fit.json", "prediction.csv", "identified.urdf"} <= set(names)
    with open(tmp_path / "out" / "fit.json") as file:
        assert json.load(file) == fit.json
    columns = columns_of(tmp_path / "out" / "prediction.csv")
    whole = np.concatenate([fit.residuals("joint1"),
                            fit.residuals("joint1", held_out=True)])
    np.testing.assert_allclose(columns["joint1.q.residual"], whole, rtol=0,
                               atol=1e-15)


class _nothing:
    def __enter__(self):
        return self

    def __exit__(self, *_):
        return False


def test_predicts_a_run_as_it_predicts_held_out_ones(fit):
    held_out = fit.predictions(held_out=True)[0]
    prediction = fit.predict(run_of("data/runs/hidden_3.csv"))
    np.testing.assert_array_equal(prediction["joint2"], held_out["joint2"])
    assert prediction.errors["error"] == fit.json["error"]["holdout"]
    opened = fit.predict("data/runs/hidden_3.csv", open=True)
    rms = np.sqrt(np.nanmean(opened.residuals["joint1"] ** 2))
    by_run = {of["trajectory"]: of for of in fit.json["error"]["open"]}
    expected = by_run["data/runs/hidden_3.csv"]["channels"][0]
    assert expected["name"] == "joint1"
    assert rms == pytest.approx(expected["rms"], rel=0.05)


def test_the_fitted_model_goes_on(fit):
    model = fit.model
    assert model.effects == ["coulomb_friction@joint2"]
    for name, value in fit.values.items():
        assert model.parameters[name] == value
    compared = sysid.fit(model, ["data/runs/hidden_2.csv"], free="none")
    assert compared.values == {}
    assert compared.json["error"]["train"]["normalized_rms"] < 1.1


def test_draws_have_the_covariance(fit):
    samples = fit.sample(2000, seed=3)
    assert samples.names == fit.covariance_names
    found = np.cov(samples.values, rowvar=False)
    scale = np.sqrt(np.outer(np.diag(fit.covariance),
                             np.diag(fit.covariance)))
    np.testing.assert_allclose((found - fit.covariance) / scale, 0, atol=0.1)
    assert samples.urdfs[0].startswith("<?xml")


def test_exports_a_urdf_that_loads_again(fit, tmp_path):
    path = tmp_path / "robot.urdf"
    fit.export(path)
    # Friction is in its <dynamics>.
    assert sysid.load(path).effects == ["coulomb_friction@joint2"]
    with pytest.raises(sysid.InputError, match="robot.obj"):
        fit.export(tmp_path / "robot.obj")


def test_is_shown_as_text_and_html(fit):
    assert "joint2.friction" in str(fit)
    page = fit._repr_html_()
    assert "joint2.friction" in page and "at the noise floor" in page
    frame = pytest.importorskip("pandas") and fit.to_pandas()
    assert frame.loc["joint2.friction", "value"] == \
        fit.values["joint2.friction"]
