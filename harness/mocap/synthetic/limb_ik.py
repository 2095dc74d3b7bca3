"""Analytic inverse kinematics of two-bone limbs, down to this skeleton's hinges.

Every limb bone of the skeleton has an orthonormal frame of hinge axes (x: the flexion axis, y: along the bone
towards the body, z = x × y). A turn written in that frame is R = Rz(c) Ry(b) Rx(a), so the hinge angles are its
Euler angles, and the elbow or knee turns about the same x as the bone above it.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.rotations import wrap_angle
from harness.core.skeleton import Skeleton


def normalize(v: Floats) -> Floats:
    out: Floats = v / np.sqrt(np.sum(v**2, axis=-1, keepdims=True))
    return out


def matrix_from_columns(x: Floats, y: Floats, z: Floats) -> Floats:
    """(..., 3, 3) with these columns (broadcast)."""
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def axis_rotation(axis: int, angle_rad: float | Floats) -> Floats:
    """(..., 3, 3) rotation about coordinate axis 0, 1 or 2."""
    angle = np.asarray(angle_rad, dtype=float)
    c, s = np.cos(angle), np.sin(angle)
    out = np.zeros((*angle.shape, 3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out[..., axis, axis] = 1.0
    out[..., i, i], out[..., j, j] = c, c
    out[..., i, j], out[..., j, i] = -s, s
    return out


def horizontal_vector(yaw_rad: float | Floats, ahead: float | Floats, left: float | Floats) -> Floats:
    """(..., 2) the vector so far ahead and left when facing `yaw_rad`."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.stack([c * ahead - s * left, s * ahead + c * left], axis=-1)


def stack_columns(*values: float | Floats) -> Floats:
    """(T, N) curves (T,) and constants side by side."""
    return np.stack(np.broadcast_arrays(*values), axis=-1)


def rotate_vectors(m: Floats, v: Floats) -> Floats:
    """(..., 3) vectors v in the frame that m (..., 3, 3) comes from, taken through m."""
    out: Floats = np.einsum("...ij,...j->...i", m, v)
    return out


def euler_xyz(m: Floats) -> Floats:
    """(..., 3) angles (a, b, c) of m = Rz(c) Ry(b) Rx(a); b within ±90 deg."""
    a = np.arctan2(m[..., 2, 1], m[..., 2, 2])
    b = -np.arcsin(np.clip(m[..., 2, 0], -1.0, 1.0))
    c = np.arctan2(m[..., 1, 0], m[..., 0, 0])
    return np.stack([a, b, c], axis=-1)


def hinge_frame(skeleton: Skeleton, bone: str) -> Floats:
    """(3, 3) the three hinge axes of a bone as columns."""
    out: Floats = skeleton.axes[skeleton.dof_of_bone[skeleton.index(bone)]].T
    return out


def middle_joint(top: Floats, end: Floats, towards: Floats, first_m: float, second_m: float) -> Floats:
    """(T, 3) the knee or elbow of a limb from `top` to `end`, bent towards the direction `towards`.

    A target out of reach is drawn in: callers keep within `reach`.
    """
    line = end - top
    distance = np.sqrt(np.sum(line**2, axis=-1, keepdims=True))
    along = line / distance
    distance = np.clip(distance, abs(first_m - second_m) + 1e-3, 0.9999 * (first_m + second_m))
    foot = (first_m**2 - second_m**2 + distance**2) / (2.0 * distance)
    aside = normalize(towards - along * np.sum(towards * along, axis=-1, keepdims=True))
    out: Floats = top + along * foot + aside * np.sqrt(first_m**2 - foot**2)
    return out


def two_bone_angles(first: Floats, second: Floats, normal: Floats, rest: Floats) -> tuple[Floats, Floats]:
    """World rotation (T, 3, 3) of a limb's first bone and the angle (T,) of the hinge below it.

    `first` and `second` are the unit directions of the two bones, `normal` the unit hinge axis between them, `rest`
    the first bone's frame of hinge axes, whose y runs against the bone.
    """
    world = matrix_from_columns(normal, -first, np.cross(normal, -first)) @ rest.T
    sine = np.sum(np.cross(first, second) * normal, axis=-1)
    return world, np.arctan2(sine, np.sum(first * second, axis=-1))


def universal_joint_angles(vector: Floats, direction: Floats) -> tuple[Floats, Floats]:
    """Angles (a, c) with Ry(c) Rx(a) taking `vector` (3,) to the unit `direction` (T, 3): a foot on its shank.

    A direction nearer to the shank than the vector can come is met as nearly as it can.
    """
    v = normalize(vector)
    height = np.clip(direction[..., 1] / np.hypot(v[1], v[2]), -1.0, 1.0)
    a = wrap_angle(np.arccos(height) - np.arctan2(v[2], v[1]))
    forward = np.sin(a) * v[1] + np.cos(a) * v[2]
    return a, wrap_angle(np.arctan2(direction[..., 0], direction[..., 2]) - np.arctan2(v[0], forward))
