"""Writer of OpenSim's motion files (MOT): place and rotation of the root, and hinge angles.

The root's columns are those of the pelvis in OpenSim's models: `root_tx`, `root_ty`, `root_tz` in x forward, y up, z
right [m], then the angles about z (tilt), x (list) and y (rotation) of the axes that move along [deg].
"""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.mocap.write.opensim import OPENSIM_FROM_WORLD, rotation_in_opensim
from harness.mocap.write.posed_motion import PosedMotion

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
