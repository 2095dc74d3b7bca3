"""Writers of OpenSim's files, in x forward, y up, z right; frames keep their times, so gaps stay visible.

Marker files (TRC) hold joint centres [mm]. Motion files (MOT) hold place and rotation of the root, and hinge angles.
The root's columns are those of the pelvis in OpenSim's models: `root_tx`, `root_ty`, `root_tz` [m], then the angles
about z (tilt), x (list) and y (rotation) of the axes that move along [deg].

Storage files (STO) hold orientations of body segments for OpenSense. Each column is a virtual inertial sensor. It is
named after the segment of OpenSim's full-body models that it turns with, such as `femur_r_imu`, so that OpenSense finds
the segment by the name. Quaternions are (w, x, y, z) in OpenSim's ground, so no further rotation of the sensors is
needed. In the rest pose, a T-pose with the legs apart, all are the identity.
"""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.mocap.write.posed_motion import PosedMotion

OPENSIM_FROM_WORLD: Floats = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation from world axes (x forward, y left, z up) to OpenSim's ground."""


def rotation_in_opensim(world_from_body: Floats) -> Floats:
    """Rotation matrices (..., 3, 3) of bodies whose own axes also become x forward, y up, z right in the rest pose."""
    out: Floats = OPENSIM_FROM_WORLD @ world_from_body @ OPENSIM_FROM_WORLD.T
    return out


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


ROOT_COLUMNS = ("root_tilt", "root_list", "root_rotation", "root_tx", "root_ty", "root_tz")
_LEAST_COSINE = 1e-7
"""Cosine of the list below which tilt and rotation turn about the same axis."""


def mot_files(motion: PosedMotion) -> dict[str, str]:
    """Text of the file by its ending; frames keep their times, so gaps stay visible."""
    names = [*ROOT_COLUMNS, *(name.replace(".", "_") for name in motion.skeleton.dof_names)]
    turn = rotation_in_opensim(rotations.to_matrix(motion.world_from_root))
    root_deg = np.rad2deg(np.unwrap(euler_zxy_rad(turn), axis=0))
    root_m = motion.joints_m[:, 0] @ OPENSIM_FROM_WORLD.T
    table = np.column_stack([motion.time_s, root_deg, root_m, np.rad2deg(motion.angles_rad)])
    head = ["root and hinge angles", "version=1", f"nRows={len(motion)}", f"nColumns={1 + len(names)}", "inDegrees=yes"]
    rows = ["\t".join(f"{value:.6f}" for value in row) for row in table]
    return {".mot": "\n".join([*head, "endheader", "\t".join(["time", *names]), *rows]) + "\n"}


def euler_zxy_rad(rotation: Floats) -> Floats:
    """(..., 3) angles (z, x, y) with R = Rz Rx Ry of matrices (..., 3, 3); y is zero where x is +-90 deg [rad]."""
    r = np.asarray(rotation, dtype=float)
    cos_x = np.hypot(r[..., 2, 0], r[..., 2, 2])
    locked = cos_x < _LEAST_COSINE
    z = np.where(locked, np.arctan2(r[..., 1, 0], r[..., 0, 0]), np.arctan2(-r[..., 0, 1], r[..., 1, 1]))
    x = np.arctan2(r[..., 2, 1], cos_x)
    y = np.where(locked, 0.0, np.arctan2(-r[..., 2, 0], r[..., 2, 2]))
    out: Floats = np.stack([z, x, y], axis=-1)
    return out


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
