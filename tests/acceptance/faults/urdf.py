"""URDF text: what a fault changes in it, and the same mechanism for MuJoCo."""

import dataclasses
import re
import xml.etree.ElementTree as ElementTree


@dataclasses.dataclass
class Link:
    name: str
    mass: float = 0.0
    com: tuple = (0.0, 0.0, 0.0)
    inertia: tuple = (0.0,) * 6  # ixx, iyy, izz, ixy, ixz, iyz


@dataclasses.dataclass
class Joint:
    name: str
    kind: str  # hinge, slide, ball or fixed
    parent: str
    child: str
    xyz: str
    rpy: str
    axis: str


_KINDS = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide",
          "spherical": "ball", "fixed": "fixed"}
_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def _numbers(text):
    return tuple(float(word) for word in text.split())


def parse(text):
    """Links by name and joints in the file's order."""
    root = ElementTree.fromstring(text)
    links = {}
    for element in root.findall("link"):
        link = Link(element.get("name"))
        body = element.find("inertial")
        if body is not None:
            link.mass = float(body.find("mass").get("value"))
            origin = body.find("origin")
            if origin is not None:
                link.com = _numbers(origin.get("xyz", "0 0 0"))
                # Then moments were in other axes: no model here has that.
                assert not any(_numbers(origin.get("rpy", "0 0 0")))
            inertia = body.find("inertia")
            link.inertia = tuple(float(inertia.get(m)) for m in _MOMENTS)
        links[link.name] = link
    joints = []
    for element in root.findall("joint"):
        origin, axis = element.find("origin"), element.find("axis")
        joints.append(Joint(
            element.get("name"), _KINDS[element.get("type")],
            element.find("parent").get("link"),
            element.find("child").get("link"),
            "0 0 0" if origin is None else origin.get("xyz", "0 0 0"),
            "0 0 0" if origin is None else origin.get("rpy", "0 0 0"),
            "1 0 0" if axis is None else axis.get("xyz")))
    return links, joints


def moving(joints):
    return [joint for joint in joints if joint.kind != "fixed"]


def parallel_chains(joints):
    """Pairs (joint, the hinge before it) of hinges about one direction.

    Directions are compared where no frame between them is turned.
    """
    by_child = {joint.child: joint for joint in joints}
    pairs = []
    for joint in joints:
        before = by_child.get(joint.parent)
        if (joint.kind == "hinge" and before is not None
                and before.kind == "hinge" and not any(_numbers(joint.rpy))
                and _numbers(joint.axis) == _numbers(before.axis)):
            pairs.append((joint.name, before.name))
    return pairs


def with_link(text, name, mass=None, inertia=None):
    """The URDF with another mass or other moments of one link."""
    pattern = re.compile(r'(<link\s+name="%s".*?</link>)' % re.escape(name),
                         re.DOTALL)
    block = pattern.search(text).group(1)
    changed = block
    if mass is not None:
        changed = re.sub(r'<mass\s+value="[^"]*"', '<mass value="%r"' % mass,
                         changed)
    if inertia is not None:
        for moment, value in zip(_MOMENTS, inertia):
            changed = re.sub(r'\b%s="[^"]*"' % moment,
                             '%s="%r"' % (moment, value), changed)
    return text.replace(block, changed)


def about_joint(link):
    """Moments about the joint, I + m (r'r E - r r'), r the centre of mass."""
    x, y, z = link.com
    m = link.mass
    ixx, iyy, izz, ixy, ixz, iyz = link.inertia
    return (ixx + m * (y * y + z * z), iyy + m * (x * x + z * z),
            izz + m * (x * x + y * y), ixy - m * x * y, ixz - m * x * z,
            iyz - m * y * z)


def to_mjcf(links, joints, extra):
    """The tree as MJCF; extra[joint] are more attributes of its joint."""

    def body(joint):
        link = links[joint.child]
        lines = ['<body pos="%s" euler="%s">' % (joint.xyz, joint.rpy)]
        if link.mass > 0.0:
            lines.append('<inertial pos="%r %r %r" mass="%r" '
                         'fullinertia="%s"/>'
                         % (*link.com, link.mass,
                            " ".join(repr(v) for v in link.inertia)))
        if joint.kind != "fixed":
            lines.append('<joint type="%s" axis="%s" %s/>' % (
                joint.kind, joint.axis, " ".join(
                    '%s="%r"' % item
                    for item in extra.get(joint.name, {}).items())))
        lines += [line for child in joints if child.parent == joint.child
                  for line in body(child)]
        return lines + ["</body>"]

    children = {joint.child for joint in joints}
    roots = [joint for joint in joints if joint.parent not in children]
    return "\n".join(
        ['<mujoco>',
         # URDF's roll, pitch and yaw turn about fixed axes: capital letters.
         '<compiler angle="radian" eulerseq="XYZ" boundmass="0"'
         ' inertiafromgeom="false"/>',
         '<option integrator="RK4" gravity="0 0 -9.81">'
         '<flag contact="disable"/></option>',
         '<worldbody>']
        + [line for joint in roots for line in body(joint)]
        + ['</worldbody>', '</mujoco>'])
