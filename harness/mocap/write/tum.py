"""TUM trajectories, as evo reads them: time x y z qx qy qz qw, one file a point; metres and seconds."""

import numpy as np

from harness.core import rotations
from harness.mocap.write.posed_motion import PosedMotion

POINTS = ("root", "head", "lhand", "rhand", "lfoot", "rfoot")
"""The root, and far ends of bones with the bones' orientation."""


def tum_files(motion: PosedMotion) -> dict[str, str]:
    """Ending -> text of the file."""
    return {f".{point}.tum": _trajectory_text(motion, point) for point in POINTS}


def _trajectory_text(motion: PosedMotion, point: str) -> str:
    place_m = motion.joints_m[:, motion.joint_names.index(point)]
    if point == "root":
        q = motion.world_from_root
    else:
        q = rotations.from_matrix(motion.world_from_bone[:, motion.skeleton.index(point)])
    table = np.column_stack([motion.time_s, place_m, q[:, 1:], q[:, 0]])
    return "".join(" ".join(f"{value:.9f}" for value in row) + "\n" for row in table)
