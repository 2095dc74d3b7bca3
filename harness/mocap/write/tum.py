"""Writer of TUM trajectories for evo: time x y z qx qy qz qw, one file per point; metres and seconds."""

import numpy as np

from harness.core import rotations
from harness.mocap.write.posed_motion import PosedMotion

POINTS = ("root", "head", "lhand", "rhand", "lfoot", "rfoot")
"""Exported points: the root, and the far ends of bones with the bones' orientation."""


def tum_files(motion: PosedMotion) -> dict[str, str]:
    """Texts of the files by their endings."""
    return {f".{point}.tum": _trajectory_text(motion, point) for point in POINTS}


def _trajectory_text(motion: PosedMotion, point: str) -> str:
    position_m = motion.joints_m[:, motion.joint_names.index(point)]
    if point == "root":
        q = motion.world_from_root
    else:
        q = rotations.from_matrix(motion.world_from_bone[:, motion.skeleton.index(point)])
    table = np.column_stack([motion.time_s, position_m, q[:, 1:], q[:, 0]])
    return "".join(" ".join(f"{value:.9f}" for value in row) + "\n" for row in table)
