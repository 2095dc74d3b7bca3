"""Hinge angles that make one body's bones point like another's."""

import numpy as np

from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton

_SWEEPS = 6
"""Two hinges are fitted in turn; each sweep leaves less than a tenth of the error."""


def pointing_alike(own: Skeleton, qpos: Floats, target: Skeleton) -> Floats:
    """Hinge angles (T, 48) with which the bones of `target` point as those of `own` do at `qpos` (T, 55).

    Bones that agree about their direction in the rest pose keep their angles. A bone with three hinges is turned
    exactly; one with fewer as well as they can, and never beyond a limit that its own angle kept. Each angle is the
    one nearest to the own.
    """
    _, world_from_root, angles_rad = humanoid24.unpack(qpos)
    meant = skeleton.forward(own, *humanoid24.unpack(qpos)).world_from_bone
    root, limits_rad = rotations.to_matrix(world_from_root), humanoid24.limits_rad()
    out, turned = np.array(angles_rad), np.empty_like(meant)
    for bone, parent in enumerate(target.parents):
        above = root if parent < 0 else turned[:, parent]
        where = target.dof_of_bone[bone]
        start, axes = angles_rad[:, where], target.axes[where]
        if len(axes):
            wanted = meant[:, bone] @ _shortest_turn(target.bone_m[bone], own.bone_m[bone])
            local = np.swapaxes(above, 1, 2) @ wanted
            if len(axes) == 3:
                out[:, where] = _three_hinges(axes, local, start)
            else:
                low, high = limits_rad[where].T
                fitted = _few_hinges(axes, local, start)
                out[:, where] = np.clip(fitted, np.minimum(low, start), np.maximum(high, start))
        turned[:, bone] = above @ skeleton.bone_rotation(target, bone, out)
    return out


def _shortest_turn(a: Floats, b: Floats) -> Floats:
    """The rotation matrix that takes direction a to b, which are not opposite; none for a bone without length."""
    lengths = np.sqrt((a @ a) * (b @ b))
    if lengths == 0.0:
        return np.eye(3)
    half = np.concatenate([[1.0 + a @ b / lengths], np.cross(a, b) / lengths])
    return rotations.to_matrix(half / np.sqrt(half @ half))


def _three_hinges(axes: Floats, local: Floats, near_rad: Floats) -> Floats:
    """Angles (T, 3) about three orthogonal axes, last outermost, that make `local` (T, 3, 3); of the two
    answers the one nearer to `near_rad`."""
    m = axes @ local @ axes.T
    first = np.stack(
        [
            np.arctan2(m[:, 2, 1], m[:, 2, 2]),
            np.arcsin(np.clip(-m[:, 2, 0], -1.0, 1.0)),
            np.arctan2(m[:, 1, 0], m[:, 0, 0]),
        ],
        axis=1,
    )
    twin = first * [1.0, -1.0, 1.0] + np.pi
    first, twin = _nearest(first, near_rad), _nearest(twin, near_rad)
    closer = np.sum((first - near_rad) ** 2, axis=1) <= np.sum((twin - near_rad) ** 2, axis=1)
    out: Floats = np.where(closer[:, None], first, twin)
    return out


def _few_hinges(axes: Floats, local: Floats, start_rad: Floats) -> Floats:
    """Angles (T, 1 or 2) whose rotation is nearest to `local` (T, 3, 3), each hinge in turn solved in closed form."""
    angles = np.array(start_rad)
    for _ in range(1 if len(axes) == 1 else _SWEEPS):
        for k, axis in enumerate(axes):
            rest = local
            for outer in range(len(axes) - 1, k, -1):
                rest = _turn(axes[outer], -angles[:, outer]) @ rest
            for inner in range(k):
                rest = rest @ _turn(axes[inner], -angles[:, inner])
            skew = np.stack([rest[:, i, j] - rest[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=1)
            along = np.einsum("i,tij,j->t", axis, rest, axis)
            angles[:, k] = np.arctan2(skew @ axis, np.trace(rest, axis1=1, axis2=2) - along)
    return _nearest(angles, start_rad)


def _turn(axis: Floats, angle_rad: Floats) -> Floats:
    return rotations.to_matrix(rotations.exp(angle_rad[:, None] * axis))


def _nearest(angle_rad: Floats, near_rad: Floats) -> Floats:
    """The same angles, whole turns added so that they lie within half a turn of `near_rad`."""
    out: Floats = angle_rad - 2 * np.pi * np.round((angle_rad - near_rad) / (2 * np.pi))
    return out
