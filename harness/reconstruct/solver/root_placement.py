"""Placement of a posture in the world: the root transform that brings its stations nearest to the readings.

It gives the start of every solve that has no frame before it. The null methods do nothing else with a frame.
"""

import numpy as np

from harness.body import Body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import as_tuple, matrix_from_quaternion, quaternion_from_matrix, quaternion_product
from harness.core.humanoid24 import pack, unpack
from harness.core.skeleton import Skeleton
from harness.reconstruct.solver.residuals import Residuals

Poses = tuple[Floats, Floats]
"""Positions (S, 3) and orientations (S, 4) of stations."""
_LEVER_M = 0.3
"""An orientation error of an angle counts like a position error of the angle times this lever [m]."""


def candidate_placements(residuals: Residuals, qpos: Floats) -> tuple[Floats, Floats]:
    """Two rigid motions of a configuration (55,) to the readings: rotated about the vertical only, and freely.

    Least squares over positions and orientations (Kabsch 1976), weighted by their confidence. Without positions the
    rotation is about the root.
    """
    residuals.kinematics.set(qpos)
    station_m, world_from_station = residuals.kinematics.station_poses(
        residuals.bones, residuals.mount_m, residuals.bone_from_station
    )
    measured = residuals.target_m, residuals.world_from_target
    mean_m, target_mean_m, moment = _cross_covariance(
        (station_m, world_from_station), measured, residuals.bone_from_station, residuals.confidence, qpos[:3]
    )
    yaw_rad = np.arctan2(moment[1, 0] - moment[0, 1], moment[0, 0] + moment[1, 1])
    upright = np.array([np.cos(0.5 * yaw_rad), 0.0, 0.0, np.sin(0.5 * yaw_rad)])
    tilted = quaternion_from_matrix(rotations.nearest_rotation(moment))
    return _transform(qpos, upright, mean_m, target_mean_m), _transform(qpos, tilted, mean_m, target_mean_m)


def place_root(residuals: Residuals, qpos: Floats) -> Floats:
    """The upright placement (55,) of a configuration, or the tilted one if that costs less than 0.9 of it."""
    upright, tilted = candidate_placements(residuals, qpos)
    return tilted if residuals.evaluate(tilted) < 0.9 * residuals.evaluate(upright) else upright


def starting_postures(body: Body) -> tuple[Floats, ...]:
    """Configurations (55,) from which a solver reaches most poses: T-pose, arms hanging, forearms raised."""
    start = tpose(body.skeleton)
    return start, *(_with_arms(body.skeleton, start, *degrees) for degrees in ((75.0, 15.0), (60.0, 90.0)))


def _with_arms(skeleton: Skeleton, qpos: Floats, shoulder_deg: float, elbow_deg: float) -> Floats:
    """A T-pose with arms lowered by `shoulder_deg` and elbows bent by `elbow_deg`."""
    root_m, world_from_root, angles = unpack(qpos)
    angles = np.array(angles)
    for side, sign in (("l", 1.0), ("r", -1.0)):
        angles[skeleton.dof_names.index(f"{side}humerus.rz")] = np.deg2rad(sign * shoulder_deg)
        angles[skeleton.dof_names.index(f"{side}radius.rx")] = np.deg2rad(elbow_deg)
    return pack(root_m, world_from_root, angles)


@compiled
def _cross_covariance(
    modelled: Poses, measured: Poses, bone_from_station: Floats, confidence: Floats, root_m: Floats
) -> tuple[Floats, Floats, Floats]:
    """Weighted means (3,) of stations and of readings, and the cross-covariance (3, 3) between them.

    Weights are the confidence (2S,) of positions, then of orientations. An orientation adds the rotation from modelled
    to measured.
    """
    station_m, world_from_station = modelled
    target_m, world_from_target = measured
    positions, orientations = confidence[: len(station_m)], confidence[len(station_m) :]
    mean_m, target_mean_m, moment = root_m.copy(), root_m.copy(), np.zeros((3, 3))
    total = positions.sum()
    if total > 0.0:
        mean_m[:], target_mean_m[:] = 0.0, 0.0
        for s in range(len(positions)):
            mean_m += positions[s] / total * station_m[s]
            target_mean_m += positions[s] / total * target_m[s]
        for s in range(len(positions)):
            moment += np.outer(positions[s] * (target_m[s] - target_mean_m), station_m[s] - mean_m)
    for s in range(len(orientations)):
        if orientations[s] > 0.0:
            target = quaternion_product(as_tuple(world_from_target[s]), as_tuple(bone_from_station[s]))
            w, x, y, z = as_tuple(world_from_station[s])
            turn = np.array(quaternion_product(target, (w, -x, -y, -z)))
            moment += _LEVER_M**2 * orientations[s] * matrix_from_quaternion(turn)
    return mean_m, target_mean_m, moment


@compiled
def _transform(qpos: Floats, turn: Floats, from_m: Floats, to_m: Floats) -> Floats:
    """The configuration (55,) rotated by a quaternion (4,) about a point (3,) that is taken to another point (3,)."""
    out = qpos.copy()
    out[:3] = to_m + matrix_from_quaternion(turn) @ (qpos[:3] - from_m)
    out[3], out[4], out[5], out[6] = quaternion_product(as_tuple(turn), as_tuple(qpos[3:7]))
    return out
