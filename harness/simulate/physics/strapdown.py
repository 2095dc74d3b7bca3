"""Strapdown integration of a station's motion, and the covariance of its error, for compiled loops.

An increment covers the time between two ticks. Its angle is the rotation vector from the earlier attitude to the later
one. Its velocity is the integral of the specific force, in the station's axes at the earlier tick. Both are exact
integrals, so attitude and velocity at the ticks have no coning or sculling error. The position takes the mean of
the two velocities.

The error state has 15 numbers: position [m] 0:3, velocity [m/s] 3:6, attitude [rad] 6:9, bias of the gyroscopes [rad/s]
9:12 and of the accelerometers [m/s^2] 12:15. The error of the attitude is global: the true attitude is exp(error) times
the estimate. Then the transition over several ticks is a sum, and white noise of the sensors stays isotropic.
Source: J. Sola, "Quaternion kinematics for the error-state Kalman filter" (2017), chapter 7.
"""

import math

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
ERRORS = 15
MOTION_ERRORS = 9
"""Position, velocity and attitude: the part of the error that a range depends on."""


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


@compiled
def add_tick(transition: Floats, q: Quaternion, velocity: Vector, duration_s: float) -> None:
    """Extend a transition by one tick.

    `transition` (9, 9): errors of position, velocity and attitude at the end, by those of attitude, gyroscopes and
    accelerometers at the beginning; the attitude's own part, the identity, is left out. `q` is the attitude at the
    tick's beginning and `velocity` the velocity increment in the tracker's axes.
    """
    half = 0.5 * duration_s
    ux, uy, uz = velocity
    for j in range(9):
        # The attitude's error is the first column's own error and what the gyroscopes added since.
        if j < 3:
            a, b, c = 1.0 * (j == 0), 1.0 * (j == 1), 1.0 * (j == 2)
        elif j < 6:
            a, b, c = transition[6, j], transition[7, j], transition[8, j]
        else:
            a, b, c = 0.0, 0.0, 0.0
        x, y, z = uy * c - uz * b, uz * a - ux * c, ux * b - uy * a
        if j >= 6:
            x, y, z = rotate(q, duration_s * (j == 6), duration_s * (j == 7), duration_s * (j == 8))
        transition[0, j] += half * (2.0 * transition[3, j] - x)
        transition[1, j] += half * (2.0 * transition[4, j] - y)
        transition[2, j] += half * (2.0 * transition[5, j] - z)
        transition[3, j] -= x
        transition[4, j] -= y
        transition[5, j] -= z
    for j in range(3):
        x, y, z = rotate(q, duration_s * (j == 0), duration_s * (j == 1), duration_s * (j == 2))
        transition[6, 3 + j] -= x
        transition[7, 3 + j] -= y
        transition[8, 3 + j] -= z


@compiled
def propagate_covariance(covariance: Floats, transition: Floats, duration_s: float, product: Floats) -> None:
    """Replace P (15, 15) by F P F^T for a transition of `add_tick`; `product` (9, 15) is scratch memory."""
    for j in range(ERRORS):
        for i in range(3):
            position = covariance[i, j] + duration_s * covariance[3 + i, j]
            velocity = covariance[3 + i, j]
            turn = covariance[6 + i, j]
            for k in range(9):
                position += transition[i, k] * covariance[6 + k, j]
                velocity += transition[3 + i, k] * covariance[6 + k, j]
            for k in range(3):
                turn += transition[6 + i, 3 + k] * covariance[9 + k, j]
            product[i, j], product[3 + i, j], product[6 + i, j] = position, velocity, turn
    for i in range(MOTION_ERRORS):
        row = product[i]
        for j in range(i, MOTION_ERRORS):
            total = row[j]
            if j < 6:
                if j < 3:
                    total += duration_s * row[3 + j]
                for k in range(9):
                    total += transition[j, k] * row[6 + k]
            else:
                for k in range(3):
                    total += transition[j, 3 + k] * row[9 + k]
            covariance[i, j] = total
            covariance[j, i] = total
        for j in range(MOTION_ERRORS, ERRORS):
            covariance[i, j] = row[j]
            covariance[j, i] = row[j]


@compiled
def add_process_noise(covariance: Floats, duration_s: float, density: Floats) -> None:
    """Add the noise of a slot: densities (4,) of gyroscopes, accelerometers and their two biases, x^2 per second."""
    turn, velocity = duration_s * density[0], duration_s * density[1]
    for i in range(3):
        covariance[i, i] += velocity * duration_s * duration_s / 3.0
        covariance[i, 3 + i] += 0.5 * velocity * duration_s
        covariance[3 + i, i] += 0.5 * velocity * duration_s
        covariance[3 + i, 3 + i] += velocity
        covariance[6 + i, 6 + i] += turn
        covariance[9 + i, 9 + i] += duration_s * density[2]
        covariance[12 + i, 12 + i] += duration_s * density[3]


@compiled
def project(covariance: Floats, slope: Floats, column: Floats) -> float:
    """Set `column` (15,) to P H^T and return H P H^T, for a measurement whose slope H (9,) is by the motion's error."""
    variance = 0.0
    for i in range(ERRORS):
        total = 0.0
        for k in range(MOTION_ERRORS):
            total += covariance[i, k] * slope[k]
        column[i] = total
        if i < MOTION_ERRORS:
            variance += slope[i] * total
    return variance


@compiled
def joseph_update(covariance: Floats, slope: Floats, column: Floats, total: float, noise: float, rest: Floats) -> None:
    """Update P (15, 15) with a scalar measurement, in Joseph's form; the gain is `column` / `total`.

    `slope` (9,) and `column` (15,) are those of `project`, `total` is the innovation's variance, `noise` the
    measurement's own [m^2]; `rest` (15,) is scratch memory. P becomes (I - K H) P (I - K H)^T + K noise K^T.
    """
    explained = 0.0
    for k in range(MOTION_ERRORS):
        explained += column[k] * slope[k]
    for i in range(ERRORS):
        rest[i] = column[i] * (1.0 - explained / total)  # (I - K H) P H^T
    for i in range(ERRORS):
        gain = column[i] / total
        for j in range(i, ERRORS):
            other = column[j] / total
            value = covariance[i, j] - gain * column[j] + (noise * gain - rest[i]) * other
            covariance[i, j] = value
            covariance[j, i] = value


@compiled
def reset_attitude(covariance: Floats, x: float, y: float, z: float) -> None:
    """Move P (15, 15) to the attitude corrected by the rotation vector (x, y, z) (Sola 2017, section 7.3.3)."""
    x, y, z = 0.5 * x, 0.5 * y, 0.5 * z
    for j in range(ERRORS):
        a, b, c = covariance[6, j], covariance[7, j], covariance[8, j]
        covariance[6, j] = a + y * c - z * b
        covariance[7, j] = b + z * a - x * c
        covariance[8, j] = c + x * b - y * a
    for i in range(ERRORS):
        a, b, c = covariance[i, 6], covariance[i, 7], covariance[i, 8]
        covariance[i, 6] = a + y * c - z * b
        covariance[i, 7] = b + z * a - x * c
        covariance[i, 8] = c + x * b - y * a


@compiled
def position_sigma_m(covariance: Floats) -> float:
    """Standard deviation of the position in three dimensions: the root of the trace [m]."""
    return math.sqrt(max(covariance[0, 0] + covariance[1, 1] + covariance[2, 2], 0.0))


@compiled
def attitude_sigma_rad(covariance: Floats) -> float:
    """Standard deviation of the attitude about three axes: the root of the trace [rad]."""
    return math.sqrt(max(covariance[6, 6] + covariance[7, 7] + covariance[8, 8], 0.0))
