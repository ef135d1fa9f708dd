"""Recordings of a model's own motion."""

import os
from typing import Any, Dict, Iterable, Mapping, Optional, Union

from . import _native, options
from .model import Model, as_model
from .run import Run, put_run

Values = Union[str, Iterable[str], Mapping[str, float]]
Recording = Union[Run, str, "os.PathLike[str]"]


def simulate(model: Union[Model, str, "os.PathLike[str]"], *,
             set: Optional[Values] = None, add: Optional[Values] = None,
             initial: Optional[Recording] = None,
             efforts: Optional[Recording] = None,
             track: Optional[Recording] = None,
             inputs: Optional[Recording] = None,
             **more: Any) -> Run:
    """Makes a recording from a model, with effects and noise.

    Parameters
    ----------
    model : Model, or what :func:`load` reads
    set : dict, optional
        Values of parameters, SI units: ``{"link1.length": 0.3}``.
    add : dict, optional
        Effects and their first parameters:
        ``{"coulomb_friction@joint1": 0.02}``.
    initial : Run or path, optional
        Starts as its first row; ``"random"``, the default, at rest at random
        angles up to ``tilt`` (0.6 rad or m).
    efforts : Run or path, optional
        Whose efforts are applied.
    track : Run or path, optional
        Whose positions a controller follows, with ``gains="200,20"``
        (N m/rad, N m s/rad).
    inputs : Run or path, optional
        What effects read: commands, temperatures, the base's acceleration.
    **more
        The program's flags by name: ``duration=`` (10 s), ``rate=`` (100 Hz),
        ``noise=`` (1e-3 rad or m), ``seed=``, ``excite="multisine"``,
        ``amplitude=``, ``band="0.1,2"`` (Hz), ``gains=``, ``tilt=``,
        ``motor_sensors=``, ``integrator=``, ``step=``, ``lock=``
        (docs/simulation.md).

    Examples
    --------
    >>> import sysid
    >>> run = sysid.simulate("pendulum2_planar", duration=5, rate=200,
    ...                      add={"coulomb_friction@joint1": 0.02}, seed=3)
    >>> len(run), sorted(run.columns)
    (1001, ['joint1.q', 'joint2.q', 't'])
    """
    request = _native.Request()
    values: Dict[str, Any] = {
        "model": request.object(as_model(model)._handle),
        "options": options.given({"set": set, "add": add, **more}),
    }
    runs = {"efforts": efforts, "track": track, "inputs": inputs}
    if isinstance(initial, str) and initial == "random":
        values["options"]["initial"] = "random"
    else:
        runs["initial"] = initial
    for number, (name, run) in enumerate(runs.items()):
        if run is not None:
            values["options"][name] = put_run(run, number + 1, request)
    return Run._from_handle(
        _native.watch("simulate", values, request))
