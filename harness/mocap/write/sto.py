"""Writer of OpenSim's storage files (STO) for OpenSense: orientations of body segments as quaternions.

Each column is a virtual inertial sensor. It is named after the segment of OpenSim's full-body models that it turns
with, such as `femur_r_imu`, so that OpenSense finds the segment by the name. Quaternions are (w, x, y, z) in OpenSim's
ground (x forward, y up, z right), so no further rotation of the sensors is needed. In the rest pose, a T-pose with the
legs apart, all are the identity.
"""

import numpy as np

from harness.core import rotations
from harness.mocap.write.opensim import rotation_in_opensim
from harness.mocap.write.posed_motion import PosedMotion

SEGMENT_OF_BONE = {
    "root": "pelvis",
    "thorax": "torso",
    "head": "head",
    **{f"{side}{bone}": f"{segment}_{side}" for side in "rl" for bone, segment in (
        ("humerus", "humerus"),
        ("radius", "ulna"),
        ("wrist", "radius"),
        ("hand", "hand"),
        ("femur", "femur"),
        ("tibia", "tibia"),
        ("foot", "calcn"),
    )},
}  # fmt: skip
"""Segment of OpenSim's models for a bone. The forearm's twist is in the bone `wrist`, and in the segment `radius`."""


def sto_files(motion: PosedMotion) -> dict[str, str]:
    """Text of the file by its ending; frames keep their times, so gaps stay visible."""
    columns = []
    for bone in SEGMENT_OF_BONE:
        if bone == "root":
            turn = rotations.to_matrix(motion.world_from_root)
        else:
            turn = motion.world_from_bone[:, motion.skeleton.index(bone)]
        columns.append(rotations.continuous(rotations.from_matrix(rotation_in_opensim(turn))))
    names = [f"{segment}_imu" for segment in SEGMENT_OF_BONE.values()]
    head = [f"DataRate={motion.rate_hz:.6f}", "DataType=Quaternion", "version=3", "OpenSimVersion=4.1", "endheader"]
    rows = [
        "\t".join([f"{time_s:.6f}", *(",".join(f"{value:.9f}" for value in q) for q in quaternions)])
        for time_s, quaternions in zip(motion.time_s, np.stack(columns, axis=1), strict=True)
    ]
    return {".sto": "\n".join([*head, "\t".join(["time", *names]), *rows]) + "\n"}
