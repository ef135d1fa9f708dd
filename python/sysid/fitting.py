"""Fits: parameters of a model from recordings."""

import csv
import dataclasses
import io
import json
import os
from typing import (Any, Dict, Iterable, Iterator, List, Mapping, Optional,
                    Tuple, Union)

import numpy as np

from . import _native, formats, options, results
from ._errors import InputError
from .model import Model
from .run import Run, as_list, put_run, read

Names = Union[str, Iterable[str], Mapping[str, Optional[float]]]


@dataclasses.dataclass(frozen=True)
class Parameter:
    """An estimate, SI units.

    ``std_error`` and ``ci95`` (the ends of the 95 % confidence interval) are
    None where the data does not determine the parameter; ``lower`` and
    ``upper`` where there is no bound.
    """

    name: str
    unit: str
    initial: Optional[float]
    value: float
    std_error: Optional[float]
    ci95: Optional[Tuple[float, float]]
    lower: Optional[float]
    upper: Optional[float]
    at_bound: bool
    identifiable: bool


def _parameter(of: Dict[str, Any]) -> Parameter:
    ends = of["ci95"]
    whole = ends is not None and None not in ends
    return Parameter(
        name=of["name"], unit=of["unit"], initial=of["initial"],
        value=of["value"], std_error=of["std_error"],
        ci95=tuple(ends) if whole else None, lower=of["lower"],
        upper=of["upper"], at_bound=of["at_bound"],
        identifiable=of["identifiable"])


class Prediction(Mapping[str, np.ndarray]):
    """A recording as a fit predicts it: arrays by channel.

    A channel is what was measured: ``"joint1"`` its position, ``"joint1.qd"``
    its velocity, ``"tip"`` a frame's position. An array has the shape (n,), or
    (n, 3) of positions of frames and angular velocities, or (n, 4) of
    quaternions x, y, z, w.

    Attributes
    ----------
    name : str
    t : array (n,)
        Times, s.
    measured : dict of arrays
        As near to the prediction as its meaning allows: angles of the same
        turn, quaternions of the same sign.
    residuals : dict of arrays
        Measured less predicted; NaN where nothing was measured.
    errors : dict
        ``error``, ``channel_errors`` and ``open`` as in fit.json, where a run
        was predicted that was not fitted.
    notices : list of str
    states : array (n, states)
        The whole state at each time: positions (of a spherical joint a
        quaternion x, y, z, w), velocities, states of effects.
    joints : list of dict
        Where a joint's numbers are in a row of ``states``: ``q`` and ``nq`` of
        its position, ``v`` and ``nv`` of its velocity; ``name``, ``ball``.
    """

    def __init__(self, handle: "_native.Handle", value: Dict[str, Any]
                 ) -> None:
        arrays = {name: array[:, 0] if array.shape[1] == 1 else array
                  for name, array in handle.arrays().items()}
        self.name: str = value["name"]
        self.t: np.ndarray = arrays["t"]
        self.measured: Dict[str, np.ndarray] = {
            name: arrays[f"{name}/measured"] for name in value["channels"]}
        self._predicted: Dict[str, np.ndarray] = {
            name: arrays[f"{name}/predicted"] for name in value["channels"]}
        self.residuals: Dict[str, np.ndarray] = {
            name: self.measured[name] - self._predicted[name]
            for name in value["channels"]}
        self.errors: Dict[str, Any] = {
            key: value[key] for key in ("error", "channel_errors", "open")
            if key in value}
        self.notices: List[str] = value.get("notices", [])
        self.states: np.ndarray = arrays["states"]
        self.joints: List[Dict[str, Any]] = value["joints"]

    def __getitem__(self, channel: str) -> np.ndarray:
        return self._predicted[_known(channel, self._predicted)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._predicted)

    def __len__(self) -> int:
        return len(self._predicted)

    def __repr__(self) -> str:
        return (f"<sysid.Prediction of {self.name}: {len(self.t)} samples, "
                f"{', '.join(self)}>")


def _known(channel: str, channels: Iterable[str]) -> str:
    if channel not in channels:
        raise InputError(channel, "no such channel was measured",
                         options.near(channel, list(channels)))
    return channel


class Samples:
    """Draws of a fit's parameters, as values and as models.

    Attributes
    ----------
    names : list of str
    values : array (draws, parameters)
        SI units, in the order of ``names``.
    urdfs : list of str
        The text of a URDF for each draw.
    remarks : list of str
        What does not vary, and why.
    """

    def __init__(self, value: Dict[str, Any]) -> None:
        rows = list(csv.reader(io.StringIO(value["csv"])))
        self.names: List[str] = rows[0][1:]
        self.values: np.ndarray = np.array(
            [[float(cell) for cell in row[1:]] for row in rows[1:]])
        self.urdfs: List[str] = value["urdfs"]
        self.remarks: List[str] = value["remarks"]
        self._csv: str = value["csv"]

    def __len__(self) -> int:
        return len(self.urdfs)

    def save(self, folder: Union[str, "os.PathLike[str]"]) -> None:
        """Writes sample_1.urdf, ... and samples.csv, a row a draw."""
        formats.make_folder(folder)
        for i, urdf in enumerate(self.urdfs):
            formats.write_text(os.path.join(folder, f"sample_{i + 1}.urdf"),
                               urdf)
        formats.write_text(os.path.join(folder, "samples.csv"), self._csv)

    def to_pandas(self) -> Any:
        """A pandas.DataFrame, a row a draw."""
        return formats.need("pandas").DataFrame(self.values,
                                                columns=self.names)

    def __repr__(self) -> str:
        return f"<sysid.Samples: {len(self)} draws of {len(self.names)}>"


class Fit(results.Result):
    """What :func:`fit` found. Printed, it is the program's text.

    Attributes
    ----------
    json : dict
        The contents of fit.json (docs/interface.md, section 6).
    parameters : dict of Parameter
    values : dict of float
    converged : bool
    covariance : array (p, p)
        Of the values, in the order of ``covariance_names``; SI units.
    notices : list of str
    """

    def __init__(self, handle: "_native.Handle", runs: Any = None,
                 columns: Any = None) -> None:
        value = handle.value()
        super().__init__(handle, value)
        self._json_text: str = value["json"]
        self.json: Dict[str, Any] = json.loads(value["json"])
        self.parameters: Dict[str, Parameter] = {
            of["name"]: _parameter(of) for of in self.json["parameters"]}
        self.values: Dict[str, float] = {
            name: of.value for name, of in self.parameters.items()}
        self.converged: bool = self.json["converged"]
        self.covariance: np.ndarray = handle.arrays()["covariance"]
        self.covariance_names: List[str] = value["names"]
        self._runs, self._columns = runs, columns

    def __getitem__(self, name: str) -> Parameter:
        if name not in self.parameters:
            raise KeyError(f"{name} was not fitted: "
                           + options.near(name, list(self.parameters)))
        return self.parameters[name]

    @property
    def effects(self) -> List[str]:
        """Names of the effects in the fitted model."""
        return self.json["effects"]

    @property
    def model(self) -> Model:
        """The model with the estimates in it, for further calls."""
        request = _native.Request()
        request.object(self._handle)
        return Model(_native.call("model", {}, request))

    def _prediction(self, held_out: bool, run: int) -> Optional[Prediction]:
        request = _native.Request()
        request.object(self._handle)
        handle = _native.call("predictions",
                              {"held_out": held_out, "run": run}, request)
        value = handle.value()
        return None if value is None else Prediction(handle, value)

    def predictions(self, held_out: bool = False) -> List[Prediction]:
        """The runs that were fitted (or held out), each as the fit predicts it.
        """
        found: List[Prediction] = []
        while True:
            prediction = self._prediction(held_out, len(found))
            if prediction is None:
                return found
            found.append(prediction)

    def residuals(self, channel: str, held_out: bool = False) -> np.ndarray:
        """Measured less predicted, of all fitted (or held-out) runs in turn.

        Parameters
        ----------
        channel : str
            ``"joint1"`` is its position, ``"joint1.qd"`` its velocity.

        Returns
        -------
        array (n,), or (n, 3 or 4)
            In the channel's unit; NaN where nothing was measured.

        Examples
        --------
        >>> import numpy as np, sysid
        >>> model = sysid.load("pendulum2_planar")
        >>> fit = sysid.fit(model, ["data/runs/hidden_1.csv"])
        >>> fit.residuals("joint1").shape
        (801,)
        """
        runs = self.predictions(held_out)
        known = [name for run in runs for name in run]
        _known(channel, known)
        return np.concatenate([run.residuals[channel] for run in runs
                               if channel in run])

    def predict(self, run: Union[Run, str, "os.PathLike[str]"],
                open: bool = False) -> Prediction:
        """Predicts a recording that was not fitted.

        Parameters
        ----------
        run : Run or path
        open : bool
            From one start over the whole run; else, as held-out runs are
            judged, from the start of each segment (``fit.json["segment_s"]``).
            Starts are estimated from the recording.

        Examples
        --------
        >>> import sysid
        >>> model = sysid.load("pendulum2_planar")
        >>> fit = sysid.fit(model, ["data/runs/hidden_1.csv"])
        >>> prediction = fit.predict("data/runs/hidden_3.csv")
        >>> prediction["joint1"].shape == prediction.t.shape
        True
        """
        request = _native.Request()
        request.object(self._handle)
        values = {"run": put_run(run, 1, request), "open": bool(open)}
        handle = _native.watch("predict", values, request)
        return Prediction(handle, handle.value())

    def sample(self, count: int, seed: int = 1) -> Samples:
        """Draws models from the estimate's distribution, each a possible body.

        >>> import sysid
        >>> fit = sysid.fit("pendulum3", ["data/runs/pendulum3.csv"])
        >>> fit.sample(100).values.shape
        (100, 3)
        """
        return Samples(self._ask("sample", count=int(count), seed=int(seed)))

    def files(self) -> Dict[str, str]:
        """The texts of all files that :meth:`save` writes, by name."""
        return self._ask("files")["files"]

    def export(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Writes the fitted model for a simulator, by the name's end.

        ``.xml`` is MJCF (MuJoCo), ``.sdf`` SDFormat (Gazebo, Drake), ``.urdf``
        a URDF with Drake's rotors. What a format cannot say is in the file's
        comments, and in the ``export.json`` that :meth:`save` writes
        (docs/exports.md).

        Raises
        ------
        InputError
            For other ends, and where the model cannot be written: MuJoCo
            takes no inertia that no body has.

        Examples
        --------
        >>> import os, tempfile, sysid
        >>> fit = sysid.fit("pendulum2_planar", ["data/runs/hidden_1.csv"])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     fit.export(os.path.join(folder, "robot.xml"))
        ...     os.listdir(folder)
        ['robot.xml']
        """
        path = os.fspath(path)
        end = os.path.splitext(path)[1]
        if end not in (".urdf", ".xml", ".sdf"):
            raise InputError(path, "is of a kind that is not written",
                             "export('robot.xml') writes MJCF, .sdf SDFormat, "
                             ".urdf a URDF")
        files = self.files()
        name = "identified" + end
        if name not in files:
            listed = json.loads(files["export.json"])["files"]
            why = next(of["why_not"] for of in listed if of["file"] == name)
            raise InputError(path, f"cannot be written: {why}")
        formats.write_text(path, files[name])

    def recordings(self, runs: Any = None) -> List[Run]:
        """The recordings of ``runs`` (default: those that were fitted), read.
        """
        return [run if isinstance(run, Run)
                else read(run, self.model, columns=self._columns)
                for run in as_list(self._runs if runs is None else runs)]

    def to_pandas(self) -> Any:
        """A pandas.DataFrame of the parameters, by name."""
        pandas = formats.need("pandas")
        rows = [dataclasses.asdict(of) for of in self.parameters.values()]
        return pandas.DataFrame(rows).set_index("name")

    def _repr_html_(self) -> str:
        text = self._ask("text", colour=False)
        rows = [[of.name, results.number(of.initial),
                 results.number(of.value, 7),
                 "not identifiable" if of.std_error is None
                 else results.number(1.959963984540054 * of.std_error, 2),
                 of.unit + (" (at its bound)" if of.at_bound else "")]
                for of in self.parameters.values()]
        error = self.json["error"]
        channels = [[of["name"], f"{results.number(of['rms'])} {of['unit']}",
                     results.number(of["normalized_rms"], 3),
                     results.number(of["fit_percent"], 3)]
                    for of in error["channels"]]
        state = ("" if self.converged else
                 results.sentence_html(self.json["termination"], False))
        return (
            f"<h4>{self.json['model']}</h4>" + state
            + results.sentence_html(text["sentence"], text["good"])
            + results.table_html(
                ["parameter", "start", "value", "± (95 %)", "unit"],
                rows)
            + results.table_html(
                ["channel", "error (rms)", "times its noise", "fit, %"],
                channels)
            + results.notices_html(self.notices))


def fit(model: Union[Model, str, "os.PathLike[str]"], runs: Any, *,
        free: Optional[Names] = None, fix: Optional[Names] = None,
        add: Optional[Union[str, Iterable[str]]] = None, holdout: Any = None,
        solver: Optional[str] = None, progress: Any = None, stop: Any = None,
        **more: Any) -> Fit:
    """Fits a model's free parameters to recordings.

    Parameters
    ----------
    model : Model, or what :func:`load` reads
    runs : list of Run or of paths
        Fitted together; paths may be patterns (``"runs/*.csv"``).
    free : list or dict, optional
        Parameters to fit: names and patterns (``"link*.mass"``,
        ``"inertial"``), with their starts as a dict or ``"a=0.5"``; ``"none"``
        compares the model as it stands. Default: the specification's.
    fix : list or dict, optional
        Parameters to hold, at a value or the model's.
    add : list, optional
        Effects to add, whose parameters are fitted:
        ``"coulomb_friction@joint1"``, ``"viscous_damping@*"``,
        ``"custom@joint1: -k*q^3"``.
    holdout : list of Run or of paths, optional
        Only predicted.
    solver : str, optional
        ``"lm"``, ``"inverse_dynamics"``, ``"adam"`` or ``"gmm"``.
    progress : bool or function, optional
        A bar (with tqdm), or a function of what is done, the iteration, how
        many there are at most (0: unknown), and the error in multiples of the
        noise. Default: a bar where a person looks on.
    stop : threading.Event, optional
        Ends the fit within a second once it is set, as Ctrl-C does, with the
        best point so far: ``fit.converged`` is then False.
    **more
        The program's flags by name: ``segment=``, ``step=``, ``noise=`` (SI),
        ``time=`` (s), ``start=``, ``loss=``, ``residual=``, ``integrator=``,
        ``check=``, ``threads=``, ``spec=``, ``lock=``, ``columns=``,
        ``shift=``, ``ignore=``, ``skip_bad_runs=`` (docs/interface.md,
        section 1).

    Raises
    ------
    InputError
        For what is wrong, with its place and what to do.
    Stopped, KeyboardInterrupt
        Where ``stop`` or Ctrl-C ended it before there was a first point.

    Examples
    --------
    >>> import sysid
    >>> model = sysid.load("pendulum3")
    >>> fit = sysid.fit(model, ["data/runs/pendulum3.csv"],
    ...                 free=["link1.length"],
    ...                 fix={"link2.length": 0.4, "link3.length": 0.35})
    >>> fit["link1.length"].unit, fit.converged
    ('m', True)
    >>> print(f"{fit.values['link1.length']:.3f}")
    0.300
    """
    given = {"free": free, "fix": fix, "add": add, "solver": solver, **more}
    return Fit(results.run_call("fit", model, runs, holdout, given, progress,
                                stop), runs, more.get("columns"))
