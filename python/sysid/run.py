"""Recordings: arrays by joint, and files."""

import os
from typing import Any, Dict, Iterable, List, Mapping, Optional, Tuple, Union

import numpy as np

from . import _native, formats, options
from ._errors import InputError
from .model import Model, as_model

Columns = Union[str, Iterable[str], Mapping[str, str]]


def _array(values: Any, name: str, rows: Optional[int]) -> np.ndarray:
    """As float64, without a copy where it is that already."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(name, f"is no array of numbers: {error}",
                         "give numbers, nan where a measurement is missing"
                         ) from None
    if array.ndim != 1:
        raise InputError(
            name, f"has the shape {array.shape}, and is to have one axis",
            "give an array for each joint, in a dict by the joints' names")
    if rows is not None and len(array) != rows:
        raise InputError(name, f"has {len(array)} numbers, and t has {rows}",
                         "give one for each time")
    if array.strides[0] % array.itemsize != 0:
        array = array.copy()
    return array


class Run:
    """A recording: arrays over time, SI units.

    Parameters
    ----------
    t : array (n,)
        Times, s, strictly increasing.
    q : dict of arrays (n,)
        Positions by joint, rad or m; of a spherical joint an array (n, 4) of
        unit quaternions w, x, y, z. NaN where a measurement is missing.
    qd : dict of arrays (n,), optional
        Velocities, rad/s or m/s; of a spherical joint (n, 3), child's axes.
    tau : dict of arrays (n,), optional
        Efforts, N m or N, each held until the next time; of a spherical joint
        (n, 3). Without any no effort was recorded.
    cmd : dict of arrays (n,), optional
        Commanded positions, rad or m.
    inputs : dict of arrays (n,), optional
        All else by the names of columns: ``"tip.px"``, ``"base.ax"``,
        ``"joint1.temperature"``, ``"joint1.motor_q"``, or a word of your own
        that effects read.
    name : str, optional
        In errors and reports.

    Arrays of float64 are not copied: do not change them while a call runs.

    Examples
    --------
    >>> import numpy as np, sysid
    >>> t = np.arange(500) * 0.01
    >>> run = sysid.Run(t=t, q={"joint1": 0.5 * np.cos(5 * t)})
    >>> run.columns["joint1.q"].shape
    (500,)
    """

    _VECTORS = {"q": ("qw", "qx", "qy", "qz"), "qd": ("wx", "wy", "wz"),
                "tau": ("taux", "tauy", "tauz")}

    def __init__(self, t: Any, q: Optional[Mapping[str, Any]] = None,
                 qd: Optional[Mapping[str, Any]] = None,
                 tau: Optional[Mapping[str, Any]] = None,
                 cmd: Optional[Mapping[str, Any]] = None,
                 inputs: Optional[Mapping[str, Any]] = None,
                 name: Optional[str] = None) -> None:
        self.name = name
        self.notices: List[str] = []
        self._handle: Optional[_native.Handle] = None
        self._columns: Dict[str, np.ndarray] = {"t": _array(t, "t", None)}
        for kind, of in (("q", q), ("qd", qd), ("tau", tau), ("cmd", cmd)):
            self._add_joints(kind, of)
        for column, values in (inputs or {}).items():
            self._add(column, values, f"inputs[{column!r}]")

    def _add(self, column: str, values: Any, place: str) -> None:
        if column in self._columns:
            raise InputError(place, f"'{column}' is given twice",
                             "give it once")
        self._columns[column] = _array(values, place, len(self.t))

    def _add_joints(self, kind: str, of: Optional[Mapping[str, Any]]) -> None:
        if of is None:
            return
        if not isinstance(of, Mapping):
            raise InputError(kind, f"is a {type(of).__name__}",
                             "give a dict of arrays by the joints' names: "
                             f"{kind}={{'joint1': array}}")
        for joint, values in of.items():
            place = f"{kind}[{joint!r}]"
            parts = self._VECTORS.get(kind, ())
            if np.ndim(values) == 2 and np.shape(values)[1] == len(parts):
                vectors = np.asarray(values, dtype=np.float64)
                for i, part in enumerate(parts):
                    self._add(f"{joint}.{part}", vectors[:, i], place)
            else:
                self._add(f"{joint}.{kind}", values, place)

    @classmethod
    def _from_handle(cls, handle: "_native.Handle") -> "Run":
        run = cls.__new__(cls)
        value = handle.value()
        run._handle, run.name = handle, value["name"]
        run.notices = value["notices"]
        run._columns = {name: array[:, 0]
                        for name, array in handle.arrays().items()}
        for array in run._columns.values():  # the handle has its own
            array.flags.writeable = False
        return run

    @property
    def t(self) -> np.ndarray:
        """Times (n,), s."""
        return self._columns["t"]

    @property
    def columns(self) -> Dict[str, np.ndarray]:
        """All arrays (n,) by the names of columns: ``"t"``, ``"joint1.q"``."""
        return dict(self._columns)

    def __getitem__(self, column: str) -> np.ndarray:
        if column not in self._columns:
            raise KeyError(f"{column}: "
                           + options.near(column, list(self._columns)))
        return self._columns[column]

    def __len__(self) -> int:
        return len(self.t)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame of all columns (n rows)."""
        return formats.need("pandas").DataFrame(self._columns)

    def save(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes a CSV that the programs read, numbers to the last bit.

        >>> import os, tempfile, sysid
        >>> model = sysid.load("pendulum3")
        >>> run = sysid.read("data/runs/pendulum3.csv", model)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     run.save(os.path.join(folder, "copy.csv"))
        ...     copy = sysid.read(os.path.join(folder, "copy.csv"), model)
        >>> bool((copy["joint1.qw"] == run["joint1.qw"]).all())
        True
        """
        formats.write_csv(path, self._columns)

    def __repr__(self) -> str:
        span = f"{self.t[-1] - self.t[0]:g} s, " if len(self) > 0 else ""
        return (f"<sysid.Run {self.name or '(no name)'}: {len(self)} samples, "
                f"{span}{', '.join(self._columns)}>")


def put_run(run: Any, number: int, request: "_native.Request") -> dict:
    """A run as a request names it."""
    if isinstance(run, (str, os.PathLike)):
        path = os.fspath(run)
        if formats.is_foreign(path):
            raise InputError(path, "is read by Python",
                             "give sysid.read(path, model, columns=...)")
        return {"file": path}
    if not isinstance(run, Run):
        raise InputError("runs", f"a {type(run).__name__} is no recording",
                         "give sysid.Run(t=..., q=...), sysid.read(path, "
                         "model), or the path of a file")
    if run._handle is not None:
        return request.object(run._handle)
    return request.table(run.name or f"run {number}", run._columns)


def as_list(runs: Any) -> List[Any]:
    """One recording, or several."""
    if runs is None:
        return []
    if isinstance(runs, (Run, str, os.PathLike)):
        return [runs]
    return list(runs)


def put_runs(runs: Any, first: int, request: "_native.Request"
             ) -> Tuple[List[dict], int]:
    entries = [put_run(run, first + i, request)
               for i, run in enumerate(as_list(runs))]
    return entries, first + len(entries)


def read(path: Union[str, "os.PathLike[str]"],
         model: Union[Model, str, "os.PathLike[str]"],
         columns: Optional[Columns] = None) -> Run:
    """Reads a recording of a model.

    Parameters
    ----------
    path : str or path
        Text with a header or without, MATLAB ``.mat``, ROS 1 bags, motion
        capture (docs/formats.md); with optional packages ``.npz``, ``.npy``,
        HDF5, parquet, ROS 2 bags and MCAP (docs/python.md).
    model : Model
        Whose recording it is.
    columns : dict or text, optional
        Which column is what: ``{"joint1.q": "pos1*pi/180"}``, or as the flag
        has it, ``"t=time_ms*0.001,joint1.q=#2"``.

    Returns
    -------
    Run
        In SI units; ``run.notices`` say what was assumed or ignored.

    Raises
    ------
    InputError
        With file, line and column of what cannot be read, and a mapping to try
        where the columns' names say nothing.

    Examples
    --------
    >>> import sysid
    >>> model = sysid.load("pendulum2_planar")
    >>> run = sysid.read("data/runs/hidden_1.csv", model)
    >>> len(run), sorted(run.columns)
    (801, ['joint1.q', 'joint2.q', 't'])
    """
    request = _native.Request()
    values = {
        "model": request.object(as_model(model)._handle),
        "options": options.given({"columns": columns}),
    }
    path = os.fspath(path)
    notices: List[str] = []
    if formats.is_foreign(path):
        table = formats.read_table(
            path, options.text_of(values["options"].get("columns")), notices)
        values["run"] = request.table(path, table)
    else:
        values["run"] = {"file": path}
    values["notices"] = notices
    return Run._from_handle(_native.call("read", values, request))
