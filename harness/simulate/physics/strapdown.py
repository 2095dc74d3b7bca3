"""Strapdown integration of increments of angle and velocity, for compiled loops.

An increment covers the time between two ticks. Its angle is the rotation vector from the earlier attitude to the later
one. Its velocity is the integral of the specific force, in the station's axes at the earlier tick. Both are exact
integrals, so attitude and velocity at the ticks have no coning or sculling error. The position takes the mean of
the two velocities.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import (
    Quaternion,
    Vector,
    as_tuple,
    quaternion_from_vector,
    quaternion_product,
    rotate,
)
from harness.simulate.readings import GRAVITY_M_S2

STATE = 10
"""Numbers of a motion state: position [m] 0:3, velocity [m/s] 3:6, tracker_from_station 6:10."""


@compiled
def attitude(state: Floats) -> Quaternion:
    """The quaternion in a motion state (10,)."""
    return as_tuple(state[6:10])


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
    x, y, z = rotate(q, velocity[0], velocity[1], velocity[2])
    after[3] = before[3] + x
    after[4] = before[4] + y
    after[5] = before[5] + z + GRAVITY_M_S2 * duration_s
    for i in range(3):
        after[i] = before[i] + 0.5 * duration_s * (before[3 + i] + after[3 + i])
    set_attitude(after, quaternion_product(q, quaternion_from_vector(angle[0], angle[1], angle[2])))
    return x, y, z
