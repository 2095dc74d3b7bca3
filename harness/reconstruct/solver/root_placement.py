"""Where a posture stands: its root placed so that its stations come nearest to the readings.

The start of every solve that has no frame before it, and all that the null methods do with a frame.
"""

import numpy as np

from harness.body.humanoid import Body, tpose
from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.humanoid24 import pack, unpack
from harness.core.skeleton import Skeleton
from harness.reconstruct.solver.residuals import Residuals

_LEVER_M = 0.3
"""An orientation that is off by an angle counts like a position that is off by the angle times this [m]."""


def candidate_placements(residuals: Residuals, qpos: Floats) -> tuple[Floats, Floats]:
    """The configuration (55,) moved as a whole to the readings: turned about the vertical only, and freely.

    Least squares over positions and orientations (Kabsch 1976), each counting as it is trusted. Without positions it
    turns about its own root.
    """
    count = len(residuals.bones)
    residuals.kinematics.set(qpos)
    at_m, turned = residuals.kinematics.station_poses(residuals.bones, residuals.mount_m, residuals.bone_from_station)
    positions, orientations = residuals.confidence[:count], residuals.confidence[count:]
    middle_m, target_middle_m, moment = _cross_covariance(
        *(at_m, turned, residuals.target_m, residuals.world_from_target, residuals.bone_from_station),
        *(positions, orientations, qpos[:3]),
    )
    yaw_rad = np.arctan2(moment[1, 0] - moment[0, 1], moment[0, 0] + moment[1, 1])
    left, _, right = np.linalg.svd(moment)
    flip = np.array([1.0, 1.0, np.linalg.det(left @ right)])
    upright = np.array([np.cos(0.5 * yaw_rad), 0.0, 0.0, np.sin(0.5 * yaw_rad)])
    tilted = _quaternion((left * flip) @ right)
    return _transform(qpos, upright, middle_m, target_middle_m), _transform(qpos, tilted, middle_m, target_middle_m)


def place_root(residuals: Residuals, qpos: Floats) -> Floats:
    """The cheaper of the two; the upright one unless tilting pays."""
    upright, tilted = candidate_placements(residuals, qpos)
    return tilted if residuals.evaluate(tilted) < 0.9 * residuals.evaluate(upright) else upright


def starting_postures(body: Body) -> tuple[Floats, ...]:
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


@compiled
def _cross_covariance(
    at_m: Floats,
    turned: Floats,
    target_m: Floats,
    world_from_target: Floats,
    bone_from_station: Floats,
    positions: Floats,
    orientations: Floats,
    root_m: Floats,
) -> tuple[Floats, Floats, Floats]:
    """The middles (3,) of the stations and of the readings, as they are trusted, and the moment (3, 3) between them."""
    middle_m, target_middle_m, moment = root_m.copy(), root_m.copy(), np.zeros((3, 3))
    total = positions.sum()
    if total > 0.0:
        middle_m[:], target_middle_m[:] = 0.0, 0.0
        for s in range(len(positions)):
            middle_m += positions[s] / total * at_m[s]
            target_middle_m += positions[s] / total * target_m[s]
        for s in range(len(positions)):
            moment += np.outer(positions[s] * (target_m[s] - target_middle_m), at_m[s] - middle_m)
    for s in range(len(orientations)):
        if orientations[s] > 0.0:
            target = _quaternion_product(world_from_target[s], bone_from_station[s])
            turn = _quaternion_product(target, turned[s] * np.array([1.0, -1.0, -1.0, -1.0]))
            moment += _LEVER_M**2 * orientations[s] * _matrix(turn)
    return middle_m, target_middle_m, moment


@compiled
def _transform(qpos: Floats, turn: Floats, from_m: Floats, to_m: Floats) -> Floats:
    """The configuration (55,) turned about a point that goes elsewhere."""
    out = qpos.copy()
    out[:3] = to_m + _matrix(turn) @ (qpos[:3] - from_m)
    out[3:7] = _quaternion_product(turn, qpos[3:7])
    return out


@compiled
def _quaternion_product(p: Floats, q: Floats) -> Floats:
    """Of two quaternions (4,)."""
    return np.array(
        [
            p[0] * q[0] - p[1] * q[1] - p[2] * q[2] - p[3] * q[3],
            p[0] * q[1] + p[1] * q[0] + p[2] * q[3] - p[3] * q[2],
            p[0] * q[2] - p[1] * q[3] + p[2] * q[0] + p[3] * q[1],
            p[0] * q[3] + p[1] * q[2] - p[2] * q[1] + p[3] * q[0],
        ]
    )


@compiled
def _matrix(q: Floats) -> Floats:
    """(3, 3) of a unit quaternion (4,)."""
    w, x, y, z = q
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


@compiled
def _quaternion(r: Floats) -> Floats:
    """(4,) of a rotation matrix (3, 3), by its largest component (Shepperd 1978)."""
    trace = r[0, 0] + r[1, 1] + r[2, 2]
    i = np.argmax(np.array([trace, r[0, 0], r[1, 1], r[2, 2]]))
    if i == 0:
        q = np.array([1.0 + trace, r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    else:
        a = i - 1
        b, c = (a + 1) % 3, (a + 2) % 3
        q = np.empty(4)
        q[0] = r[c, b] - r[b, c]
        q[1 + a] = 1.0 + r[a, a] - r[b, b] - r[c, c]
        q[1 + b] = r[b, a] + r[a, b]
        q[1 + c] = r[c, a] + r[a, c]
    out: Floats = q / np.sqrt(np.sum(q**2))
    return out
