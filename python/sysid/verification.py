"""Whether what a fit found arrived in a simulator."""

import dataclasses
import json
import os
from typing import Any, Dict, List, Optional, Union

import numpy as np

from . import engines
from ._errors import InputError

_FORMATS = {".xml": "MJCF", ".sdf": "SDF", ".urdf": "URDF"}


@dataclasses.dataclass(frozen=True)
class Verification:
    """What :func:`verify` found. Printed, it is two tables.

    Attributes
    ----------
    engine, path : str
    parameters : list of dict
        ``name``, ``effect``, ``value``, ``unit``; ``arrival``: ``"arrived"``,
        ``"partly"``, ``"lost"``, or ``"differs"`` where the file's number is
        another; ``found``: the number in the loaded model, None where the
        engine does not tell; ``where``, ``remark``.
    trajectories : list of dict
        For each recording and joint the rms distances ``to_measured`` of the
        engine's motion, ``ours_to_measured`` of our own prediction from the
        same start, and ``to_ours`` between both; ``unit`` rad or m.
    notes : list of str
    """

    engine: str
    path: str
    parameters: List[Dict[str, Any]]
    trajectories: List[Dict[str, Any]]
    notes: List[str]

    @property
    def lost(self) -> List[str]:
        """Names of what did not arrive as it is: lost, partly, or another."""
        return [of["name"] for of in self.parameters
                if of["arrival"] != "arrived"]

    def __str__(self) -> str:
        lines = [f"{self.path} in {self.engine}"]
        for of in self.parameters:
            found = ("" if of["found"] is None or of["arrival"] == "arrived"
                     else f", the file has {of['found']:.6g}")
            remark = f" ({of['remark']})" if of["remark"] else ""
            lines.append(f"  {of['arrival']:8} {of['name']} = "
                         f"{of['value']:.6g} {of['unit']}{found}{remark}")
        for of in self.trajectories:
            measured = ("" if of["to_measured"] is None else
                        f"; to the measurement {of['to_measured']:.3g}, ours "
                        f"{of['ours_to_measured']:.3g}")
            lines.append(f"  {of['run']}, {of['joint']}: to our prediction "
                         f"{of['to_ours']:.3g} {of['unit']} rms{measured}")
        return "\n".join(lines + [f"  note: {note}" for note in self.notes])

    __repr__ = __str__


def check_parameters(engine: Any, rows: List[Dict[str, Any]]
                     ) -> List[Dict[str, Any]]:
    """Rows of export.json with what the engine has."""
    checked = []
    for row in rows:
        found = engine.number(row["name"])
        arrival = row["arrival"]
        if arrival == "arrived" and engine.passes_by(row["name"]):
            arrival = "lost"
        if arrival == "arrived" and found is not None:
            scale = max(abs(row["value"]), 1e-9)
            if abs(found - row["value"]) > 1e-9 * scale + 1e-12:
                arrival = "differs"
        checked.append({**row, "arrival": arrival, "found": found})
    return checked


def _rms(values: np.ndarray) -> Optional[float]:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else None


def _turn(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between quaternions (n, 4), rad."""
    return 2.0 * np.arccos(np.clip(np.abs(np.sum(a * b, axis=1)), 0.0, 1.0))


def distances(name: str, joints: List[Dict[str, Any]], ours: np.ndarray,
              theirs: np.ndarray, measured: Dict[str, np.ndarray],
              predicted: Dict[str, np.ndarray], units: Dict[str, str]
              ) -> List[Dict[str, Any]]:
    """How far the motions (states of each sample) are from each other and
    from what was measured of each joint."""
    rows = []
    for of in joints:
        joint = of["name"]
        own = ours[:, of["q"]:of["q"] + of["nq"]]
        other = theirs[:, of["q"]:of["q"] + of["nq"]]
        row = {"run": name, "joint": joint, "unit": units.get(joint, "rad"),
               "to_measured": None, "ours_to_measured": None}
        if of["ball"]:
            row["to_ours"] = _rms(_turn(own, other))
            if joint in measured:
                row["to_measured"] = _rms(_turn(other, measured[joint]))
                row["ours_to_measured"] = _rms(_turn(own, measured[joint]))
        else:
            row["to_ours"] = _rms((own - other)[:, 0])
            if joint in measured:
                # What the sensor makes of the position is the same for both.
                seen = other[:, 0] + (predicted[joint] - own[:, 0])
                row["to_measured"] = _rms(measured[joint] - seen)
                row["ours_to_measured"] = _rms(measured[joint]
                                               - predicted[joint])
        rows.append(row)
    return rows


def inputs_of(columns: Dict[str, np.ndarray], ends: Any) -> Dict[str, Any]:
    """The columns of inputs; what is missing holds what was before."""
    found = {}
    for column, values in columns.items():
        if not column.endswith(ends):
            continue
        values = np.array(values, dtype=np.float64)
        known = np.where(np.isfinite(values), np.arange(len(values)), 0)
        values = np.nan_to_num(values[np.maximum.accumulate(known)])
        found[column] = values
    return found


def verify(fit: Any, path: Union[str, "os.PathLike[str]"],
           engine: str = "mujoco", runs: Any = None) -> Verification:
    """Loads a file that a fit exported in a simulator, and replays there what
    was recorded.

    Each parameter is compared with the number in the loaded model; each
    recording is replayed from the start of our own prediction of it with the
    recorded efforts and commands.

    Parameters
    ----------
    fit : Fit
    path : str or path
        What ``fit.export(path)`` or ``fit.save(folder)`` wrote: ``.xml``
        (MJCF), ``.sdf`` or ``.urdf``.
    engine : str
        ``"mujoco"`` (.xml, .urdf), ``"drake"`` (all three), ``"pinocchio"``
        (.xml, .urdf).
    runs : list of Run or of paths, optional
        Default: those that were fitted.

    Returns
    -------
    Verification

    Raises
    ------
    InputError
        Where the engine is not installed (with the command that installs it),
        or does not load the file.

    Examples
    --------
    >>> import os, tempfile, sysid
    >>> fit = sysid.fit("pendulum2_planar", ["data/runs/hidden_1.csv"])
    >>> with tempfile.TemporaryDirectory() as folder:  # doctest: +SKIP
    ...     file = os.path.join(folder, "robot.xml")
    ...     fit.export(file)
    ...     print(sysid.verify(fit, file, engine="mujoco"))
    """
    path = os.fspath(path)
    end = os.path.splitext(path)[1]
    if end not in _FORMATS:
        raise InputError(path, "is of a kind that is not verified",
                         "give a .xml (MJCF), .sdf or .urdf file")
    loaded = engines.open_engine(engine, path)
    listed = json.loads(fit.files()["export.json"])["files"]
    rows = next(of for of in listed if of["format"] == _FORMATS[end])
    trajectories: List[Dict[str, Any]] = []
    units = {of["name"]: of["unit"] for of in fit.model.joints}
    for run in fit.recordings(runs):
        prediction = fit.predict(run, open=True)
        columns = run.columns
        theirs = loaded.replay(
            prediction.t, prediction.joints, prediction.states[0],
            inputs_of(columns, (".tau", ".taux", ".tauy", ".tauz")),
            inputs_of(columns, (".cmd",)))
        trajectories += distances(
            prediction.name, prediction.joints, prediction.states, theirs,
            prediction.measured, dict(prediction), units)
    return Verification(engine, path,
                        check_parameters(loaded, rows["parameters"]),
                        trajectories, rows["notes"] + loaded.notes)


__all__ = ["Verification", "verify"]
