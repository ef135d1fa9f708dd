"""What a fit exports arrives in MuJoCo: effects are planted, exported, loaded
and replayed; the motion is that of sysid_simulate within the integrators'
tolerance, and every loss is reported."""

import csv
import json

import numpy as np
import pytest

from sysid import engines

mujoco = pytest.importorskip(
    "mujoco", reason="MuJoCo is not installed: pip install mujoco")

DOUBLE, CART, ARM = "pendulum2_planar", "cartpole", "arm7"

# RK4 at 1 ms here and there; sampled efforts meet their delays at other stages
# of a step; friction stops within two steps there, at once here.
SMOOTH, KINKED, DELAYED, DRY = 1e-8, 1e-5, 2e-3, 2e-3


def case(name, model, effects, tolerance=SMOOTH, driven=False, lost=()):
    return pytest.param(model, effects, tolerance, driven, lost, id=name)


ARRIVALS = [
    case("nothing", DOUBLE, {}),
    case("a cart", CART, {}),
    case("an arm", ARM, {}),
    case("damping", DOUBLE, {"viscous_damping@joint1": [0.1]}),
    case("damping of all", DOUBLE, {"viscous_damping@joint1": [0.1],
                                    "viscous_damping@joint2": [0.05]}),
    case("friction", DOUBLE, {"coulomb_friction@joint1": [0.05]}, DRY),
    case("friction of a slide", CART, {"coulomb_friction@slider": [0.3]}, DRY),
    case("damping and friction", DOUBLE,
         {"viscous_damping@joint2": [0.02],
          "coulomb_friction@joint2": [0.02]}, DRY),
    case("quadratic drag", DOUBLE, {"quadratic_drag@joint1": [0.05]}, KINKED),
    case("cubic damping", DOUBLE, {"cubic_damping@joint2": [0.02]}),
    case("spring", DOUBLE, {"spring@joint1": [2.0, 0.3]}),
    case("spring of a slide", CART, {"spring@slider": [20.0, -0.2]}),
    case("armature", DOUBLE, {"armature@joint2": [0.05]}),
    case("armatures of an arm", ARM, {"armature@joint1": [0.3],
                                      "armature@joint4": [0.2]}),
    case("effort bias", DOUBLE, {"effort_bias@joint1": [0.5]}),
    case("bias of a driven joint", DOUBLE, {"effort_bias@joint2": [0.3]},
         driven=True),
    case("tilted gravity", DOUBLE, {"gravity_tilt@base": [0.02, 0.1]}),
    case("sensor offset", DOUBLE, {"sensor_offset@joint1": [0.1]}),
    case("offset and spring", DOUBLE, {"sensor_offset@joint2": [-0.2],
                                       "spring@joint2": [1.0, 0.4]}),
    case("cogging", DOUBLE, {"cogging@joint1": [0.1, 0.2, 6.0]}),
    case("cogging behind an offset", DOUBLE,
         {"cogging@joint2": [0.1, -0.05, 4.0],
          "sensor_offset@joint2": [0.3]}),
    case("presliding friction", DOUBLE,
         {"presliding_friction@joint1": [0.1, 0.05]}, DRY),
    case("driven", DOUBLE, {}, driven=True),
    case("effort gain", DOUBLE, {"effort_gain@joint1": [0.2]}, driven=True),
    case("wrong sign", DOUBLE, {"effort_gain@joint2": [-2.0]}, driven=True),
    case("effort delay", DOUBLE, {"effort_delay@base": [0.02]}, DELAYED,
         driven=True),
    case("actuator lag", DOUBLE, {"actuator_lag@joint1": [0.03]}, DELAYED,
         driven=True),
    case("effort limit", DOUBLE, {"effort_limit@joint1": [1.0, 0.0]}, SMOOTH,
         driven=True, lost=("joint1.inverse_no_load_speed",)),
    case("gear coupling", DOUBLE,
         {"gear_coupling@joint1,joint2": [0.05, 0.02, 0.0, -1.0]}),
    case("three at once", DOUBLE,
         {"viscous_damping@joint1": [0.05], "armature@joint1": [0.02],
          "spring@joint2": [0.5, 0.1]}),
]

LOSSES = [
    case("stick", DOUBLE, {"stribeck_friction@joint1": [0.05, 0.1, 0.1]},
         lost=("joint1.static_friction", "joint1.stribeck_velocity")),
    case("sensor gain", DOUBLE, {"sensor_gain@joint1": [0.1]},
         lost=("joint1.sensor_gain",)),
    case("drag in the air", DOUBLE, {"aerodynamic_drag@link2": [0.1]},
         lost=("link2.drag",)),
    case("asymmetry", DOUBLE,
         {"asymmetric_friction@joint1": [0.05, 0.1, 0.01, 0.02]},
         lost=("joint1.friction_asymmetry", "joint1.damping_asymmetry")),
]

NAMES = {"viscous_damping": ["damping"], "coulomb_friction": ["friction"],
         "quadratic_drag": ["quadratic_drag"], "armature": ["armature"],
         "cubic_damping": ["cubic_damping"], "effort_bias": ["effort_bias"],
         "spring": ["stiffness", "spring_reference"],
         "sensor_offset": ["sensor_offset"], "sensor_gain": ["sensor_gain"],
         "cogging": ["cogging_sin", "cogging_cos", "cogging_order"],
         "presliding_friction": ["presliding_friction", "presliding_length"],
         "effort_gain": ["effort_gain"], "actuator_lag": ["actuator_lag"],
         "effort_limit": ["effort_limit", "inverse_no_load_speed"],
         "stribeck_friction": ["friction", "static_friction",
                               "stribeck_velocity"],
         "asymmetric_friction": ["friction", "damping", "friction_asymmetry",
                                 "damping_asymmetry"],
         "aerodynamic_drag": ["drag"]}


def values_of(effects):
    """Parameters by name, of each effect in turn."""
    found = []
    for effect, values in effects.items():
        kind, target = effect.split("@")
        if kind == "gear_coupling":
            target = target.split(",")[1]
            names = [f"coupling_{of}" for of in
                     ("armature", "damping", "friction", "sign")]
        else:
            names = NAMES.get(kind, [])
        names = {"effort_delay": ["effort_delay"],
                 "gravity_tilt": ["gravity_tilt_x", "gravity_tilt_y"]}.get(
                     kind, [f"{target}.{name}" for name in names])
        found.append(list(zip(names, values)))
    return found


def read(path):
    with open(path, encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if line[0] != "#"))
    numbers = np.array(rows[1:], dtype=float)
    return {name: numbers[:, i] for i, name in enumerate(rows[0])}


def simulate(program, folder, model, effects, driven):
    """The recording that is to be replayed, without noise."""
    named = list(zip(effects, values_of(effects)))
    duration = "1" if model == ARM else "3"  # later its wrist spins
    arguments = ["--model", model, "--duration", duration, "--rate", "200",
                 "--noise", "0", "--initial", "random", "--step", "0.001",
                 "--out_csv", str(folder / "run.csv")]
    if effects:
        arguments += ["--add", ",".join(
            f"{effect.replace(',', '+')}={of[0][1]!r}"
            for effect, of in named)]
    rest = [f"{name}={value!r}" for _, of in named for name, value in of[1:]]
    if rest:
        arguments += ["--set", ",".join(rest)]
    if driven:
        arguments += ["--excite", "multisine", "--amplitude", "0.2"]
    program("sysid_simulate", *arguments)
    return read(folder / "run.csv")


def export(program, folder, model, effects):
    """The model with these effects, as a fit writes it."""
    arguments = ["--model", model, "--traj", str(folder / "run.csv"), "--free",
                 "none", "--check", "none", "--out", str(folder / "out")]
    if effects:
        arguments += ["--add", ",".join(of.replace(",", "+")
                                        for of in effects),
                      "--fix", ",".join(f"{name}={value!r}" for of in
                                        values_of(effects)
                                        for name, value in of)]
    program("sysid_fit", *arguments)
    listed = json.loads((folder / "out" / "export.json").read_text())
    return next(of for of in listed["files"] if of["format"] == "MJCF")


def replayed(folder, columns, effects, name="mujoco", end="xml"):
    """Positions in an engine as the sensors see them, by joint."""
    engine = engines.open_engine(name,
                                 str(folder / "out" / f"identified.{end}"))
    names = [name[:-2] for name in columns if name.endswith(".q")]
    values = dict(pair for of in values_of(effects) for pair in of)
    offsets = [values.get(f"{name}.sensor_offset", 0.0) for name in names]
    count = len(names)
    joints = [{"name": name, "q": i, "nq": 1, "v": count + i, "nv": 1,
               "ball": False} for i, name in enumerate(names)]
    start = np.array(
        [columns[f"{name}.q"][0] - offset
         for name, offset in zip(names, offsets)] + [0.0] * count)
    efforts = {name: of for name, of in columns.items()
               if name.endswith(".tau")}
    states = engine.replay(columns["t"], joints, start, efforts, {})
    return engine, {name: states[:, i] + offsets[i]
                    for i, name in enumerate(names)}


@pytest.mark.parametrize("model, effects, tolerance, driven, lost", ARRIVALS)
def test_arrives(program, tmp_path, model, effects, tolerance, driven, lost):
    if any(effect.startswith(("cogging", "presliding")) for effect in effects
           ) and int(mujoco.__version__.split(".")[0]) < 4:
        pytest.skip("a dcmotor without inputs needs MuJoCo 4.0")
    columns = simulate(program, tmp_path, model, effects, driven)
    written = export(program, tmp_path, model, effects)
    assert written["lost"] == list(lost)
    engine, there = replayed(tmp_path, columns, effects)
    for row in written["parameters"]:
        if row["arrival"] == "lost":
            continue
        found = engine.number(row["name"])
        if row["name"].endswith("presliding_length"):
            continue  # in the stiffness of the bristle, which is not told
        assert found == pytest.approx(row["value"], rel=1e-12, abs=1e-12)
    moved = 0.0
    for joint, positions in there.items():
        here = columns[f"{joint}.q"]
        scale = max(1.0, float(np.ptp(here)))
        assert np.max(np.abs(positions - here)) < tolerance * scale, joint
        moved = max(moved, float(np.ptp(here)))
    assert moved > 0.1


@pytest.mark.parametrize("model, effects, tolerance, driven, lost", LOSSES)
def test_says_what_is_lost(program, tmp_path, model, effects, tolerance,
                           driven, lost):
    columns = simulate(program, tmp_path, model, effects, driven)
    written = export(program, tmp_path, model, effects)
    assert set(lost) <= set(written["lost"])
    for row in written["parameters"]:
        assert row["arrival"] != "lost" or row["remark"]
    # And it does make a difference.
    _, there = replayed(tmp_path, columns, effects)
    assert max(np.max(np.abs(there[name[:-2]] - columns[name]))
               for name in columns if name.endswith(".q")) > 1e-3


@pytest.mark.parametrize("effects", [
    {}, {"viscous_damping@joint1": [0.1]}, {"armature@joint2": [0.05]},
    {"spring@joint1": [2.0, 0.3]}],
    ids=["nothing", "damping", "rotor", "spring"])
@pytest.mark.parametrize("name, package, end", [
    ("drake", "pydrake", "sdf"), ("drake", "pydrake", "urdf"),
    ("pinocchio", "pinocchio", "urdf")])
def test_arrives_in_other_engines(program, tmp_path, name, package, end,
                                  effects):
    pytest.importorskip(package)
    columns = simulate(program, tmp_path, DOUBLE, effects, False)
    export(program, tmp_path, DOUBLE, effects)
    listed = json.loads((tmp_path / "out" / "export.json").read_text())
    rows = next(of for of in listed["files"]
                if of["file"].endswith(end))["parameters"]
    engine, there = replayed(tmp_path, columns, effects, name, end)
    for row in rows:
        found = engine.number(row["name"])
        if (row["arrival"] == "arrived" and found is not None
                and not engine.passes_by(row["name"])):
            assert found == pytest.approx(row["value"], rel=1e-12)
    if any(row["arrival"] == "lost" or engine.passes_by(row["name"])
           for row in rows):
        return
    for joint, positions in there.items():
        assert np.max(np.abs(positions - columns[f"{joint}.q"])) < 1e-5


@pytest.mark.parametrize("name", ["pendulum1", "pendulum2", "pendulum3",
                                  "cartpole", "arm7", "rod_and_bob",
                                  "pendulum3_planar"])
def test_every_shipped_model_loads(program, tmp_path, name):
    program("sysid_simulate", "--model", name, "--duration", "1", "--noise",
            "1e-4", "--out_csv", str(tmp_path / "run.csv"))
    export(program, tmp_path, name, {})
    model = mujoco.MjModel.from_xml_path(
        str(tmp_path / "out" / "identified.xml"))
    assert model.nv > 0


def test_a_fitted_friction_is_in_the_file(program, tmp_path):
    """Planted, identified from noise, exported."""
    simulate(program, tmp_path, DOUBLE, {"viscous_damping@joint1": [0.05]},
             False)
    program("sysid_fit", "--model", DOUBLE, "--traj",
            str(tmp_path / "run.csv"), "--add", "viscous_damping@joint1",
            "--noise", "1e-4", "--check", "none", "--out",
            str(tmp_path / "out"))
    fitted = json.loads((tmp_path / "out" / "fit.json").read_text())
    engine = engines.Mujoco(str(tmp_path / "out" / "identified.xml"))
    for of in fitted["parameters"]:
        assert engine.number(of["name"]) == pytest.approx(of["value"],
                                                          rel=1e-12)
    assert engine.number("joint1.damping") == pytest.approx(0.05, rel=1e-3)


def test_an_engine_that_is_not_there_says_how_to_get_it():
    with pytest.raises(ValueError, match="known: "):
        engines.open_engine("unity", "robot.xml")
    with pytest.raises(ValueError, match="fit.export"):
        engines.open_engine("mujoco", "no_such.xml")
