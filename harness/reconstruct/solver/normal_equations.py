"""Residuals of stations and their normal equations, compiled; `residuals` says what they measure.

A station couples two directions only when one is an ancestor of the other. Such a matrix is stored as rows (V, D): row
i holds the entries of direction i with each of its ancestors, by their depth, and its diagonal entry last. Two rows
agree about the ancestors that they share. Eliminated from the limbs inwards, the matrix gets no entries elsewhere
(Featherstone 2008, ch. 8.3), so a step for 54 degrees of freedom costs a few microseconds.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import Vector, as_tuple, quaternion_product, rotation_vector
from harness.reconstruct.solver.kinematic_tree import (
    KinematicState,
    KinematicTree,
    forward_kinematics,
    station_jacobian,
)

Readings = tuple[Floats, Floats, Bools, Bools, Floats, Bools]
"""Positions, orientations, where each is valid, quality and suspicion of a frame, as `TrackerFrame` has them."""
Wrench = tuple[float, float, float, float, float, float]
"""Force and torque: the weighted position error and orientation error of a station."""


class StationTargets(NamedTuple):
    """Where one frame puts the stations; rows are the S positions, then the S orientations."""

    target_m: Floats
    """(S, 3) measured positions in the world [m]."""
    world_from_target: Floats
    """(S, 4) measured orientations of the bones that carry the stations."""
    precision: Floats
    """(2S,) one over the variance; 0 where not measured [1/m^2, 1/rad^2]."""
    twice_scale_squared: Floats
    """(2S,) 2 sL^2 of the Lorentzian; inf for plain squares."""


class MeasurementModel(NamedTuple):
    """Calibration and noise: what turns readings into targets."""

    world_from_tracker: Floats
    """(3, 3) rotation matrix."""
    origin_m: Floats
    """(3,) origin of the tracker frame in the world [m]."""
    bone_from_reading: Floats
    """(S, 4, 4) matrices that take a station's quaternion to that of its bone in the world."""
    precision: Floats
    """(2S,) one over the variance of readings that are fully trusted."""
    twice_scale_squared: Floats
    """(2S,) 2 sL^2 of the Lorentzian; inf for plain squares."""
    by_quality: bool
    """Whether a reading's quality scales its precision."""
    suspect_weight: float
    """Factor on the precision of a suspect reading."""


@compiled
def update_targets(
    model: MeasurementModel, targets: StationTargets, readings: Readings, measured: Bools, confidence: Floats
) -> None:
    """Take a frame's readings (S, 3), (S, 4) into the world and onto the bones.

    Fills in `targets`, `measured` (2S,), and `confidence` (2S,), which is 0 where not measured. Targets that were not
    measured are zero and identity.
    """
    position_m, tracker_from_station, position_valid, orientation_valid, quality, suspect = readings
    count = len(position_m)
    for s in range(count):
        weight = quality[s] if model.by_quality else 1.0
        weight *= model.suspect_weight if suspect[s] else 1.0
        measured[s], measured[count + s] = position_valid[s], orientation_valid[s]
        confidence[s], confidence[count + s] = weight * position_valid[s], weight * orientation_valid[s]
        targets.target_m[s] = 0.0
        targets.world_from_target[s] = 0.0
        targets.world_from_target[s, 0] = 1.0
        if position_valid[s]:
            targets.target_m[s] = model.origin_m
            for i in range(3):
                for j in range(3):
                    targets.target_m[s, i] += model.world_from_tracker[i, j] * position_m[s, j]
        if orientation_valid[s]:
            targets.world_from_target[s] = 0.0
            for i in range(4):
                for j in range(4):
                    targets.world_from_target[s, i] += model.bone_from_reading[s, i, j] * tracker_from_station[s, j]
    for row in range(2 * count):
        targets.precision[row] = model.precision[row] * confidence[row]
        targets.twice_scale_squared[row] = model.twice_scale_squared[row]


@compiled
def evaluate(tree: KinematicTree, targets: StationTargets, state: KinematicState, qpos: Floats) -> float:
    """The data cost of a configuration (V + 1,); fills in `state` but for its Jacobian."""
    forward_kinematics(tree, state, qpos)
    count, cost = len(tree.station_body), 0.0
    for s in range(count):
        state.error[s] = targets.target_m[s] - state.station_m[s]
        q = state.world_from_body[tree.station_body[s]]
        off = quaternion_product(as_tuple(targets.world_from_target[s]), (q[0], -q[1], -q[2], -q[3]))
        state.error[count + s] = rotation_vector(off)
    for row in range(2 * count):
        error, precision, scale = state.error[row], targets.precision[row], targets.twice_scale_squared[row]
        squared = error[0] ** 2 + error[1] ** 2 + error[2] ** 2
        state.squared[row], state.weight[row] = squared, precision
        if np.isinf(scale):
            cost += 0.5 * precision * squared
        else:
            cost += 0.5 * precision * scale * np.log1p(squared / scale)
            state.weight[row] = precision / (1.0 + squared / scale)
    return cost


@compiled
def normal_rows(tree: KinematicTree, state: KinematicState, rows: Floats, descent: Floats) -> None:
    """Fill in the Gauss-Newton matrix as rows (V, D), and the descent (V,).

    The descent, minus the gradient of the cost, is exact. The matrix holds the Lorentzian's weights fixed. Each station
    adds J^T W J over the chain of directions that move it. The chain is walked by depth, so J of all ancestors lies
    together in memory, and row i of the sum needs columns 0 to d of J only.
    """
    rows[:], descent[:] = 0.0, 0.0
    count = len(tree.station_body)
    m0, m1, m2, t0, t1, t2 = _jacobian_rows(state.jacobian)
    for s in range(count):
        linear, angular = state.weight[s], state.weight[count + s]
        if linear == 0.0 and angular == 0.0:
            continue
        station_jacobian(tree, state, s)
        offset, turn = state.error[s], state.error[count + s]
        for d in range(tree.depth[tree.station_dof[s]] + 1):
            i = tree.ancestors[tree.station_dof[s], d]
            a0, a1, a2 = linear * m0[d], linear * m1[d], linear * m2[d]
            b0, b1, b2 = angular * t0[d], angular * t1[d], angular * t2[d]
            descent[i] += a0 * offset[0] + a1 * offset[1] + a2 * offset[2] + b0 * turn[0] + b1 * turn[1] + b2 * turn[2]
            row = rows[i]
            for e in range(d + 1):
                row[e] += a0 * m0[e] + a1 * m1[e] + a2 * m2[e]
                row[e] += b0 * t0[e] + b1 * t1[e] + b2 * t2[e]


@compiled
def add_curvature(tree: KinematicTree, state: KinematicState, rows: Floats) -> None:
    """Add to rows (V, D) the second-order term that Gauss-Newton leaves out.

    A hinge j rotates the Jacobian column J_i of everything beyond it: the derivative of J_i by q_j is a_j x J_i where i
    lies beyond j, and half of that between the axes of orientations. Trackers determine a pose so stiffly against so
    weak a prior that this term outweighs the prior as soon as residuals reach 1 mm.
    """
    count, jacobian = len(tree.station_body), state.jacobian
    _, _, _, t0, t1, t2 = _jacobian_rows(jacobian)
    for s in range(count):
        linear, angular = state.weight[s], 0.5 * state.weight[count + s]
        if linear == 0.0 and angular == 0.0:
            continue
        station_jacobian(tree, state, s)
        offset, turn = state.error[s], state.error[count + s]
        wrench = (
            *(linear * offset[0], linear * offset[1], linear * offset[2]),
            *(angular * turn[0], angular * turn[1], angular * turn[2]),
        )
        # -w . (a_e x J_d) = a_e . (w x J_d): one cross product for each d serves all of its ancestors e. Translations
        # (depths 0 to 2) have no axis and add nothing.
        for d in range(3, tree.depth[tree.station_dof[s]] + 1):
            x, y, z = _wrench_cross(wrench, jacobian, d)
            row = rows[tree.ancestors[tree.station_dof[s], d]]
            if d >= 6:
                for e in range(3, d + 1):
                    row[e] += x * t0[e] + y * t1[e] + z * t2[e]
                continue
            for e in range(3, d + 1):  # the root turns about three axes at once: the mean of both orders
                x1, y1, z1 = _wrench_cross(wrench, jacobian, e)
                forth = x * t0[e] + y * t1[e] + z * t2[e]
                row[e] += 0.5 * (forth + x1 * t0[d] + y1 * t1[d] + z1 * t2[d])


@compiled
def _jacobian_rows(jacobian: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """The six rows (D,) as arrays of their own, over which inner loops vectorise."""
    return jacobian[0], jacobian[1], jacobian[2], jacobian[3], jacobian[4], jacobian[5]


@compiled
def _wrench_cross(wrench: Wrench, jacobian: Floats, d: int) -> Vector:
    """Force x linear velocity plus torque x angular velocity of the direction at depth d."""
    p0, p1, p2, u0, u1, u2 = wrench
    m0, m1, m2, t0, t1, t2 = (
        *(jacobian[0, d], jacobian[1, d], jacobian[2, d]),
        *(jacobian[3, d], jacobian[4, d], jacobian[5, d]),
    )
    return (
        p1 * m2 - p2 * m1 + u1 * t2 - u2 * t1,
        p2 * m0 - p0 * m2 + u2 * t0 - u0 * t2,
        p0 * m1 - p1 * m0 + u0 * t1 - u1 * t0,
    )
