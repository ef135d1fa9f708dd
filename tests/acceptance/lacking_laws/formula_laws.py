"""A dozen laws that the catalogue lacks, beside those of lacking_laws.py, on the
same arm: each is one formula of what the joints do and what drives them.
"""

import numpy as np

from lacking_laws import DAMPING, Law, sign

SHAPES = {}


def on(*joints):
    """Notes a law f(q, qd, u), N m on each joint, that acts on `joints`."""

    def note(f):
        def force(t, q, qd, u, x):
            return u - DAMPING * qd + np.asarray(f(q, qd, u), dtype=float), []

        SHAPES[f.__name__] = Law(force, joints)
        return f

    return note


@on("joint2")
def position_damping(q, qd, u):
    """Damping that grows away from the middle."""
    return 0.0, -0.5 * q[1] ** 2 * qd[1]


@on("joint2")
def hardening(q, qd, u):
    """Rubber on both sides of a dead zone."""
    over = max(abs(q[1]) - 0.3, 0.0)
    return 0.0, -3.0 * over**3 * np.sign(q[1])


@on("joint2")
def saturating_damping(q, qd, u):
    """A clutch whose drag saturates with speed."""
    return 0.0, -1.2 * qd[1] / (1.0 + abs(qd[1]))


@on("joint2")
def quadratic_drive(q, qd, u):
    """A drive whose torque is not in proportion to the current."""
    return 0.0, 0.15 * u[1] * abs(u[1])


@on("joint2")
def detent(q, qd, u):
    """A magnet at 0.3 rad."""
    off = q[1] - 0.3
    return 0.0, -3.0 * off * np.exp(-((off / 0.3) ** 2))


@on("joint2")
def bent_friction(q, qd, u):
    """Friction of a shaft that is bent."""
    return 0.0, -(0.1 + 0.4 * q[1] ** 2) * sign(qd[1])


@on("joint2")
def coupled_positions(q, qd, u):
    """A hose from the first link that pulls on joint 2."""
    return 0.0, -1.2 * q[0] * q[1]


@on("joint2")
def load_spring(q, qd, u):
    """A spring whose rate follows the drive's load."""
    return 0.0, -0.4 * abs(u[1]) * q[1]


@on("joint2")
def drive_damping(q, qd, u):
    """The back torque of a field that the drive weakens."""
    return 0.0, -0.2 * u[1] * qd[1]


@on("joint2")
def stirred(q, qd, u):
    """A damper of joint 2 that joint 1 stirs."""
    return 0.0, -0.3 * abs(qd[0]) * qd[1]


@on("joint2")
def exponential_friction(q, qd, u):
    """Friction that falls off with speed, with another exponent than Stribeck's."""
    return 0.0, -(0.15 + 0.3 * np.exp(-abs(qd[1]) / 0.6)) * sign(qd[1])


@on("joint1")
def bistable(q, qd, u):
    """A spring that pushes away from the middle, and back from far off."""
    return 2.0 * q[0] - 3.0 * q[0] ** 3, 0.0
