"""Hinge angles with which the bones of one skeleton point in the directions of another's."""

import numpy as np

from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton, are_gimbal, equivalent_euler_angles, hinge_angles


def match_bone_directions(source: Skeleton, qpos: Floats, target: Skeleton) -> Floats:
    """Hinge angles (T, 48) with which the bones of `target` point as those of `source` do at `qpos` (T, 55) [rad].

    Bones with the same direction in both rest poses keep their angles. A bone with three hinges is oriented exactly. A
    bone with fewer hinges is oriented as closely as they allow, within the joint limits unless the source angle is
    outside. Of equivalent angles, the one nearest to the source angle is chosen.
    """
    _, world_from_root, angles_rad = humanoid24.unpack(qpos)
    source_rotation = skeleton.forward_kinematics(source, *humanoid24.unpack(qpos)).world_from_bone
    root, limits_rad = rotations.to_matrix(world_from_root), humanoid24.limits_rad()
    out, target_rotation = np.array(angles_rad), np.empty_like(source_rotation)
    for bone, parent in enumerate(target.parents):
        above = root if parent < 0 else target_rotation[:, parent]
        dofs = target.dof_of_bone[bone]
        start, axes = angles_rad[:, dofs], target.axes[dofs]
        if len(axes):
            rotation = source_rotation[:, bone] @ _shortest_rotation(target.bone_m[bone], source.bone_m[bone])
            local = np.swapaxes(above, 1, 2) @ rotation
            fitted = _nearest_euler_angles(axes, hinge_angles(axes, rotations.from_matrix(local)), start)
            if len(axes) < 3:
                low, high = limits_rad[dofs].T
                fitted = np.clip(fitted, np.minimum(low, start), np.maximum(high, start))
            out[:, dofs] = fitted
        target_rotation[:, bone] = above @ skeleton.local_rotation(target, bone, out)
    return out


def _shortest_rotation(a: Floats, b: Floats) -> Floats:
    """Shortest rotation (3, 3) of direction a to b, which are not opposite; the identity for a zero vector."""
    lengths = np.sqrt((a @ a) * (b @ b))
    if lengths == 0.0:
        return np.eye(3)
    half = np.concatenate([[1.0 + a @ b / lengths], np.cross(a, b) / lengths])
    return rotations.to_matrix(half / np.sqrt(half @ half))


def _nearest_euler_angles(axes: Floats, angle_rad: Floats, near_rad: Floats) -> Floats:
    """Angles (T, N) of the same rotations that are nearest to `near_rad` [rad]."""
    first = _nearest_turn(angle_rad, near_rad)
    if not are_gimbal(axes):
        return first
    second = _nearest_turn(equivalent_euler_angles(angle_rad), near_rad)
    closer = np.sum((first - near_rad) ** 2, axis=1) <= np.sum((second - near_rad) ** 2, axis=1)
    out: Floats = np.where(closer[:, None], first, second)
    return out


def _nearest_turn(angle_rad: Floats, near_rad: Floats) -> Floats:
    """Angles with whole turns added, so that they lie within half a turn of `near_rad` [rad]."""
    out: Floats = angle_rad - 2 * np.pi * np.round((angle_rad - near_rad) / (2 * np.pi))
    return out
