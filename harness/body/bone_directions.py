"""Hinge angles that make one body's bones point like another's."""

import numpy as np

from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Floats
from harness.core.hinges import are_gimbal, equivalent_euler_angles, hinge_angles
from harness.core.skeleton import Skeleton


def match_bone_directions(own: Skeleton, qpos: Floats, target: Skeleton) -> Floats:
    """Hinge angles (T, 48) with which the bones of `target` point as those of `own` do at `qpos` (T, 55).

    Bones that agree about their direction in the rest pose keep their angles. A bone with three hinges is turned
    exactly; one with fewer as well as they can, and never beyond a limit that its own angle kept. Each angle is the
    one nearest to the own.
    """
    _, world_from_root, angles_rad = humanoid24.unpack(qpos)
    meant = skeleton.forward_kinematics(own, *humanoid24.unpack(qpos)).world_from_bone
    root, limits_rad = rotations.to_matrix(world_from_root), humanoid24.limits_rad()
    out, turned = np.array(angles_rad), np.empty_like(meant)
    for bone, parent in enumerate(target.parents):
        above = root if parent < 0 else turned[:, parent]
        where = target.dof_of_bone[bone]
        start, axes = angles_rad[:, where], target.axes[where]
        if len(axes):
            wanted = meant[:, bone] @ _shortest_turn(target.bone_m[bone], own.bone_m[bone])
            local = np.swapaxes(above, 1, 2) @ wanted
            fitted = _nearest_euler_angles(axes, hinge_angles(axes, rotations.from_matrix(local)), start)
            if len(axes) < 3:
                low, high = limits_rad[where].T
                fitted = np.clip(fitted, np.minimum(low, start), np.maximum(high, start))
            out[:, where] = fitted
        turned[:, bone] = above @ skeleton.local_rotation(target, bone, out)
    return out


def _shortest_turn(a: Floats, b: Floats) -> Floats:
    """The rotation matrix that takes direction a to b, which are not opposite; none for a bone without length."""
    lengths = np.sqrt((a @ a) * (b @ b))
    if lengths == 0.0:
        return np.eye(3)
    half = np.concatenate([[1.0 + a @ b / lengths], np.cross(a, b) / lengths])
    return rotations.to_matrix(half / np.sqrt(half @ half))


def _nearest_euler_angles(axes: Floats, angle_rad: Floats, near_rad: Floats) -> Floats:
    """The same rotations (T, N), each angle within half a turn of `near_rad`; of twins the nearer one."""
    found = _nearest_turn(angle_rad, near_rad)
    if not are_gimbal(axes):
        return found
    other = _nearest_turn(equivalent_euler_angles(angle_rad), near_rad)
    closer = np.sum((found - near_rad) ** 2, axis=1) <= np.sum((other - near_rad) ** 2, axis=1)
    out: Floats = np.where(closer[:, None], found, other)
    return out


def _nearest_turn(angle_rad: Floats, near_rad: Floats) -> Floats:
    """The same angles, whole turns added so that they lie within half a turn of `near_rad`."""
    out: Floats = angle_rad - 2 * np.pi * np.round((angle_rad - near_rad) / (2 * np.pi))
    return out
