"""Writer of OpenSim's marker files (TRC): joint centres [mm]; x forward, y up, z right."""

from harness.mocap.write.opensim import OPENSIM_FROM_WORLD
from harness.mocap.write.posed_motion import PosedMotion


def trc_files(motion: PosedMotion) -> dict[str, str]:
    """Text of the file by its ending; frames keep their times, so gaps stay visible."""
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
    return {".trc": "\n".join([*head, *rows]) + "\n"}
