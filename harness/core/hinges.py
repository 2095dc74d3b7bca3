"""Rotations as the angles of a bone's one, two or three orthogonal hinges, innermost first, and back.

Three orthogonal hinges reach any rotation (closed-form Euler angles), by two names each: `equivalent_euler_angles` gives the other. For
one or two, with q the wanted quaternion, the nearest rotation maximises its product with the hinges' quaternion, which
is bilinear in the half-angle vectors (cos, sin): the best angles are the leading singular vectors of a matrix of at
most 2 x 2.
"""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats


def hinge_angles(axes: Floats, parent_from_bone: Floats) -> Floats:
    """Angles (T, N) of N <= 3 orthogonal hinges (innermost first) that come nearest to rotations (T, 4) [rad]."""
    if len(axes) == 3:
        return _euler(axes, parent_from_bone)
    w, v = parent_from_bone[:, :1], parent_from_bone[:, 1:]
    if len(axes) == 0:
        return np.zeros((len(v), 0))
    along: Floats = v @ axes.T
    if len(axes) == 1:
        return 2.0 * np.arctan2(along, w)
    both: Floats = v @ np.cross(axes[1], axes[0])
    product = np.stack([np.concatenate([w, along[:, :1]], -1), np.stack([along[:, 1], both], -1)], -2)
    outer, _, inner = np.linalg.svd(product)
    return 2.0 * np.stack([np.arctan2(inner[:, 0, 1], inner[:, 0, 0]), np.arctan2(outer[:, 1, 0], outer[:, 0, 0])], -1)


def hinge_rotation(axes: Floats, angles_rad: Floats) -> Floats:
    """Quaternions (T, 4) of hinges turned by (T, N), the last outermost."""
    turn = np.broadcast_to(rotations.IDENTITY, (len(angles_rad), 4))
    for k, axis in enumerate(axes):
        turn = rotations.multiply(rotations.exp(angles_rad[:, k, None] * axis), turn)
    return turn


def _euler(axes: Floats, parent_from_bone: Floats) -> Floats:
    """R = R(c) R(b) R(a) about right-handed orthogonal axes; where b is +-90 deg only a +- c counts and a is 0."""
    m = axes @ rotations.to_matrix(parent_from_bone) @ axes.T
    b = np.arctan2(-m[:, 2, 0], np.hypot(m[:, 2, 1], m[:, 2, 2]))
    locked = np.hypot(m[:, 2, 1], m[:, 2, 2]) < 1e-9
    a = np.where(locked, 0.0, np.arctan2(m[:, 2, 1], m[:, 2, 2]))
    c = np.where(locked, np.arctan2(-m[:, 0, 1], m[:, 1, 1]), np.arctan2(m[:, 1, 0], m[:, 0, 0]))
    return np.stack([a, b, c], axis=-1)


def are_gimbal(axes: Floats) -> bool:
    """Whether the hinges are three and orthogonal."""
    return len(axes) == 3 and bool(np.allclose(axes @ axes.T, np.eye(3), atol=1e-9))


def equivalent_euler_angles(angles_rad: Floats) -> Floats:
    """The other angles (..., 3) of three orthogonal hinges that give the same rotation."""
    out: Floats = angles_rad * [1.0, -1.0, 1.0] + np.pi
    return out
