"""MJCF as URDF and specification: the same motion, and what stands in the way.
"""

import numpy as np
import pytest

from sysid import InputError, engines, mjcf
from test_arrival import read

mujoco = pytest.importorskip(
    "mujoco", reason="MuJoCo is not installed: pip install mujoco")

ARM = """<mujoco model="two joints on a body">
 <compiler angle="radian"/>
 <default><joint damping="0.02"/></default>
 <option gravity="0.3 -0.2 -9.7"/>
 <worldbody>
  <body name="upper" pos="0.1 0 1" quat="0.9 0.1 -0.2 0.3">
   <joint name="pan" axis="0 0 1" pos="0.02 0.01 0" ref="0.2" armature="0.03"/>
   <joint name="lift" axis="0.6 0.8 0" pos="-0.05 0.02 0.1" stiffness="2"
    springref="0.3"/>
   <geom type="capsule" size="0.05" fromto="0 0 0 0 0.1 -0.4"/>
   <body name="slider" pos="0 0.1 -0.4" euler="0.3 0.2 -0.5">
    <joint name="slide" type="slide" axis="0.6 0 0.8" ref="0.1"
     stiffness="30" springref="0.05" damping="0.5 0.2 0.1"/>
    <geom type="box" size="0.1 0.05 0.07" pos="0.02 0.03 0.01"/>
   </body>
  </body>
 </worldbody>
 <actuator><motor name="m" joint="pan" gear="5"/>
  <position name="p" joint="lift" kp="20" kv="2"/></actuator>
</mujoco>"""


def with_body(body, more=""):
    return mujoco.MjModel.from_xml_string(
        f"<mujoco><worldbody><body name='b'>{body}<geom size='0.1'/></body>"
        f"</worldbody>{more}</mujoco>")


def test_the_motion_is_that_of_mujoco(program, tmp_path):
    model = mujoco.MjModel.from_xml_string(ARM)
    translated = mjcf.translate(model)
    assert not translated.blocks
    (tmp_path / "arm.urdf").write_text(translated.urdf)
    (tmp_path / "arm.sysid.yaml").write_text(translated.specification)
    (tmp_path / "start.csv").write_text(
        "t,pan.q,lift.q,slide.q,pan.qd,lift.qd,slide.qd\n"
        "0,0.4,-0.3,0.02,0,0,0\n0.01,0.4,-0.3,0.02,0,0,0\n")
    # sysid_simulate reads no specification: what it says, as flags.
    lines = translated.specification.splitlines()
    at = lines.index("effects:")
    values = dict(line.strip().replace("'", "").split(": ")
                  for line in lines[1:at])
    effects = [line.strip(" -'") for line in lines[at + 1:]]
    first = {"spring": "stiffness", "armature": "armature",
             "quadratic_drag": "quadratic_drag",
             "cubic_damping": "cubic_damping"}
    added = []
    for effect in effects:
        kind, target = effect.split("@")
        name = ("gravity_tilt_x" if kind == "gravity_tilt"
                else f"{target}.{first[kind]}")
        added.append(f"{effect}={values.pop(name)}")
    program("sysid_simulate", "--model", str(tmp_path / "arm.urdf"),
            "--initial", str(tmp_path / "start.csv"), "--add",
            ",".join(added), "--set",
            ",".join(f"{name}={value}" for name, value in values.items()),
            "--noise", "0", "--duration", "2", "--rate", "100", "--step",
            "0.0005", "--out_csv", str(tmp_path / "run.csv"))
    columns = read(tmp_path / "run.csv")
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    model.opt.timestep = 0.0005
    model.opt.disableflags |= (mujoco.mjtDisableBit.mjDSBL_CONTACT
                               | mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data = mujoco.MjData(model)
    names = ("pan", "lift", "slide")
    data.qpos[:] = [columns[f"{name}.q"][0] for name in names]
    for k in range(len(columns["t"])):
        here = [columns[f"{name}.q"][k] for name in names]
        # The drag has a kink at rest, where RK4 is of lower order.
        np.testing.assert_allclose(data.qpos, here, rtol=0, atol=1e-6)
        mujoco.mj_step(model, data, nstep=20)


def test_actuators_are_explained():
    notices = mjcf.translate(mujoco.MjModel.from_xml_string(ARM)).notices
    assert "actuator 'm': pan.tau = 5 ctrl" in notices
    assert ("actuator 'p' is a drive: with its ctrl as lift.cmd "
            "add=['position_drive@lift'], kp = 20, kd = 2") in notices


@pytest.mark.parametrize("body, more, element, why", [
    ("<freejoint name='root'/>", "", "joint 'root' of body 'b'", "is free"),
    ("<joint name='j'/>", "<option density='1.2'/>", "option density",
     "is a fluid"),
    ("<joint name='j'/>", "<equality><connect body1='b' anchor='0 0 0'/>"
     "</equality>", "equality", "only MuJoCo solves"),
    ("<joint name='j'/>", "<tendon><fixed name='t' stiffness='1'>"
     "<joint joint='j' coef='1'/></fixed></tendon>", "tendon 't'",
     "has stiffness"),
    ("", "", "worldbody", "has no joint that moves"),
])
def test_says_what_stands_in_the_way(body, more, element, why):
    blocks = mjcf.translate(with_body(body, more)).blocks
    assert len(blocks) >= 1
    assert blocks[0][0].startswith(element)
    assert why in blocks[0][1]
    assert blocks[0][2]  # how to go on


def test_free_joints_can_be_held():
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body name='b'><freejoint name='root'/>"
        "<geom size='0.1'/><body><joint name='j'/><geom size='0.1'/></body>"
        "</body></worldbody></mujoco>")
    assert mjcf.translate(model).blocks
    held = mjcf.translate(model, hold=["root"])
    assert not held.blocks and list(held.joints) == ["j"]
    with pytest.raises(InputError, match="'rot' is no joint"):
        mjcf.translate(model, hold=["rot"])


def test_a_file_that_does_not_compile_says_so(tmp_path):
    (tmp_path / "bad.xml").write_text("<mujoco><worldbody><body/><x/>"
                                      "</worldbody></mujoco>")
    with pytest.raises(InputError, match="MuJoCo does not compile it"):
        mjcf.compile_model(tmp_path / "bad.xml")


def test_engines_and_sources_are_told_apart():
    assert mjcf.is_source("robot.xml") and not mjcf.is_source("robot.urdf")
    assert mjcf.is_source(mujoco.MjModel.from_xml_string(ARM))
    assert engines.Mujoco.name == "mujoco"
