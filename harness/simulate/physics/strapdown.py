"""Strapdown integration of increments of angle and velocity, and the rotations that it needs, for compiled loops.

An increment covers the time between two ticks. Its angle is the rotation vector from the earlier attitude to the later
one. Its velocity is the integral of the specific force, in the station's axes at the earlier tick. Both are exact
integrals, so attitude and velocity at the ticks have no coning or sculling error. The position takes the mean of
the two velocities.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.simulate.readings import GRAVITY_M_S2

STATE = 10
"""Numbers of a motion state: position [m] 0:3, velocity [m/s] 3:6, tracker_from_station 6:10."""
Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@compiled
def product(p: Quaternion, q: Quaternion) -> Quaternion:
    """The Hamilton product p q."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@compiled
def rotated(q: Quaternion, x: float, y: float, z: float) -> Vector:
    """The vector (x, y, z) rotated by a unit quaternion."""
    u, v, w = q[2] * z - q[3] * y, q[3] * x - q[1] * z, q[1] * y - q[2] * x
    return (
        x + 2.0 * (q[0] * u + q[2] * w - q[3] * v),
        y + 2.0 * (q[0] * v + q[3] * u - q[1] * w),
        z + 2.0 * (q[0] * w + q[1] * v - q[2] * u),
    )


@compiled
def exponential(x: float, y: float, z: float) -> Quaternion:
    """The unit quaternion of a rotation vector [rad]."""
    angle = np.sqrt(x * x + y * y + z * z)
    half = 0.5 * angle
    factor = np.sin(half) / angle if angle > 1e-8 else 0.5
    return np.cos(half), factor * x, factor * y, factor * z


@compiled
def logarithm(q: Quaternion) -> Vector:
    """The rotation vector of a unit quaternion [rad], of length pi at most."""
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    factor = np.arctan2(sine, abs(q[0])) / sine if sine > 1e-12 else 1.0
    factor = 2.0 * factor if q[0] >= 0.0 else -2.0 * factor
    return factor * q[1], factor * q[2], factor * q[3]


@compiled
def quaternion(row: Floats) -> Quaternion:
    """The quaternion in a row (4,)."""
    return row[0], row[1], row[2], row[3]


@compiled
def attitude(state: Floats) -> Quaternion:
    """The quaternion in a motion state (10,)."""
    return state[6], state[7], state[8], state[9]


@compiled
def set_attitude(state: Floats, q: Quaternion) -> None:
    """Store a quaternion, scaled to length 1, in a motion state (10,)."""
    scale = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    state[6], state[7], state[8], state[9] = scale * q[0], scale * q[1], scale * q[2], scale * q[3]


@compiled
def integrate(before: Floats, angle: Vector, velocity: Vector, duration_s: float, after: Floats) -> Vector:
    """Integrate an increment of angle [rad] and velocity [m/s] from one motion state (10,) to the next.

    Returns the velocity increment in the tracker's axes, without gravity [m/s]. Gravity acts along +z, which points
    down. Source: P. Savage, "Strapdown inertial navigation integration algorithm design", J. Guid. Control Dyn. 21
    (1998), without the corrections that exact increments do not need.
    """
    q = attitude(before)
    x, y, z = rotated(q, velocity[0], velocity[1], velocity[2])
    after[3] = before[3] + x
    after[4] = before[4] + y
    after[5] = before[5] + z + GRAVITY_M_S2 * duration_s
    for i in range(3):
        after[i] = before[i] + 0.5 * duration_s * (before[3 + i] + after[3 + i])
    set_attitude(after, product(q, exponential(angle[0], angle[1], angle[2])))
    return x, y, z
