"""Rotations as unit quaternions (w, x, y, z) in numpy arrays; uses scipy where that is fast enough.

`a_from_b` takes vectors of frame b into frame a, so products read by adjacency:
`a_from_c = multiply(a_from_b, b_from_c)`. All functions broadcast over leading axes.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from harness.core.arrays import Floats

IDENTITY: Floats = np.array([1.0, 0.0, 0.0, 0.0])


def multiply(a_from_b: Floats, b_from_c: Floats) -> Floats:
    """Hamilton product, (..., 4)."""
    p, q = np.asarray(a_from_b, dtype=float), np.asarray(b_from_c, dtype=float)
    w1, x1, y1, z1 = p[..., 0], p[..., 1], p[..., 2], p[..., 3]
    w2, x2, y2, z2 = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    w = w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2
    out = np.empty((*w.shape, 4))
    out[..., 0] = w
    out[..., 1] = w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2
    out[..., 2] = w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2
    out[..., 3] = w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2
    return out


def inverse(a_from_b: Floats) -> Floats:
    """`b_from_a`, (..., 4), the inverse of a unit quaternion."""
    out: Floats = np.asarray(a_from_b, dtype=float) * np.array([1.0, -1.0, -1.0, -1.0])
    return out


def rotate(a_from_b: Floats, v_b: Floats) -> Floats:
    """Vectors (..., 3) given in frame b, expressed in frame a."""
    q, v = np.asarray(a_from_b, dtype=float), np.asarray(v_b, dtype=float)
    w, u = q[..., :1], q[..., 1:]
    t = 2.0 * cross(u, v)
    out: Floats = v + w * t + cross(u, t)
    return out


def cross(u: Floats, v: Floats) -> Floats:
    """Cross products (..., 3), equal to `np.cross` to the bit, in a quarter of its time for few vectors."""
    x1, y1, z1 = u[..., 0], u[..., 1], u[..., 2]
    x2, y2, z2 = v[..., 0], v[..., 1], v[..., 2]
    x = y1 * z2 - z1 * y2
    out = np.empty((*x.shape, 3))
    out[..., 0] = x
    out[..., 1] = z1 * x2 - x1 * z2
    out[..., 2] = x1 * y2 - y1 * x2
    return out


def exp(rotation_vector_rad: Floats) -> Floats:
    """Unit quaternions (..., 4) of rotation vectors (..., 3) [rad]."""
    v = np.asarray(rotation_vector_rad, dtype=float)
    half = 0.5 * np.linalg.norm(v, axis=-1, keepdims=True)
    return np.concatenate([np.cos(half), 0.5 * np.sinc(half / np.pi) * v], axis=-1)


def log(quaternion: Floats) -> Floats:
    """Rotation vectors (..., 3) [rad], at most pi long; the inverse of `exp` below pi."""
    q = np.asarray(quaternion, dtype=float)
    q = np.where(q[..., :1] < 0.0, -q, q)
    s = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(s, q[..., :1])
    small = s < 1e-9
    out: Floats = np.where(small, 2.0, angle / np.where(small, 1.0, s)) * q[..., 1:]
    return out


def angle_between_rad(p: Floats, q: Floats) -> Floats:
    """Geodesic distance (...,) between unit quaternions (..., 4), in 0..pi [rad]; accurate near 0 and near pi."""
    turn = multiply(inverse(p), q)
    out: Floats = 2.0 * np.arctan2(np.linalg.norm(turn[..., 1:], axis=-1), np.abs(turn[..., 0]))
    return out


def to_matrix(quaternion: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) of unit quaternions (..., 4)."""
    q = np.asarray(quaternion, dtype=float)
    w, x, y, z = q[..., 0], q[..., 1], q[..., 2], q[..., 3]
    out = np.empty((*w.shape, 3, 3))
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    out[..., 2, 0], out[..., 2, 1], out[..., 2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    return out


def from_matrix(matrix: Floats) -> Floats:
    """Unit quaternions (..., 4), w >= 0, of rotation matrices (..., 3, 3)."""
    m = np.asarray(matrix, dtype=float)
    q = Rotation.from_matrix(m.reshape(-1, 3, 3)).as_quat(canonical=True, scalar_first=True)
    return np.asarray(q, dtype=float).reshape(*m.shape[:-2], 4)


def nearest_rotation(matrix: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) nearest to matrices (..., 3, 3) in the sum of squares (Kabsch 1976)."""
    u, _, v = np.linalg.svd(matrix)
    u[..., -1] *= np.linalg.det(u @ v)[..., None]  # no reflection
    out: Floats = u @ v
    return out


def mean_rotation(quaternions: Floats) -> Floats:
    """The mean (4,) of orientations (N, 4) in the sum of squares of matrices; rows of NaN are left out.

    It is the one of Markley et al. 2007 (J. Guid. Control Dyn. 30).
    """
    return from_matrix(nearest_rotation(np.nanmean(to_matrix(quaternions), axis=0)))


def cross_matrix(vector: Floats) -> Floats:
    """Matrices (..., 3, 3) of the cross products with vectors (..., 3)."""
    v = np.asarray(vector, dtype=float)
    out = np.zeros((*v.shape, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    out[..., 1, 2], out[..., 2, 0], out[..., 0, 1] = -v[..., 0], -v[..., 1], -v[..., 2]
    return out


def continuous(quaternions: Floats) -> Floats:
    """Rotations (T, ..., 4) with signs chosen such that consecutive quaternions have no negative inner product."""
    q = np.array(quaternions, dtype=float)
    if len(q) > 1:
        flips = np.sum(q[1:] * q[:-1], axis=-1) < 0.0
        q[1:][np.cumsum(flips, axis=0) % 2 == 1] *= -1.0
    return q


def yaw_rad(world_from_body: Floats) -> Floats:
    """Heading (...,) of the body's x axis (forward) about the world's z axis [rad]."""
    w, x, y, z = np.moveaxis(np.asarray(world_from_body, dtype=float), -1, 0)
    out: Floats = np.arctan2(2.0 * (x * y + w * z), 1.0 - 2.0 * (y * y + z * z))
    return out


def wrap_angle(angle_rad: Floats) -> Floats:
    """Angles (...,) wrapped to [-pi, pi) [rad]."""
    out: Floats = (angle_rad + np.pi) % (2.0 * np.pi) - np.pi
    return out


def about_z(angle_rad: float | Floats) -> Floats:
    """Unit quaternions (..., 4) of rotations about z."""
    half = 0.5 * np.asarray(angle_rad, dtype=float)
    zero = np.zeros_like(half)
    return np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)


def mean_heading_rad(world_from_root: Floats) -> float:
    """Mean direction of the x axis of orientations (T, 4) about the world's z axis [rad]; 0 without any."""
    if not len(world_from_root):
        return 0.0
    ahead = np.mean(to_matrix(world_from_root)[:, :, 0], axis=0)
    return float(np.arctan2(ahead[1], ahead[0]))
