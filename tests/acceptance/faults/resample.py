"""Signals at other times, by the suite's own interpolation.

sysid reads a late column back by its own; neither knows the other's.
"""

import bisect
import math


def _interval(times, t):
    """i with times[i] <= t <= times[i + 1], the outermost beyond the ends."""
    return min(max(bisect.bisect_right(times, t) - 1, 0), len(times) - 2)


def linear(times, values, t):
    i = _interval(times, t)
    u = (t - times[i]) / (times[i + 1] - times[i])
    return (1.0 - u) * values[i] + u * values[i + 1]


def cubic(times, values, t):
    """Lagrange's polynomial through the four samples around t."""
    i = _interval(times, t)
    first = min(max(i - 1, 0), max(len(times) - 4, 0))
    nodes = range(first, min(first + 4, len(times)))
    total = 0.0
    for j in nodes:
        weight = 1.0
        for k in nodes:
            if k != j:
                weight *= (t - times[k]) / (times[j] - times[k])
        total += weight * values[j]
    return total


def held(times, values, t):
    """Of a signal that each sample holds until the next."""
    i = min(max(bisect.bisect_right(times, t) - 1, 0), len(times) - 1)
    return values[i]


# Quaternions are (w, x, y, z).


def multiply(a, b):
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw)


def conjugate(a):
    return (a[0], -a[1], -a[2], -a[3])


def normalised(a):
    norm = math.sqrt(sum(v * v for v in a))
    return tuple(v / norm for v in a)


def rotation(vector):
    """The quaternion of a rotation vector."""
    angle = math.sqrt(sum(v * v for v in vector))
    if angle == 0.0:
        return (1.0, 0.0, 0.0, 0.0)
    s = math.sin(angle / 2.0) / angle
    return (math.cos(angle / 2.0),) + tuple(s * v for v in vector)


def vector(a):
    """The rotation vector of a unit quaternion, of at most pi."""
    if a[0] < 0.0:
        a = tuple(-v for v in a)
    norm = math.sqrt(a[1] ** 2 + a[2] ** 2 + a[3] ** 2)
    if norm == 0.0:
        return (0.0, 0.0, 0.0)
    scale = 2.0 * math.atan2(norm, a[0]) / norm
    return tuple(scale * v for v in a[1:])


def slerp(times, quaternions, t):
    """At a constant turning velocity from sample to sample."""
    i = _interval(times, t)
    u = (t - times[i]) / (times[i + 1] - times[i])
    a, b = quaternions[i], quaternions[i + 1]
    turn = vector(multiply(conjugate(a), b))
    return multiply(a, rotation(tuple(u * v for v in turn)))
