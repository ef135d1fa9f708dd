"""Errors, stops, memory, examples."""

import doctest
import gc
import importlib
import os
import signal
import threading
import time

import numpy as np
import pytest

import sysid


def swing(seconds=2.0, noise=1e-3, seed=1):
    return sysid.simulate("pendulum1", duration=seconds, noise=noise,
                          seed=seed)


@pytest.mark.parametrize("call, message", [
    (lambda: sysid.load("pendulum9"), "no shipped model is named"),
    (lambda: sysid.load("no_such.urdf"), "no_such.urdf"),
    (lambda: sysid.load(3), "give the path of a URDF or MJCF file"),
    (lambda: sysid.Run(t=[0, 1], q={"joint1": [1, 2, 3]}),
     r"q\['joint1'\]: has 3 numbers, and t has 2"),
    (lambda: sysid.Run(t=[0, 1], q=[1, 2]), "give a dict of arrays"),
    (lambda: sysid.Run(t=[0, 1], q={"joint1": ["a", "b"]}),
     "is no array of numbers"),
    (lambda: sysid.fit("cartpole", [sysid.Run(
        t=[0.0, 1.0, 1.0], q={"hinge": [0.1, 0.2, 0.3]})]),
     r"run 1, t\[2\]"),
    (lambda: sysid.fit("cartpole", [sysid.Run(
        t=[0.0, 1.0, 2.0], q={"hinge": [0.1, np.inf, 0.3]})]),
     r"run 1, hinge.q\[1\]: is infinite"),
    (lambda: sysid.fit("pendulum1", [swing()], segmnt=1),
     "segmnt: is no option\n  hint: did you mean 'segment'"),
    (lambda: sysid.fit("pendulum1", [swing()], segment="long"),
     "--segment: cannot be \"long\"\n  hint: it takes a number"),
    (lambda: sysid.fit("pendulum1", [swing()], noise=float("nan")),
     "--noise: cannot be nan"),
    (lambda: sysid.fit("pendulum1", [swing()], free=["link1.lenght"]),
     "did you mean 'link1.length'"),
    (lambda: sysid.fit("pendulum1", [3]), "a int is no recording"),
    (lambda: sysid.fit("pendulum1", ["no_such.csv"]), "no_such.csv"),
    (lambda: sysid.fit("pendulum1", []), "runs: there is none"),
    (lambda: sysid.fit("cartpole", [sysid.Run(
        t=[0.0, 1.0, 2.0], q={"slidr": [0.1, 0.2, 0.3]})]),
     "run 1, slidr.q: the model has no joint 'slidr'.*\n.*'slider.q'"),
    (lambda: sysid.diagnose("pendulum1", [swing()], auto="yes"),
     "--auto: cannot be \"yes\"\n  hint: it takes True or False"),
    (lambda: sysid.load("/etc/hostname"), "not XML"),
    (lambda: sysid.simulate("pendulum1", duratoin=3), "did you mean 'duration'"),
])
def test_says_what_is_wrong(call, message):
    with pytest.raises(sysid.InputError, match=message):
        call()


def test_names_a_channel_that_is_not_there():
    fit = sysid.fit("pendulum1", [swing()])
    with pytest.raises(sysid.InputError, match="joint1"):
        fit.residuals("joint")
    with pytest.raises(KeyError, match="link1.length"):
        fit["link1.lenght"]


@pytest.fixture(scope="module")
def slow_fit():
    """Takes some seconds."""
    run = sysid.simulate("arm7", duration=20, rate=100, seed=2,
                         excite="multisine", noise=1e-3)
    return lambda **how: sysid.fit("arm7", [run], free=["inertial"],
                                   check="none", **how)


# What a fit takes of the processors in a second: other work on the machine makes
# that longer on the clock.
SECOND = 1.0 * len(os.sched_getaffinity(0))


def at_joined_segments(act):
    """Acts once, where a fit has a point to keep; and when that was."""
    times = []

    def progress(doing, *_):
        if doing == "joined segments" and not times:
            times.append(time.process_time())
            act()

    return progress, times


def test_another_thread_stops_a_fit_within_a_second(slow_fit):
    stop, reached, asked = threading.Event(), threading.Event(), []

    def ask():
        reached.wait()
        asked.append(time.process_time())
        stop.set()

    thread = threading.Thread(target=ask)
    thread.start()
    progress, _ = at_joined_segments(reached.set)
    found = slow_fit(progress=progress, stop=stop)
    assert time.process_time() - asked[0] < SECOND
    assert not found.converged
    assert found.json["stopped"] == "user"
    assert np.isfinite(list(found.values.values())).all()
    thread.join()


def test_ctrl_c_keeps_the_best_point(slow_fit):
    progress, times = at_joined_segments(
        lambda: os.kill(os.getpid(), signal.SIGINT))
    found = slow_fit(progress=progress)
    assert time.process_time() - times[0] < SECOND
    assert not found.converged


def test_says_that_there_is_nothing_to_keep(slow_fit):
    stop = threading.Event()
    stop.set()
    with pytest.raises(sysid.Stopped):
        slow_fit(stop=stop)


def test_threads_run_while_a_fit_does(slow_fit):
    stop = threading.Event()
    thread = threading.Thread(target=_until_stopped, args=(slow_fit, stop))
    thread.start()
    turns = 0
    while thread.is_alive() and turns < 30:
        turns += 1
        time.sleep(0.005)
    stop.set()
    thread.join()
    assert turns == 30


def _until_stopped(fit, stop):
    try:
        fit(stop=stop)
    except sysid.Stopped:  # before there was a first point
        pass


def resident():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")


def test_memory_does_not_grow():
    run = swing(1.0)

    def fits(count):
        for _ in range(count):
            fit = sysid.fit("pendulum1", [run], threads=1, check="none")
            assert fit.converged
            fit.predictions()
        gc.collect()
        return resident()

    first = fits(50)
    assert fits(200) - first < 4e6  # bytes; a fit has some 0.3 MB


def test_takes_arrays_without_copies():
    t, q = np.arange(0, 1, 0.01), np.linspace(0, 0.3, 100)
    run = sysid.Run(t=t, q={"joint1": q})
    assert run.t is t and run["joint1.q"] is q
    table = np.column_stack([t, q])
    assert sysid.Run(t=table[:, 0], q={"joint1": table[:, 1]})["joint1.q"].base \
        is table


@pytest.mark.parametrize("module", [
    "sysid", "sysid._errors", "sysid.diagnosis", "sysid.fitting",
    "sysid.model", "sysid.run", "sysid.simulation"])
def test_examples_run(module):
    found = doctest.testmod(importlib.import_module(module))
    assert found.attempted > 0 and found.failed == 0


def test_says_where_it_cannot_write():
    fit = sysid.fit("pendulum1", [swing()])
    with pytest.raises(sysid.InputError, match="/proc/none"):
        fit.save("/proc/none")
    with pytest.raises(sysid.InputError, match="cannot be written"):
        fit.export("/proc/robot.urdf")
