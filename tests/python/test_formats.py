"""Recordings that Python's packages read: the numbers of the same run as CSV."""

import subprocess
import sys

import numpy as np
import pytest

import sysid
from sysid import formats
from test_results import columns_of

PATH = "data/runs/hidden_1.csv"


@pytest.fixture
def columns():
    return columns_of(PATH)


@pytest.fixture
def model():
    return sysid.load("pendulum2_planar")


def assert_same_run(run, columns):
    assert set(run.columns) == set(columns)
    for name, values in columns.items():
        np.testing.assert_array_equal(run[name], values)


def test_npz(columns, model, tmp_path):
    np.savez(tmp_path / "run.npz", **columns)
    assert_same_run(sysid.read(tmp_path / "run.npz", model), columns)


def test_npz_of_matrices_by_columns(columns, model, tmp_path):
    pos = np.column_stack([columns["joint1.q"], columns["joint2.q"]])
    np.savez_compressed(tmp_path / "run.npz", pos=pos, label=np.array("a"),
                        time_ms=columns["t"] * 1000.0, extra=np.zeros(3))
    run = sysid.read(tmp_path / "run.npz", model, columns={
        "t": "time_ms*0.001", "joint1.q": "pos[:,0]",
        "joint2.q": "pos[:,1]"})
    np.testing.assert_array_equal(run["joint2.q"], columns["joint2.q"])
    np.testing.assert_allclose(run.t, columns["t"], rtol=1e-15)


def test_npy_by_the_numbers_of_columns(columns, model, tmp_path):
    np.save(tmp_path / "run.npy", np.column_stack(
        [columns["t"], columns["joint1.q"], columns["joint2.q"]]))
    run = sysid.read(tmp_path / "run.npy", model,
                     columns="t=#1,joint1.q=#2,joint2.q=#3")
    assert_same_run(run, columns)


def test_hdf5(columns, model, tmp_path):
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "run.h5", "w") as file:
        for name, values in columns.items():
            file["obs/" + name] = values
    run = sysid.read(tmp_path / "run.h5", model, columns={
        name: f"obs/{name}" for name in columns})
    assert_same_run(run, columns)


def test_parquet_with_lists_in_cells(columns, model, tmp_path):
    pytest.importorskip("pyarrow")
    pandas = pytest.importorskip("pandas")
    pandas.DataFrame({
        "time": pandas.to_datetime(
            np.round(columns["t"] * 1e9).astype(np.int64)
            + 1_700_000_000_000_000_000),
        "position": [list(row) for row in zip(columns["joint1.q"],
                                              columns["joint2.q"])],
    }).to_parquet(tmp_path / "run.parquet")
    run = sysid.read(tmp_path / "run.parquet", model, columns={
        "t": "time", "joint1.q": "position[0]", "joint2.q": "position[1]"})
    np.testing.assert_array_equal(run["joint1.q"], columns["joint1.q"])
    np.testing.assert_allclose(run.t, columns["t"], atol=1e-9)


def test_whole_numbers_of_nanoseconds_keep_their_digits():
    stamps = np.array([1_700_000_000_000_000_001, 1_700_000_000_000_000_003])
    np.testing.assert_array_equal(formats.as_numbers(stamps), [0, 2])


def test_fits_them_as_the_csv(columns, model, tmp_path):
    np.savez(tmp_path / "run.npz", **columns)
    fit = sysid.fit(model, [sysid.read(tmp_path / "run.npz", model)])
    assert fit.values == sysid.fit(model, [PATH]).values
    with pytest.raises(sysid.InputError, match="sysid.read"):
        sysid.fit(model, [tmp_path / "run.npz"])


def convert(*arguments):
    return subprocess.run([sys.executable, "-m", "sysid.convert", *arguments],
                          capture_output=True, text=True)


def test_convert(columns, tmp_path, monkeypatch):
    import os
    monkeypatch.setenv("PYTHONPATH", os.path.dirname(os.path.dirname(
        sysid.__file__)))
    np.savez(tmp_path / "run.npz", time=columns["t"],
             a=columns["joint1.q"], b=columns["joint2.q"])
    out = str(tmp_path / "run.csv")
    done = convert(str(tmp_path / "run.npz"), "--model", "pendulum2_planar",
                   "--columns", "t=time,joint1.q=a,joint2.q=b", "--out", out)
    assert done.returncode == 0, done.stderr
    for name, values in columns_of(out).items():
        np.testing.assert_array_equal(values, columns[name])
    done = convert(str(tmp_path / "run.npz"))
    assert done.stdout.splitlines()[0] == "time,a,b"
    done = convert(str(tmp_path / "none.npz"), "--model", "pendulum1")
    assert done.returncode == 2
    assert done.stderr.startswith("error: ")
