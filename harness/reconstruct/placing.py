"""Where a posture stands: its root placed so that its stations come nearest to the readings.

The start of every solve that has no frame before it, and all that the null methods do with a frame.
"""

import numpy as np

from harness.body.humanoid import Body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import pack, unpack
from harness.core.skeleton import Skeleton
from harness.reconstruct.residuals import Residuals

_LEVER_M = 0.3
"""An orientation that is off by an angle counts like a position that is off by the angle times this [m]."""


def placed(residuals: Residuals, qpos: Floats) -> tuple[Floats, Floats]:
    """The configuration (55,) moved as a whole to the readings: turned about the vertical only, and freely.

    Least squares over positions and orientations (Kabsch 1976), each counting as it is trusted. Without positions it
    turns about its own root.
    """
    count = len(residuals.bones)
    residuals.kinematics.set(qpos)
    at_m, turned = residuals.kinematics.station_poses(residuals.bones, residuals.mount_m, residuals.bone_from_station)
    target = rotations.multiply(residuals.world_from_target, residuals.bone_from_station)
    positions, orientations = residuals.trust[:count], residuals.trust[count:]
    middle_m, target_middle_m = qpos[:3], qpos[:3]
    moment = np.zeros((3, 3))
    if total := float(positions.sum()):
        middle_m, target_middle_m = positions @ at_m / total, positions @ residuals.target_m / total
        moment += (positions[:, None] * (residuals.target_m - target_middle_m)).T @ (at_m - middle_m)
    if orientations.any():
        turns = rotations.to_matrix(target) @ rotations.to_matrix(rotations.inverse(turned))
        moment += _LEVER_M**2 * np.tensordot(orientations, turns, axes=1)
    yaw = rotations.about_z(np.arctan2(moment[1, 0] - moment[0, 1], moment[0, 0] + moment[1, 1]))
    left, _, right = np.linalg.svd(moment)
    free = left @ np.diag([1.0, 1.0, np.linalg.det(left @ right)]) @ right
    upright, tilted = (_moved(qpos, turn, middle_m, target_middle_m) for turn in (yaw, rotations.from_matrix(free)))
    return upright, tilted


def nearest_placed(residuals: Residuals, qpos: Floats) -> Floats:
    """The cheaper of the two; the upright one unless tilting pays."""
    upright, tilted = placed(residuals, qpos)
    return tilted if residuals.place(tilted) < 0.9 * residuals.place(upright) else upright


def postures(body: Body) -> tuple[Floats, ...]:
    """Configurations (55,) from which a solver finds most poses: T-pose, arms hanging, forearms raised."""
    start = tpose(body.skeleton)
    return start, *(_with_arms(body.skeleton, start, *degrees) for degrees in ((75.0, 15.0), (60.0, 90.0)))


def _with_arms(skeleton: Skeleton, qpos: Floats, lowered_deg: float, bent_deg: float) -> Floats:
    root_m, turned, angles = unpack(qpos)
    angles = np.array(angles)
    for side, sign in (("l", 1.0), ("r", -1.0)):
        angles[skeleton.dof_names.index(f"{side}humerus.rz")] = np.deg2rad(sign * lowered_deg)
        angles[skeleton.dof_names.index(f"{side}radius.rx")] = np.deg2rad(bent_deg)
    return pack(root_m, turned, angles)


def _moved(qpos: Floats, turn: Floats, from_m: Floats, to_m: Floats) -> Floats:
    out = np.array(qpos)
    out[:3] = to_m + rotations.rotate(turn, qpos[:3] - from_m)
    out[3:7] = rotations.multiply(turn, qpos[3:7])
    return out
