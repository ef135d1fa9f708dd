#!/usr/bin/env python3
"""Makes arm7.urdf: python3 make_arm7.py > arm7.urdf

A seven-joint arm of about the size of those on the market, of no maker: every
link is a few solid cylinders, so its mass, centre of mass and inertia are those
of a real body. Cylinders are (from, to, radius, mass) in the link's axes, whose
z is the joint's axis; metres and kilograms.
"""
import math

QUARTER = repr(math.pi / 2)

# joint: origin, roll about the parent's x, (lower, upper, effort, velocity)
JOINTS = [
    ("0 0 0.33", "0", (-2.9, 2.9, 90, 2.2)),
    ("0 0 0", "-" + QUARTER, (-1.8, 1.8, 90, 2.2)),
    ("0 -0.32 0", QUARTER, (-2.9, 2.9, 90, 2.2)),
    ("0.08 0 0", QUARTER, (-3.1, 0.1, 90, 2.2)),
    ("-0.08 0.38 0", "-" + QUARTER, (-2.9, 2.9, 15, 2.6)),
    ("0 0 0", QUARTER, (-0.1, 3.8, 15, 2.6)),
    ("0.09 0 0", QUARTER, (-2.9, 2.9, 15, 2.6)),
]
LINKS = [
    [((0, 0, -0.19), (0, 0, 0), 0.06, 2.4), ((0, -0.08, 0), (0, 0.06, 0), 0.06, 1.4)],
    [((0, -0.19, 0), (0, 0, 0), 0.06, 2.2), ((0.01, 0, -0.05), (0, 0, 0.08), 0.06, 1.3)],
    [((0, 0, -0.12), (0, 0, 0), 0.055, 1.7), ((0, 0, 0), (0.08, 0.03, 0.03), 0.055, 1.2)],
    [((0, 0, 0), (-0.08, 0.12, 0), 0.055, 1.8), ((0, 0, -0.04), (0, 0, 0.06), 0.055, 1.1)],
    [((0, 0, -0.26), (0, 0.02, -0.06), 0.05, 2.0), ((0, 0.05, -0.05), (0.01, 0.06, 0), 0.04, 0.9)],
    [((0, 0, -0.05), (0, 0, 0.05), 0.045, 0.9), ((0, 0, 0), (0.09, 0.02, 0.01), 0.045, 0.6)],
    [((0, 0, 0.02), (0, 0, 0.11), 0.035, 0.5), ((0.02, 0.02, 0.08), (0.05, 0.03, 0.08), 0.02, 0.2)],
]
TIP = "0 0 0.11"


def inertial(cylinders):
  """Mass, centre of mass, inertia about it as a 3x3 list."""
  mass = sum(m for _, _, _, m in cylinders)
  mid = lambda a, b, i: (a[i] + b[i]) / 2
  com = [sum(m * mid(a, b, i) for a, b, _, m in cylinders) / mass
         for i in range(3)]
  inertia = [[0.0] * 3 for _ in range(3)]
  for a, b, r, m in cylinders:
    span = [b[i] - a[i] for i in range(3)]
    length2 = sum(s * s for s in span)
    along, across = m * r * r / 2, m * (3 * r * r + length2) / 12
    d = [mid(a, b, i) - com[i] for i in range(3)]
    d2 = sum(x * x for x in d)
    for i in range(3):
      for j in range(3):
        inertia[i][j] += ((across + m * d2) * (i == j) - m * d[i] * d[j]
                          + (along - across) * span[i] * span[j] / length2)
  return mass, com, inertia


def number(x):
  return f"{x:.6g}" if abs(x) > 1e-12 else "0"


def main():
  print('<?xml version="1.0"?>')
  print("<!-- Made by make_arm7.py, which says from what bodies. At q = 0 the\n"
        "     arm stands upright, the last link turned down. -->")
  print('<robot name="arm7">\n  <link name="base"/>')
  for k, (origin, roll, limits) in enumerate(JOINTS, 1):
    mass, com, I = inertial(LINKS[k - 1])
    parent = "base" if k == 1 else f"link{k - 1}"
    lower, upper, effort, velocity = limits
    print(f"""
  <joint name="joint{k}" type="revolute">
    <origin xyz="{origin}" rpy="{roll} 0 0"/>
    <parent link="{parent}"/>
    <child link="link{k}"/>
    <axis xyz="0 0 1"/>
    <limit lower="{lower}" upper="{upper}" effort="{effort}" velocity="{velocity}"/>
  </joint>
  <link name="link{k}">
    <inertial>
      <origin xyz="{' '.join(number(c) for c in com)}" rpy="0 0 0"/>
      <mass value="{number(mass)}"/>
      <inertia ixx="{number(I[0][0])}" ixy="{number(I[0][1])}" ixz="{number(I[0][2])}"
               iyy="{number(I[1][1])}" iyz="{number(I[1][2])}" izz="{number(I[2][2])}"/>
    </inertial>
  </link>""")
  print(f"""
  <joint name="tip_joint" type="fixed">
    <origin xyz="{TIP}" rpy="0 0 0"/>
    <parent link="link7"/>
    <child link="tip"/>
  </joint>
  <link name="tip"/>
</robot>""")


main()
