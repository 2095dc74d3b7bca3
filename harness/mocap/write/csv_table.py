"""Writer of CSV tables: one row per frame, units in the column names; estimates also have status and errors."""

import numpy as np

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
