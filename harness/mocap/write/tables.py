"""Writers of plain tables: CSV with a row for each frame, and TUM trajectories for evo.

CSV has units in the column names; estimates also have status and errors. TUM has a file for each point: time x y z qx
qy qz qw, in metres and seconds.
"""

import numpy as np

from harness.core import rotations
from harness.core.csv_text import csv_line
from harness.mocap.write.posed_motion import PosedMotion


def csv_files(motion: PosedMotion) -> dict[str, str]:
    """Text of the file by its ending. World axes are x forward, y left, z up; an undefined value is empty."""
    columns = ["frame", "time_s", *(f"root_q{c}" for c in "wxyz")]
    columns += [f"{name}_{axis}_m" for name in motion.joint_names for axis in "xyz"]
    columns += [f"{name}_deg" for name in motion.skeleton.dof_names]
    table = np.column_stack(
        [
            motion.time_s,
            motion.world_from_root,
            motion.joints_m.reshape(len(motion), -1),
            np.rad2deg(motion.angles_rad),
            *motion.extra.values(),
        ]
    )
    lines = [csv_line([*columns, *motion.extra])]
    for frame, row in zip(motion.frame_index, table, strict=True):
        lines.append(csv_line([int(frame), *("" if np.isnan(value) else f"{value:.9g}" for value in row)]))
    return {".csv": "".join(lines)}


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
