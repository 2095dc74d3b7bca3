"""Writer of BVH files: centimetres; x left, y up, z forward, as in the common conversion of CMU's library.

Every bone is a joint of the same name at the bone's near end; End Sites are the far ends of head, hands and feet. BVH
has no times, so a frame without an estimate repeats the frame before it, in truth and estimate alike.
`harness.mocap.read.bvh` reads these files back.
"""

from collections.abc import Iterator

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.read.asf import WORLD_FROM_ASF
from harness.mocap.write.posed_motion import PosedMotion

CENTIMETRES_PER_METRE = 100.0
_ROTATION = "Zrotation Yrotation Xrotation"


def bvh_files(motion: PosedMotion) -> dict[str, str]:
    """Text of the file by its ending."""
    return {".bvh": "\n".join([*hierarchy_lines(motion.skeleton), *_motion_lines(motion)]) + "\n"}


def euler_zyx_deg(rotation: Floats) -> Floats:
    """(..., 3) angles (z, y, x) with R = Rz Ry Rx of matrices (..., 3, 3); x is zero where y is +-90 deg [deg]."""
    r = np.asarray(rotation, dtype=float)
    cos_y = np.hypot(r[..., 0, 0], r[..., 1, 0])
    locked = cos_y < 1e-7
    z = np.where(locked, np.arctan2(-r[..., 0, 1], r[..., 1, 1]), np.arctan2(r[..., 1, 0], r[..., 0, 0]))
    y = np.arctan2(-r[..., 2, 0], cos_y)
    x = np.where(locked, 0.0, np.arctan2(r[..., 2, 1], r[..., 2, 2]))
    out: Floats = np.rad2deg(np.stack([z, y, x], axis=-1))
    return out


def hierarchy_lines(skeleton: Skeleton) -> Iterator[str]:
    """The lines of the hierarchy, the first part of a file."""
    offset_cm = skeleton.bone_m @ WORLD_FROM_ASF * CENTIMETRES_PER_METRE
    children = {
        p: [b for b, parent in enumerate(skeleton.parents) if parent == p] for p in (-1, *range(len(offset_cm)))
    }

    def joint_lines(bone: int, start_cm: Floats, tab: str) -> Iterator[str]:
        yield f"{tab}JOINT {skeleton.names[bone]}"
        yield f"{tab}{{"
        yield f"{tab}\tOFFSET {format_row(start_cm)}"
        yield f"{tab}\tCHANNELS 3 {_ROTATION}"
        for child in children[bone]:
            yield from joint_lines(child, offset_cm[bone], tab + "\t")
        if not children[bone]:
            yield f"{tab}\tEnd Site"
            yield f"{tab}\t{{"
            yield f"{tab}\t\tOFFSET {format_row(offset_cm[bone])}"
            yield f"{tab}\t}}"
        yield f"{tab}}}"

    yield from ("HIERARCHY", "ROOT root", "{", "\tOFFSET 0.000000 0.000000 0.000000")
    yield f"\tCHANNELS 6 Xposition Yposition Zposition {_ROTATION}"
    for bone in children[-1]:
        yield from joint_lines(bone, np.zeros(3), "\t")
    yield "}"


def _motion_lines(motion: PosedMotion) -> Iterator[str]:
    grid = np.arange(motion.frame_index[0], motion.frame_index[-1] + 1)
    source = np.searchsorted(motion.frame_index, grid, side="right") - 1
    table = channel_values(
        motion.skeleton, motion.joints_m[:, 0], rotations.to_matrix(motion.world_from_root), motion.world_from_bone
    )
    table[:, 3:] = np.unwrap(table[:, 3:], period=360.0, axis=0)
    yield from ("MOTION", f"Frames: {len(grid)}", f"Frame Time: {1.0 / motion.rate_hz:.9f}")
    yield from map(format_row, table[source])


def channel_values(skeleton: Skeleton, root_m: Floats, world_from_root: Floats, world_from_bone: Floats) -> Floats:
    """Channel values (F, 6 + 3 B) of frames, in centimetres and degrees within +-180.

    `root_m` (F, 3) is the root's position [m]; `world_from_root` (F, 3, 3) and `world_from_bone` (F, B, 3, 3) are
    rotation matrices.
    """
    local = [world_from_root]
    for bone, parent in enumerate(skeleton.parents):
        above = world_from_root if parent < 0 else world_from_bone[:, parent]
        local.append(np.swapaxes(above, -1, -2) @ world_from_bone[:, bone])
    # BVH lists joints depth first; the skeleton may have another order
    order = [0, *(1 + bone for bone in _depth_first(skeleton))]
    rotation = np.stack([local[j] for j in order], axis=1)
    angles_deg = euler_zyx_deg(WORLD_FROM_ASF.T @ rotation @ WORLD_FROM_ASF)
    root_cm = root_m @ WORLD_FROM_ASF * CENTIMETRES_PER_METRE
    return np.concatenate([root_cm, angles_deg.reshape(len(root_cm), -1)], axis=1)


def _depth_first(skeleton: Skeleton) -> list[int]:
    def below(parent: int) -> Iterator[int]:
        for bone, above in enumerate(skeleton.parents):
            if above == parent:
                yield bone
                yield from below(bone)

    return list(below(-1))


def format_row(values: Floats) -> str:
    """One line of a file: numbers with six decimals."""
    return " ".join(f"{value:.6f}" for value in values)
