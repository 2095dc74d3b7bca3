"""Writer of OpenSim files: joint centres as markers (TRC, mm), hinge angles (MOT, deg); x forward, y up, z right."""

import numpy as np

from harness.core.arrays import Floats
from harness.mocap.write.posed_motion import PosedMotion

OPENSIM_FROM_WORLD: Floats = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])


def trc_files(motion: PosedMotion) -> dict[str, str]:
    """Texts of the files by their endings; frames keep their times, so gaps stay visible."""
    return {".trc": _trc_text(motion), ".mot": _mot_text(motion)}


def _trc_text(motion: PosedMotion) -> str:
    names, rate, frames = motion.joint_names, f"{motion.rate_hz:g}", len(motion)
    joints_mm = 1e3 * motion.joints_m @ OPENSIM_FROM_WORLD.T
    head = [
        "PathFileType\t4\t(X/Y/Z)\tjoints.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate}\t{rate}\t{frames}\t{len(names)}\tmm\t{rate}\t1\t{frames}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{n}" for n in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    rows = [
        f"{n}\t{time_s:.6f}\t" + "\t".join(f"{value:.4f}" for value in joints.ravel())
        for n, (time_s, joints) in enumerate(zip(motion.time_s, joints_mm, strict=True), start=1)
    ]
    return "\n".join([*head, *rows]) + "\n"


def _mot_text(motion: PosedMotion) -> str:
    names = [name.replace(".", "_") for name in motion.skeleton.dof_names]
    head = ["hinge angles", "version=1", f"nRows={len(motion)}", f"nColumns={1 + len(names)}", "inDegrees=yes"]
    table = np.column_stack([motion.time_s, np.rad2deg(motion.angles_rad)])
    rows = ["\t".join(f"{value:.6f}" for value in row) for row in table]
    return "\n".join([*head, "endheader", "\t".join(["time", *names]), *rows]) + "\n"
