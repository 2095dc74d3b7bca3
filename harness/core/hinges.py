"""Conversion between rotations and the angles of a bone's one, two or three orthogonal hinges, innermost first.

Three orthogonal hinges reach any rotation (closed-form Euler angles), each by two sets of angles; see
`equivalent_euler_angles`. One or two hinges give the nearest rotation: the one whose quaternion has the largest inner
product with the wanted quaternion. That product is bilinear in the half-angle vectors (cos, sin), so the best angles
are the leading singular vectors of a matrix of at most 2 x 2.
"""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats


def hinge_angles(axes: Floats, parent_from_bone: Floats) -> Floats:
    """Angles (T, N) [rad] of N <= 3 orthogonal hinges (innermost first) whose rotations are nearest to (T, 4)."""
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
    """Quaternions (T, 4) of hinges (N, 3) at angles (T, N) [rad], innermost first."""
    out = np.broadcast_to(rotations.IDENTITY, (len(angles_rad), 4))
    for k, axis in enumerate(axes):
        out = rotations.multiply(rotations.exp(angles_rad[:, k, None] * axis), out)
    return out


def _euler(axes: Floats, parent_from_bone: Floats) -> Floats:
    """Angles (T, 3) a, b, c of R = R(c) R(b) R(a) about right-handed orthogonal axes.

    Where b is +-90 deg only a + c or a - c is determined, and a is 0.
    """
    m = axes @ rotations.to_matrix(parent_from_bone) @ axes.T
    b = np.arctan2(-m[:, 2, 0], np.hypot(m[:, 2, 1], m[:, 2, 2]))
    locked = np.hypot(m[:, 2, 1], m[:, 2, 2]) < 1e-9
    a = np.where(locked, 0.0, np.arctan2(m[:, 2, 1], m[:, 2, 2]))
    c = np.where(locked, np.arctan2(-m[:, 0, 1], m[:, 1, 1]), np.arctan2(m[:, 1, 0], m[:, 0, 0]))
    return np.stack([a, b, c], axis=-1)


def are_gimbal(axes: Floats) -> bool:
    """Whether the axes (N, 3) are three and orthogonal."""
    return len(axes) == 3 and bool(np.allclose(axes @ axes.T, np.eye(3), atol=1e-9))


def equivalent_euler_angles(angles_rad: Floats) -> Floats:
    """Second set of angles (..., 3) of three orthogonal hinges for the same rotation."""
    out: Floats = angles_rad * [1.0, -1.0, 1.0] + np.pi
    return out
