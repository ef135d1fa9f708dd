"""Recordings of a two-link arm with a law that the catalogue lacks, or one that
it has (Law.named), by SciPy: none of sysid's own physics.

Two point masses m on rods l in a vertical plane, q2 relative to the first rod,
torques u on both joints, viscous friction d on both, a rotor on joint 2. The
arm is measured by encoders; the columns are what a controller records.
"""

import dataclasses
from typing import Callable

import numpy as np
from scipy.integrate import solve_ivp

MASS, LENGTH, GRAVITY = 1.0, 0.5, 9.81
DAMPING = np.array([0.30, 0.15])
ROTOR = 0.04  # kg m^2, the rotor of joint 2
DURATION, PERIOD, NOISE = 12.0, 0.01, 2e-4


def acceleration(q, qd, torque, rotor, pivot):
    """M(q) qdd + c(q, qd) + g(q) = torque; pivot: its horizontal acceleration."""
    m, l = MASS, LENGTH
    c2, s2 = np.cos(q[1]), np.sin(q[1])
    m11 = m * l * l * (3.0 + 2.0 * c2)
    m12 = m * l * l * (1.0 + c2)
    m22 = m * l * l + rotor
    c1 = -m * l * l * s2 * (2.0 * qd[0] * qd[1] + qd[1] ** 2)
    c2v = m * l * l * s2 * qd[0] ** 2
    g2 = m * l * (GRAVITY * np.sin(q[0] + q[1]) - pivot * np.cos(q[0] + q[1]))
    g1 = 2.0 * m * l * (GRAVITY * np.sin(q[0]) - pivot * np.cos(q[0])) + g2
    b1 = torque[0] - c1 - g1
    b2 = torque[1] - c2v - g2
    det = m11 * m22 - m12 * m12
    return np.array([(m22 * b1 - m12 * b2) / det, (m11 * b2 - m12 * b1) / det])


class Torque:
    """A sum of sines on each joint, held over a period as a drive does."""

    def __init__(self, rng):
        self.f = np.linspace(0.15, 1.6, 8)
        self.a = rng.uniform(0.5, 1.0, (2, 8)) * np.array([[1.3], [0.7]])
        self.p = rng.uniform(0, 2 * np.pi, (2, 8))
        self.t = np.arange(0, DURATION + PERIOD, PERIOD)
        self.u = np.array([self.at(t) for t in self.t])

    def at(self, t):
        return (self.a * np.sin(2 * np.pi * self.f * t + self.p)).sum(axis=1)


def sign(v, eps=2e-3):
    return np.tanh(v / eps)


def plain(t, q, qd, u, x):
    return u - DAMPING * qd, []


# Each law: what acts on the arm in place of u - d qd; x: states of its own.
def saturation(t, q, qd, u, x):
    return np.clip(u, [-9.0, -1.1], [9.0, 1.1]) - DAMPING * qd, []


def load_friction(t, q, qd, u, x):
    return u - DAMPING * qd - np.array([0.0, 1.0]) * 0.25 * np.abs(u) * sign(qd), []


def position_friction(t, q, qd, u, x):
    return u - DAMPING * qd - np.array([0.0, 0.25 * (1 + np.sin(5 * q[1]))]) * sign(qd), []


def warming(t, q, qd, u, x):
    return u - DAMPING * qd - np.array([0.5 * np.exp(-t / 4.0), 0.0]) * sign(qd), []


def stop(t, q, qd, u, x):
    over = max(q[1] - 0.35, 0.0)
    force = -(150.0 * over + 1.5 * qd[1]) if over > 0 else 0.0
    return u - DAMPING * qd + np.array([0.0, min(force, 0.0)]), []


def lag(t, q, qd, u, x):
    return np.array([x[0], u[1]]) - DAMPING * qd, [(u[0] - x[0]) / 0.08]


def presliding(t, q, qd, u, x):
    """Dahl: the force is a spring that yields at 0.4 N m."""
    return u - DAMPING * qd - np.array([0.0, x[0]]), [12.0 * qd[1] * (1 - np.sign(qd[1]) * x[0] / 0.4)]


def coupled_friction(t, q, qd, u, x):
    """Joint 2 drags on what joint 1 does, and the other way round."""
    c = 0.25 * sign(qd[0] + qd[1])
    return u - DAMPING * qd - np.array([c, c]), []


def dead_band(t, q, qd, u, x):
    """The drive of joint 2 does not answer to less than 0.7 N m."""
    return np.array([u[0], np.sign(u[1]) * max(abs(u[1]) - 0.7, 0.0)]) - DAMPING * qd, []


def drifting_gain(t, q, qd, u, x):
    """The drive of joint 1 fades as it warms."""
    return np.array([u[0] * (1.0 - 0.4 * (1.0 - np.exp(-t / 5.0))), u[1]]) - DAMPING * qd, []


def belt(t, q, qd, u, x):
    """An elastic belt from joint 1 to joint 2, without a rest position of either."""
    pull = 1.5 * np.sin(q[1] - 1.5 * q[0])
    return u - DAMPING * qd + np.array([1.5 * pull, -pull]), []


def relaxing(t, q, qd, u, x):
    """A rubber coupling on joint 1 whose force relaxes in 0.4 s."""
    return u - DAMPING * qd - np.array([x[0], 0.0]), [8.0 * qd[0] - x[0] / 0.4]


def flexible(t, q, qd, u, x):
    """x: angle and speed of the motor, which has the encoder."""
    spring = 25.0 * (x[0] - q[1]) + 0.05 * (x[1] - qd[1])
    return (np.array([u[0], spring]) - DAMPING * np.array([qd[0], 0.0]),
            [x[1], (u[1] - spring - DAMPING[1] * x[1]) / ROTOR])


def backlash(t, q, qd, u, x):
    gap = 0.02
    twist = x[0] - q[1]
    play = np.sign(twist) * max(abs(twist) - gap, 0.0)
    spring = 300.0 * play + (0.8 * (x[1] - qd[1]) if play else 0.0)
    return (np.array([u[0], spring]) - DAMPING * np.array([qd[0], 0.0]),
            [x[1], (u[1] - spring - DAMPING[1] * x[1]) / ROTOR])


@dataclasses.dataclass
class Law:
    force: Callable
    joints: tuple  # where it acts
    states: int = 0  # of its own
    motor_side: bool = False  # the encoder of joint 2 is on its motor, which is the first of those
    at_large: tuple = ()  # what it is in wide motion
    named: tuple = ()  # what the catalogue calls it


LAWS = {
    "saturation": Law(saturation, ("joint2",), named=("effort_limit@joint2",)),
    "load_friction": Law(load_friction, ("joint2",), named=("load_friction@joint2",)),
    "position_friction": Law(position_friction, ("joint2",)),
    "warming": Law(warming, ("joint1",)),
    "stop": Law(stop, ("joint2",)),
    "lag": Law(lag, ("joint1",), states=1, named=("actuator_lag@joint1",)),
    "presliding": Law(presliding, ("joint2",), states=1, at_large=("coulomb_friction@joint2", "presliding_friction@joint2")),
    "moving_base": Law(plain, ("joint1", "joint2")),
    "coupled_friction": Law(coupled_friction, ("joint1", "joint2"), named=("gear_coupling@joint1,joint2",)),
    "dead_band": Law(dead_band, ("joint2",), at_large=("effort_gain@joint2",)),
    "drifting_gain": Law(drifting_gain, ("joint1",), at_large=("effort_gain@joint1",)),
    "belt": Law(belt, ("joint1", "joint2")),
    "relaxing": Law(relaxing, ("joint1",), states=1),
    "slipping_clock": Law(plain, ("joint1", "joint2")),
    "flexible": Law(flexible, ("joint2",), states=2, motor_side=True),
    "backlash": Law(backlash, ("joint2",), states=2, motor_side=True),
}


def simulate(law, seed, laws=None):
    laws = laws or LAWS
    rng = np.random.default_rng(seed)
    torque = Torque(rng)
    rotor = 0.0 if laws[law].motor_side else ROTOR
    rest = np.zeros(4 + laws[law].states)
    shake = (lambda t: 1.5 * np.sin(2 * np.pi * 1.1 * t + seed)) if law == "moving_base" else (lambda t: 0.0)

    def rates(t, y, k):
        force, own = laws[law].force(t, y[:2], y[2:4], torque.u[k], y[4:])
        return np.concatenate([y[2:4], acceleration(y[:2], y[2:4], force, rotor, shake(t)), own])

    t = torque.t
    states = [rest]
    for k in range(len(t) - 1):  # the torque is held: one smooth piece at a time
        done = solve_ivp(rates, (t[k], t[k + 1]), states[-1], args=(k,), method="LSODA", rtol=1e-7, atol=1e-9)
        states.append(done.y[:, -1])
    y = np.array(states)
    q = y[:, :2].copy()
    if laws[law].motor_side:
        q[:, 1] = y[:, 4]
    q += NOISE * rng.standard_normal(q.shape)
    u = torque.u.copy()
    if law == "slipping_clock":  # the drive's clock gains 1.5 % on the encoders'
        u = np.array([np.interp(t * 0.985, t, torque.u[:, i]) for i in (0, 1)]).T
    return t, q, u


def write_recordings(law, folder, laws=None):
    """Three runs as FOLDER/run_1.csv and on; their names."""
    return [write_recording(simulate(law, run, laws), folder / f"run_{run}.csv") for run in (1, 2, 3)]


def write_recording(motion, path):
    np.savetxt(path, np.column_stack(motion), fmt="%.9g", delimiter=",", comments="",
               header="t,joint1.q,joint2.q,joint1.tau,joint2.tau")
    return path.name
