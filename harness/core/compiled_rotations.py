"""Rotations for compiled loops: unit quaternions (w, x, y, z) as tuples, which cost no memory allocation.

`core.rotations` has the same operations on numpy arrays of any shape.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


@compiled
def as_tuple(q: Floats) -> Quaternion:
    """The quaternion that an array (4,) holds."""
    return q[0], q[1], q[2], q[3]


@compiled
def quaternion_product(p: Quaternion, q: Quaternion) -> Quaternion:
    """The Hamilton product p q."""
    return (
        p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
        p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
        p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
        p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
    )


@compiled
def rotate(q: Quaternion, x: float, y: float, z: float) -> Vector:
    """The vector (x, y, z) rotated by q."""
    u, v, w = q[2] * z - q[3] * y, q[3] * x - q[1] * z, q[1] * y - q[2] * x
    return (
        x + 2.0 * (q[0] * u + q[2] * w - q[3] * v),
        y + 2.0 * (q[0] * v + q[3] * u - q[1] * w),
        z + 2.0 * (q[0] * w + q[1] * v - q[2] * u),
    )


@compiled
def quaternion_from_vector(x: float, y: float, z: float) -> Quaternion:
    """The quaternion of a rotation vector [rad]: `rotations.exp`."""
    angle = np.sqrt(x * x + y * y + z * z)
    half = 0.5 * angle
    factor = np.sin(half) / angle if angle > 1e-8 else 0.5
    return np.cos(half), factor * x, factor * y, factor * z


@compiled
def rotation_vector(q: Quaternion) -> Vector:
    """The rotation vector [rad] of a quaternion, of length pi at most: `rotations.log`."""
    sine = np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]) + 1e-12
    factor = np.arctan2(sine, abs(q[0])) / sine * (2.0 if q[0] >= 0.0 else -2.0)
    return factor * q[1], factor * q[2], factor * q[3]


@compiled
def matrix_from_quaternion(q: Floats) -> Floats:
    """The rotation matrix (3, 3) of a quaternion (4,)."""
    w, x, y, z = as_tuple(q)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


@compiled
def quaternion_from_matrix(r: Floats) -> Floats:
    """The quaternion (4,) of a rotation matrix (3, 3), by its largest component (Shepperd 1978)."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    i = np.argmax(np.array([trace, r[0, 0], r[1, 1], r[2, 2]]))
    if i == 0:
        q = np.array([1.0 + trace, r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    else:
        a = i - 1
        b, c = (a + 1) % 3, (a + 2) % 3
        q = np.empty(4)
        q[0] = r[c, b] - r[b, c]
        q[1 + a] = 1.0 + r[a, a] - r[b, b] - r[c, c]
        q[1 + b] = r[b, a] + r[a, b]
        q[1 + c] = r[c, a] + r[a, c]
    out: Floats = q / np.sqrt(np.sum(q**2))
    return out
