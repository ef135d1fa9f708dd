"""Models: what the library reads of a URDF, and fitted ones."""

import os
import tempfile
from typing import Any, Dict, Iterable, List, Optional, Union

from . import _native, mjcf
from ._errors import InputError


class Model:
    """A mechanism with effects, read by :func:`load` or fitted (``fit.model``).

    >>> import sysid
    >>> model = sysid.load("cartpole")
    >>> [(joint["name"], joint["unit"]) for joint in model.joints]
    [('slider', 'm'), ('hinge', 'rad')]
    >>> model.parameters["pole.mass"], model.units["pole.mass"]
    (0.2, 'kg')

    Attributes
    ----------
    name : str
    joints : list of dict
        Joints that move: ``name``, ``type``, ``unit`` of a position (rad, m),
        ``effort_unit`` (N m, N).
    links : list of str
    parameters : dict
        Name to nominal value, SI units (:attr:`units` has them).
    units : dict
    effects : list of str
        Names of the effects in it: ``"viscous_damping@joint1"``.
    columns : list of str
        What a recording of it may have: ``"t"``, ``"joint1.q"``, ...
    notices : list of str
        What was assumed or is doubtful.
    """

    def __init__(self, handle: "_native.Handle") -> None:
        self._handle = handle
        value = handle.value()
        self.name: str = value["name"]
        self.joints: List[Dict[str, str]] = value["joints"]
        self.links: List[str] = value["links"]
        self.parameters: Dict[str, float] = {
            name: of["value"] for name, of in value["parameters"].items()}
        self.units: Dict[str, str] = {
            name: of["unit"] for name, of in value["parameters"].items()}
        self.effects: List[str] = value["effects"]
        self.columns: List[str] = value["columns"]
        self.notices: List[str] = value["notices"]
        self._folder: Optional[Any] = None  # of what was translated

    def __repr__(self) -> str:
        joints = ", ".join(joint["name"] for joint in self.joints)
        effects = f", effects {', '.join(self.effects)}" if self.effects else ""
        return f"<sysid.Model {self.name}: joints {joints}{effects}>"


def load(path_or_name: Union[str, "os.PathLike[str]", Any],
         hold: Iterable[str] = ()) -> Model:
    """Reads a model: a URDF file, MJCF, or a shipped model by its name.

    A specification beside the file (``robot.sysid.yaml``) says what is free
    where a fit does not.

    MJCF is compiled by the package ``mujoco`` and translated: bodies, joints,
    damping, friction, armature, springs, gravity, coupled joints. What acts on
    the free motion and cannot be translated is an error that names it; what is
    left out without a change of the free motion (contacts, actuators) is in
    :attr:`Model.notices`. Joints keep their names, and positions are qpos.

    Parameters
    ----------
    path_or_name : str, path, mujoco.MjSpec or mujoco.MjModel
        ``"robot.urdf"``, ``"robot.xml"`` (MJCF), or one of ``pendulum1..3``,
        ``pendulum2_planar``, ``pendulum3_planar``, ``cartpole``, ``arm7``.
    hold : list of str, optional
        Joints of MJCF that stay where the file has them: free joints are not
        read.

    Raises
    ------
    InputError
        For a file that is no model or wrong, with line and column.

    Examples
    --------
    >>> import sysid
    >>> sysid.load("pendulum2_planar")
    <sysid.Model pendulum2_planar: joints joint1, joint2>
    """
    if mjcf.is_source(path_or_name):
        return _load_mjcf(path_or_name, hold)
    if not isinstance(path_or_name, (str, os.PathLike)):
        raise InputError(
            "load", f"a {type(path_or_name).__module__}."
            f"{type(path_or_name).__qualname__} is no model that it reads",
            "give the path of a URDF or MJCF file, or the name of a shipped "
            "model")
    name = os.fspath(path_or_name)
    if os.sep in name or name.endswith(".urdf"):
        name = os.path.abspath(name)
    elif os.path.exists(name):  # a file of another format: its reader says so
        name = os.path.abspath(name)
    return Model(_native.call("load", {"name": name}, _native.Request()))


def _load_mjcf(source: Any, hold: Iterable[str]) -> Model:
    """By a URDF and a specification in a folder of its own, which lives as
    long as the model."""
    translated = mjcf.translate(mjcf.compile_model(source), hold)
    is_path = isinstance(source, (str, os.PathLike))
    place = os.fspath(source) if is_path else "MjSpec"
    if translated.blocks:
        element, why, hint = translated.blocks[0]
        more = len(translated.blocks) - 1
        raise InputError(f"{place}, {element}", why
                         + (f"; so are {more} more" if more else ""), hint)
    stem = os.path.splitext(os.path.basename(place))[0]
    folder = tempfile.TemporaryDirectory(prefix="sysid_mjcf_")
    file = os.path.join(folder.name, f"{stem}.urdf")
    with open(file, "w", encoding="utf-8") as out:
        out.write(translated.urdf)
    if translated.specification:
        with open(os.path.join(folder.name, f"{stem}.sysid.yaml"), "w",
                  encoding="utf-8") as out:
            out.write(translated.specification)
    model = load(file)
    model._folder = folder
    model.notices += translated.notices
    return model


def as_model(model: Union[Model, str, "os.PathLike[str]"]) -> Model:
    return model if isinstance(model, Model) else load(model)
