"""Paths of the tests; they need the library (SYSID_LIBRARY) and the programs
(SYSID_PROGRAMS) of one build, or the installed package."""

import json
import os
import pathlib
import subprocess
import sys

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
if "SYSID_LIBRARY" in os.environ:
    sys.path.insert(0, str(ROOT / "python"))

TIMES = ("wall_time_s", "cpu_time_s", "time_s")


@pytest.fixture(autouse=True)
def at_root(monkeypatch):
    """Paths of data are from the repository's root."""
    monkeypatch.chdir(ROOT)


def without(value, keys):
    """JSON without some members, at any depth."""
    if isinstance(value, dict):
        return {key: without(of, keys) for key, of in value.items()
                if key not in keys}
    if isinstance(value, list):
        return [without(of, keys) for of in value]
    return value


@pytest.fixture
def program():
    """Runs a program; its JSON, or what it prints."""
    folder = os.environ.get("SYSID_PROGRAMS", "")

    def run(name, *arguments):
        return subprocess.run([os.path.join(folder, name), *arguments],
                              check=True, capture_output=True,
                              text=True).stdout

    return run


@pytest.fixture
def program_json(program):
    return lambda name, *arguments: json.loads(
        program(name, *arguments, "--json", "-"))
