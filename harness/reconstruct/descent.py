"""The inner loop of the solvers, compiled: residuals of stations, their slopes, and steps within limits or a space.

A hinge moves only what lies beyond it, so the normal equations of trackers couple two hinges only when one lies
beyond the other. Eliminated from the limbs inwards, such a matrix fills nowhere else (Featherstone 2008, ch. 8.3). So
row i of such a matrix (V, D) holds what couples direction i with those inwards of it, by their depth, and with itself
last: two rows agree about where they begin, and a step for 54 degrees of freedom costs a few microseconds. `residuals`,
`solver` and `subspace` say what is minimised. All of it stands in one file because compiled functions call only those
of their own (`core.compiled`).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from harness.body.humanoid import Body
from harness.core.arrays import Bools, Floats, Ints
from harness.core.compiled import compiled

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Wrench = tuple[float, float, float, float, float, float]


class KinematicTree(NamedTuple):
    """B bodies, parents first and the root first of all; their V = 6 + hinges directions; S stations on them."""

    parent: Ints
    """(B,)"""
    joint_m: Floats
    """(B, 3) where each joint lies in its parent's frame."""
    first_dof: Ints
    """(B + 1,) where each body's run of hinges begins among the V."""
    axis: Floats
    """(V, 3) of hinges, in the body's frame; rows 0 to 5, the root's, mean nothing."""
    dof_body: Ints
    """(V,) that each direction moves."""
    depth: Ints
    """(V,) how many directions lie inwards of each."""
    ancestors: Ints
    """(V, D) which those are, by their depth, and then the direction itself."""
    station_body: Ints
    """(S,)"""
    station_dof: Ints
    """(S,) the outermost direction that moves each station."""
    mount_m: Floats
    """(S, 3)"""


class StationTargets(NamedTuple):
    """What one frame asks for: rows are S positions, then S orientations."""

    target_m: Floats
    """(S, 3)"""
    world_from_target: Floats
    """(S, 4)"""
    precision: Floats
    """(2S,) one over variance, 0 where not measured."""
    twice_scale_squared: Floats
    """(2S,) of the Lorentzian; inf for plain squares."""


class MeasurementModel(NamedTuple):
    """How readings become targets."""

    world_from_tracker: Floats
    """(3, 3) `world_from_tracker`."""
    origin_m: Floats
    """(3,)"""
    bone_from_reading: Floats
    """(S, 4, 4) from a station's quaternion to that of its bone in the world."""
    precision: Floats
    """(2S,) of readings that are fully trusted: one over variance."""
    twice_scale_squared: Floats
    """(2S,) of the Lorentzian; inf for plain squares."""
    by_quality: bool
    """Whether quality says how far to trust a reading."""
    suspect_weight: float
    """What a suspect reading counts beside that."""


class KinematicState(NamedTuple):
    """Where a configuration puts the body."""

    body_m: Floats
    """(B, 3)"""
    world_from_body: Floats
    """(B, 4)"""
    axis: Floats
    """(V, 3) of turning, in the world."""
    station_m: Floats
    """(S, 3)"""
    error: Floats
    """(2S, 3) target minus station [m]; rotation vector from station to target [rad]."""
    squared: Floats
    """(2S,) of the errors' lengths."""
    weight: Floats
    """(2S,) precision as the Lorentzian leaves it."""
    jacobian: Floats
    """(6, D) of the station at hand by directions of each depth: how it moves, then how it turns."""


def build_tree(body: Body, bones: Sequence[int], mount_m: Floats) -> KinematicTree:
    """Of a body, with stations on these bones (S,) at `mount_m` (S, 3)."""
    model, stations = body.model, body.bone_body_ids[np.asarray(bones)]
    hinges = np.array(model.body_dofnum[1:])
    hinges[0] = 6
    depth = np.zeros(model.nv, dtype=np.int64)
    for direction, before in enumerate(model.dof_parentid):
        depth[direction] = depth[before] + 1 if before >= 0 else 0
    inwards = np.zeros((model.nv, depth.max() + 1), dtype=np.int64)
    for direction, before in enumerate(model.dof_parentid):
        inwards[direction] = inwards[before]
        inwards[direction, depth[direction]] = direction
    last = []
    for station in stations:
        while model.body_dofnum[station] == 0:
            station = model.body_parentid[station]
        last.append(model.body_dofadr[station] + model.body_dofnum[station] - 1)
    return KinematicTree(
        parent=np.array(model.body_parentid[1:] - 1, dtype=np.int64),
        joint_m=np.array(model.body_pos[1:]),
        first_dof=np.concatenate([[6], np.cumsum(hinges)]),
        axis=np.concatenate([np.zeros((6, 3)), model.jnt_axis[1:]]),
        dof_body=np.array(model.dof_bodyid - 1, dtype=np.int64),
        depth=depth,
        ancestors=inwards,
        station_body=stations - 1,
        station_dof=np.array(last, dtype=np.int64),
        mount_m=np.array(mount_m, dtype=float),
    )


def new_state(chain: KinematicTree) -> KinematicState:
    """Arrays for one session."""
    bodies, directions, stations = len(chain.parent), len(chain.depth), len(chain.station_body)
    return KinematicState(
        body_m=np.zeros((bodies, 3)),
        world_from_body=np.zeros((bodies, 4)),
        axis=np.zeros((directions, 3)),
        station_m=np.zeros((stations, 3)),
        error=np.zeros((2 * stations, 3)),
        squared=np.zeros(2 * stations),
        weight=np.zeros(2 * stations),
        jacobian=np.zeros((6, chain.ancestors.shape[1])),
    )


@compiled
def update_targets(
    tracker: MeasurementModel,
    readings: StationTargets,
    position_m: Floats,
    turned: Floats,
    position_valid: Bools,
    orientation_valid: Bools,
    quality: Floats,
    suspect: Bools,
    measured: Bools,
    trust: Floats,
) -> None:
    """Brings a frame's readings (S, 3), (S, 4) into the world and onto the bones.

    Says which are `measured` (2S,), and how much they are to be trusted (2S,), 0 where not measured. Zero and identity
    stand there.
    """
    count = len(position_m)
    for s in range(count):
        said = quality[s] if tracker.by_quality else 1.0
        said *= tracker.suspect_weight if suspect[s] else 1.0
        measured[s], measured[count + s] = position_valid[s], orientation_valid[s]
        trust[s], trust[count + s] = said * position_valid[s], said * orientation_valid[s]
        readings.target_m[s] = 0.0
        readings.world_from_target[s] = 0.0
        readings.world_from_target[s, 0] = 1.0
        if position_valid[s]:
            readings.target_m[s] = tracker.origin_m
            for i in range(3):
                for j in range(3):
                    readings.target_m[s, i] += tracker.world_from_tracker[i, j] * position_m[s, j]
        if orientation_valid[s]:
            readings.world_from_target[s] = 0.0
            for i in range(4):
                for j in range(4):
                    readings.world_from_target[s, i] += tracker.bone_from_reading[s, i, j] * turned[s, j]
    for row in range(2 * count):
        readings.precision[row] = tracker.precision[row] * trust[row]
        readings.twice_scale_squared[row] = tracker.twice_scale_squared[row]


@compiled
def forward_kinematics(chain: KinematicTree, placed: KinematicState, qpos: Floats) -> None:
    """Forward kinematics of a configuration (V + 1,)."""
    at_m, turned, axis = placed.body_m, placed.world_from_body, placed.axis
    length = np.sqrt(qpos[3] ** 2 + qpos[4] ** 2 + qpos[5] ** 2 + qpos[6] ** 2)
    for i in range(3):
        at_m[0, i] = qpos[i]
    for i in range(4):
        turned[0, i] = qpos[3 + i] / length
    q = as_tuple(turned[0])
    axis[3], axis[4], axis[5] = rotate(q, 1.0, 0.0, 0.0), rotate(q, 0.0, 1.0, 0.0), rotate(q, 0.0, 0.0, 1.0)
    for body in range(1, len(chain.parent)):
        parent, start = chain.parent[body], chain.joint_m[body]
        q = as_tuple(turned[parent])
        x, y, z = rotate(q, start[0], start[1], start[2])
        at_m[body, 0], at_m[body, 1], at_m[body, 2] = at_m[parent, 0] + x, at_m[parent, 1] + y, at_m[parent, 2] + z
        for hinge in range(chain.first_dof[body], chain.first_dof[body + 1]):
            own, half = chain.axis[hinge], 0.5 * qpos[hinge + 1]
            axis[hinge, 0], axis[hinge, 1], axis[hinge, 2] = rotate(q, own[0], own[1], own[2])
            sine = np.sin(half)
            q = quaternion_product(q, np.cos(half), sine * own[0], sine * own[1], sine * own[2])
        turned[body, 0], turned[body, 1], turned[body, 2], turned[body, 3] = q
    for s in range(len(chain.station_body)):
        body, mount = chain.station_body[s], chain.mount_m[s]
        x, y, z = rotate(as_tuple(turned[body]), mount[0], mount[1], mount[2])
        placed.station_m[s] = at_m[body, 0] + x, at_m[body, 1] + y, at_m[body, 2] + z


@compiled
def forward_kinematics_batch(
    chain: KinematicTree, placed: KinematicState, qpos: Floats, station_m: Floats, turned: Floats
) -> None:
    """The same of many (T, V + 1): their stations (T, S, 3) and the orientations of the bones under them (T, S, 4)."""
    for t in range(len(qpos)):
        forward_kinematics(chain, placed, qpos[t])
        station_m[t] = placed.station_m
        for s in range(len(chain.station_body)):
            turned[t, s] = placed.world_from_body[chain.station_body[s]]


@compiled
def evaluate(chain: KinematicTree, readings: StationTargets, placed: KinematicState, qpos: Floats) -> float:
    """Stands the body, then errors and weights; the data cost."""
    forward_kinematics(chain, placed, qpos)
    count, cost = len(chain.station_body), 0.0
    for s in range(count):
        placed.error[s] = readings.target_m[s] - placed.station_m[s]
        q = placed.world_from_body[chain.station_body[s]]
        placed.error[count + s] = rotation_vector(
            *quaternion_product(as_tuple(readings.world_from_target[s]), q[0], -q[1], -q[2], -q[3])
        )
    for row in range(2 * count):
        error, precision, scale = placed.error[row], readings.precision[row], readings.twice_scale_squared[row]
        squared = error[0] ** 2 + error[1] ** 2 + error[2] ** 2
        placed.squared[row], placed.weight[row] = squared, precision
        if np.isinf(scale):
            cost += 0.5 * precision * squared
        else:
            cost += 0.5 * precision * scale * np.log1p(squared / scale)
            placed.weight[row] = precision / (1.0 + squared / scale)
    return cost


@compiled
def normal_equations(
    chain: KinematicTree, placed: KinematicState, hessian: Floats, descent: Floats, bent: bool = False
) -> None:
    """Gauss and Newton's matrix (V, V), lower triangle, zero elsewhere, the curvature added if asked; the descent."""
    rows = np.empty(chain.ancestors.shape)
    normal_rows(chain, placed, rows, descent)
    if bent:
        add_curvature(chain, placed, rows)
    hessian[:] = 0.0
    for i in range(len(rows)):
        for d in range(chain.depth[i] + 1):
            hessian[i, chain.ancestors[i, d]] = rows[i, d]


@compiled
def normal_rows(chain: KinematicTree, placed: KinematicState, rows: Floats, descent: Floats) -> None:
    """The same as rows (V, D)."""
    rows[:], descent[:] = 0.0, 0.0
    count = len(chain.station_body)
    m0, m1, m2, t0, t1, t2 = _jacobian_rows(placed.jacobian)
    for s in range(count):
        moving, turning = placed.weight[s], placed.weight[count + s]
        if moving == 0.0 and turning == 0.0:
            continue
        _station_jacobian(chain, placed, s)
        off, twist = placed.error[s], placed.error[count + s]
        for d in range(chain.depth[chain.station_dof[s]] + 1):
            i = chain.ancestors[chain.station_dof[s], d]
            a0, a1, a2 = moving * m0[d], moving * m1[d], moving * m2[d]
            b0, b1, b2 = turning * t0[d], turning * t1[d], turning * t2[d]
            descent[i] += a0 * off[0] + a1 * off[1] + a2 * off[2] + b0 * twist[0] + b1 * twist[1] + b2 * twist[2]
            row = rows[i]
            for e in range(d + 1):
                row[e] += a0 * m0[e] + a1 * m1[e] + a2 * m2[e]
                row[e] += b0 * t0[e] + b1 * t1[e] + b2 * t2[e]


@compiled
def add_curvature(chain: KinematicTree, placed: KinematicState, rows: Floats) -> None:
    """Adds to rows (V, D) what Gauss and Newton leave out.

    A hinge j turns the slope J_i of everything beyond it: the derivative of J_i by q_j is a_j x J_i where i lies
    beyond j, half of it between axes of orientations. Trackers pin a pose so stiffly against so weak a prior that
    this term outweighs the prior as soon as residuals reach 1 mm.
    """
    count, slope = len(chain.station_body), placed.jacobian
    _, _, _, t0, t1, t2 = _jacobian_rows(slope)
    for s in range(count):
        moving, turning = placed.weight[s], 0.5 * placed.weight[count + s]
        if moving == 0.0 and turning == 0.0:
            continue
        _station_jacobian(chain, placed, s)
        off, twist = placed.error[s], placed.error[count + s]
        pull = (
            *(moving * off[0], moving * off[1], moving * off[2]),
            *(turning * twist[0], turning * twist[1], turning * twist[2]),
        )
        for d in range(3, chain.depth[chain.station_dof[s]] + 1):
            x, y, z = _wrench_cross(pull, slope, d)
            row = rows[chain.ancestors[chain.station_dof[s], d]]
            if d >= 6:
                for e in range(3, d + 1):
                    row[e] += x * t0[e] + y * t1[e] + z * t2[e]
                continue
            for e in range(3, d + 1):  # the root turns all three ways at once: the mean of both orders
                x1, y1, z1 = _wrench_cross(pull, slope, e)
                here = x * t0[e] + y * t1[e] + z * t2[e]
                row[e] += 0.5 * (here + x1 * t0[d] + y1 * t1[d] + z1 * t2[d])


@compiled
def _jacobian_rows(slope: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    return slope[0], slope[1], slope[2], slope[3], slope[4], slope[5]


@compiled
def _wrench_cross(pull: Wrench, slope: Floats, d: int) -> Vector:
    """What moves times how a station moves by the direction of a depth, plus what turns times how it turns."""
    p0, p1, p2, u0, u1, u2 = pull
    m0, m1, m2, t0, t1, t2 = slope[0, d], slope[1, d], slope[2, d], slope[3, d], slope[4, d], slope[5, d]
    return (
        p1 * m2 - p2 * m1 + u1 * t2 - u2 * t1,
        p2 * m0 - p0 * m2 + u2 * t0 - u0 * t2,
        p0 * m1 - p1 * m0 + u0 * t1 - u1 * t0,
    )


@compiled
def _station_jacobian(chain: KinematicTree, placed: KinematicState, station: int) -> None:
    """How the station moves and turns by every direction that moves it."""
    slope, at, last = placed.jacobian, placed.station_m[station], chain.station_dof[station]
    slope[:, :3] = 0.0
    slope[0, 0] = slope[1, 1] = slope[2, 2] = 1.0
    for d in range(3, chain.depth[last] + 1):
        i = chain.ancestors[last, d]
        a, start = placed.axis[i], placed.body_m[chain.dof_body[i]]
        x, y, z = at[0] - start[0], at[1] - start[1], at[2] - start[2]
        slope[0, d], slope[1, d], slope[2, d] = a[1] * z - a[2] * y, a[2] * x - a[0] * z, a[0] * y - a[1] * x
        slope[3, d], slope[4, d], slope[5, d] = a[0], a[1], a[2]


class QuadraticModel(NamedTuple):
    """A quadratic model g x + 1/2 x H x of one step x (V,), low <= x <= high, and what finding its minimum takes."""

    hessian: Floats
    """(V, D) Gauss and Newton's with prior and damping."""
    full_hessian: Floats
    """(V, D) the same with the full curvature."""
    gradient: Floats
    low: Floats
    high: Floats
    step: Floats
    """The minimum."""
    to_mean: Floats
    """From the configuration to the prior's mean."""
    next_qpos: Floats
    """(V + 1,) the configuration after the step."""
    factor: Floats
    """(V, D)"""
    clamped: Bools
    """Which lie at a bound."""
    residual_gradient: Floats
    direction: Floats
    trial: Floats
    change: Floats
    hessian_change: Floats


def new_quadratic_model(chain: KinematicTree) -> QuadraticModel:
    """Arrays for one solver."""
    directions = len(chain.depth)
    gradient, step, away, slope, toward, there, gone, bend = np.zeros((8, directions))
    hessian, bent, factor = np.zeros((3, *chain.ancestors.shape))
    return QuadraticModel(
        hessian,
        bent,
        gradient,
        np.full(directions, -np.inf),
        np.full(directions, np.inf),
        step,
        away,
        np.zeros(directions + 1),
        factor,
        np.zeros(directions, bool),
        slope,
        toward,
        there,
        gone,
        bend,
    )


class PriorAndLimits(NamedTuple):
    """A Gaussian prior, the hinges' limits, and when to stop."""

    mean: Floats
    """(V + 1,)"""
    precision: Floats
    """(V,)"""
    low_rad: Floats
    """(V - 6,)"""
    high_rad: Floats
    step: float
    decrease: float
    most_steps: int


_INITIAL_DAMPING, DAMPING_INCREASE, DAMPING_DECREASE = 0.3, 10.0, 3.0
_MAX_CONVERGED_DAMPING = 30.0
"""Damping that still lets a step go where it wants: as a prior, 10 deg about the present pose [1/rad^2]."""
_GOOD_GAIN_RATIO, _FAIR_GAIN_RATIO = 0.9, 0.5
"""Shares of a step's promise kept: the plain model will do from the one, damping may fall from the other."""
_MAX_STEP_RAD = 1.0
_MAX_FINAL_STEP = 1e-2
"""A step that promises next to nothing is still taken when it is no larger [m, rad]."""
_MIN_DECREASE = 1e-12
"""A promise, as a log likelihood, that rounding makes."""


@compiled
def minimise(
    chain: KinematicTree,
    readings: StationTargets,
    placed: KinematicState,
    model: QuadraticModel,
    trust: PriorAndLimits,
    qpos: Floats,
) -> tuple[float, int, bool]:
    """Takes a configuration (V + 1,) downhill, in place: the cost before the last step, the steps, if it converged.

    -1 steps when the normal equations are not positive definite, which takes a reading that is not finite.
    """
    for i in range(7, len(qpos)):
        qpos[i] = min(max(qpos[i], trust.low_rad[i - 7]), trust.high_rad[i - 7])
    hessian, gradient, step, moved = model.hessian, model.gradient, model.step, model.next_qpos
    cost = evaluate(chain, readings, placed, qpos) + _prior_cost(trust, qpos, model.to_mean)
    damping, kept, fresh = _INITIAL_DAMPING, 1.0, False
    for steps in range(1, trust.most_steps + 1):
        if not fresh:
            normal_rows(chain, placed, hessian, gradient)
            for i in range(len(step)):
                gradient[i] = -gradient[i] - trust.precision[i] * model.to_mean[i]
                hessian[i, chain.depth[i]] += trust.precision[i] + damping
            for i in range(6, len(step)):
                model.low[i] = min(trust.low_rad[i - 6] - qpos[i + 1], 0.0)
                model.high[i] = max(trust.high_rad[i - 6] - qpos[i + 1], 0.0)
            fresh = True
        solved = False
        if kept < _GOOD_GAIN_RATIO:
            model.full_hessian[:] = hessian
            add_curvature(chain, placed, model.full_hessian)
            solved = solve_box_qp(chain, model, model.full_hessian)
        if not solved and not solve_box_qp(chain, model, hessian):
            return cost, -1, False
        promised, longest = -0.5 * dot(gradient, step), np.abs(step).max()
        if longest > _MAX_STEP_RAD:
            step[3:] *= min(1.0, _MAX_STEP_RAD / np.abs(step[3:]).max())
        _integrate(qpos, step, moved)
        if damping <= _MAX_CONVERGED_DAMPING and (longest < trust.step or promised < trust.decrease):
            if longest < _MAX_FINAL_STEP:
                qpos[:] = moved
            return cost, steps, True
        new_cost = evaluate(chain, readings, placed, moved) + _prior_cost(trust, moved, model.to_mean)
        kept = (cost - new_cost) / promised
        if new_cost < cost:
            qpos[:] = moved
            cost, fresh = new_cost, False
            damping = max(_INITIAL_DAMPING, damping / DAMPING_DECREASE) if kept > _FAIR_GAIN_RATIO else damping
            if cost < trust.decrease:
                return cost, steps, True
        else:
            evaluate(chain, readings, placed, qpos)
            more = max(DAMPING_INCREASE, damping * DAMPING_INCREASE)
            for i in range(len(step)):
                hessian[i, chain.depth[i]] += more - damping
            damping = more
    return cost, trust.most_steps, False


@compiled
def _prior_cost(trust: PriorAndLimits, qpos: Floats, away: Floats) -> float:
    """Fills in the tangent step from a configuration to the prior's mean."""
    mean, q, cost = trust.mean, qpos[3:7], 0.0
    away[:3] = mean[:3] - qpos[:3]
    w, x, y, z = mean[3], mean[4], mean[5], mean[6]
    away[3], away[4], away[5] = rotation_vector(*quaternion_product((q[0], -q[1], -q[2], -q[3]), w, x, y, z))
    away[6:] = mean[7:] - qpos[7:]
    for i in range(len(away)):
        cost += 0.5 * trust.precision[i] * away[i] ** 2
    return cost


@compiled
def _integrate(qpos: Floats, step: Floats, moved: Floats) -> None:
    """The configuration one tangent step on: root translation in world axes, root turn in its own, hinges."""
    moved[:3] = qpos[:3] + step[:3]
    angle = np.sqrt(step[3] ** 2 + step[4] ** 2 + step[5] ** 2)
    sine = np.sin(0.5 * angle) / angle if angle > 0.0 else 0.5
    turned = quaternion_product(
        as_tuple(qpos[3:7]), np.cos(0.5 * angle), sine * step[3], sine * step[4], sine * step[5]
    )
    moved[3], moved[4], moved[5], moved[6] = turned
    moved[3:7] /= np.sqrt(dot(moved[3:7], moved[3:7]))
    moved[7:] = qpos[7:] + step[6:]


@compiled
def solve_box_qp(chain: KinematicTree, model: QuadraticModel, hessian: Floats) -> bool:
    """Fills in `model.step` by projected Newton steps (Tassa et al. 2014); 0 must lie within the bounds.

    False unless H is positive definite on the directions that the bounds leave free.
    """
    x, slope, toward, there, gone, bend = (
        *(model.step, model.residual_gradient, model.direction),
        *(model.trial, model.change, model.hessian_change),
    )
    x[:] = 0.0
    slope[:] = model.gradient
    whole = False
    for attempt in range(100):
        changed = attempt == 0
        for i in range(len(x)):
            clamped = (x[i] <= model.low[i] and slope[i] > 0.0) or (x[i] >= model.high[i] and slope[i] < 0.0)
            changed = changed or clamped != model.clamped[i]
            model.clamped[i] = clamped
            toward[i] = 0.0 if clamped else -slope[i]
        if whole and not changed:
            return True
        if changed and not _factorise(chain, hessian, model.clamped, model.factor):
            return False
        _solve_factorised(chain, model.factor, toward)
        if not dot(slope, toward) < -_MIN_DECREASE:
            return True
        share, bound = 1.0, 0
        while True:
            whole, bound, promised = share == 1.0, 0, 0.0
            for i in range(len(x)):
                free = x[i] + share * toward[i]
                there[i] = min(max(free, model.low[i]), model.high[i])
                whole = whole and there[i] == free
                bound += model.clamped[i]
                gone[i] = there[i] - x[i]
                promised += slope[i] * gone[i]
            if whole and bound == 0:
                x[:] = there
                return True
            _multiply_symmetric(chain, hessian, gone, bend)
            if whole or promised + 0.5 * dot(gone, bend) <= 0.1 * promised or share < 1e-9:
                break
            share *= 0.5
        for i in range(len(x)):
            x[i] = there[i]
            slope[i] += bend[i]
    return True


@compiled
def _factorise(chain: KinematicTree, hessian: Floats, clamped: Bools, factor: Floats) -> bool:
    """L^T D L of the free directions, D last in each row; False unless positive definite (Featherstone 2008, 6.5)."""
    for k in range(len(factor)):
        for d in range(chain.depth[k] + 1):
            factor[k, d] = 0.0 if clamped[k] or clamped[chain.ancestors[k, d]] else hessian[k, d]
        if clamped[k]:
            factor[k, chain.depth[k]] = 1.0
    for k in range(len(factor) - 1, -1, -1):
        row, depth = factor[k], chain.depth[k]
        if not row[depth] > 0.0:
            return False
        for d in range(depth - 1, -1, -1):
            share = row[d] / row[depth]
            if share != 0.0:
                other = factor[chain.ancestors[k, d]]
                for e in range(d + 1):
                    other[e] -= share * row[e]
                row[d] = share
    return True


@compiled
def _solve_factorised(chain: KinematicTree, factor: Floats, x: Floats) -> None:
    """x := (L^T D L)^-1 x"""
    for k in range(len(x) - 1, -1, -1):
        for d in range(chain.depth[k]):
            x[chain.ancestors[k, d]] -= factor[k, d] * x[k]
    for k in range(len(x)):
        x[k] /= factor[k, chain.depth[k]]
        for d in range(chain.depth[k]):
            x[k] -= factor[k, d] * x[chain.ancestors[k, d]]


@compiled
def _multiply_symmetric(chain: KinematicTree, hessian: Floats, x: Floats, out: Floats) -> None:
    """H x."""
    for k in range(len(x)):
        out[k] = hessian[k, chain.depth[k]] * x[k]
        for d in range(chain.depth[k]):
            i = chain.ancestors[k, d]
            out[k] += hessian[k, d] * x[i]
            out[i] += hessian[k, d] * x[k]


@compiled
def dot(a: Floats, b: Floats) -> float:
    total = 0.0
    for i in range(len(a)):
        total += a[i] * b[i]
    return total


@compiled
def as_tuple(q: Floats) -> Quaternion:
    return q[0], q[1], q[2], q[3]


@compiled
def quaternion_product(q: Quaternion, w: float, x: float, y: float, z: float) -> Quaternion:
    """The product of two quaternions."""
    return (
        q[0] * w - q[1] * x - q[2] * y - q[3] * z,
        q[0] * x + q[1] * w + q[2] * z - q[3] * y,
        q[0] * y - q[1] * z + q[2] * w + q[3] * x,
        q[0] * z + q[1] * y - q[2] * x + q[3] * w,
    )


@compiled
def rotate(q: Quaternion, x: float, y: float, z: float) -> Vector:
    """A vector turned by a unit quaternion."""
    u, v, w = q[2] * z - q[3] * y, q[3] * x - q[1] * z, q[1] * y - q[2] * x
    return (
        x + 2.0 * (q[0] * u + q[2] * w - q[3] * v),
        y + 2.0 * (q[0] * v + q[3] * u - q[1] * w),
        z + 2.0 * (q[0] * w + q[1] * v - q[2] * u),
    )


@compiled
def rotation_vector(w: float, x: float, y: float, z: float) -> Vector:
    """`rotations.log` of one quaternion, the short way round."""
    sine = np.sqrt(x * x + y * y + z * z) + 1e-12
    factor = np.arctan2(sine, abs(w)) / sine * (2.0 if w >= 0.0 else -2.0)
    return factor * x, factor * y, factor * z


class Subspace(NamedTuple):
    """Postures near p, P numbers each, that leave it by nothing along N, at a cost of 1/2 a^T A a - b^T a for leaving
    it by a. `subspace.spanned` makes it: touch that file when fields change here, for compiled code is kept by file."""

    mean: Floats
    """(P,) p."""
    normals: Floats
    """(D, P) N, orthonormal."""
    curvature: Floats
    """(P, P) A, and a stiff spring along N."""
    linear: Floats
    """(P,) b."""
    spring: Floats
    """(P,) what of the diagonal of A is the spring's."""


_INITIAL_SUBSPACE_DAMPING, _MIN_DIAGONAL = 1e-3, 1e-6
"""Of the first step among the postures of a space; what keeps a step of 0 where nothing was read about the ground."""


@compiled
def minimise_in_subspace(
    chain: KinematicTree,
    readings: StationTargets,
    placed: KinematicState,
    space: Subspace,
    stop: tuple[float, float, int],
    z: Floats,
) -> tuple[Floats, float, int, bool]:
    """Levenberg and Marquardt's method among the postures of a space, from a ground frame and a posture z (3 + P,).

    `stop` is step, decrease, and most steps (`solver.Stopping`). The configuration (V + 1,), its cost, the steps,
    whether it converged; -1 steps as for `minimise`.
    """
    directions = len(chain.depth)
    hessian, descent = np.zeros((directions, directions)), np.empty(directions)
    normal, gradient = np.empty((len(z), len(z))), np.empty(len(z))
    z[3:] = project_posture(space, z[3:])
    qpos = qpos_from_posture(z[3:], z[:3])
    cost = evaluate(chain, readings, placed, qpos) + subspace_cost(space, z[3:])
    damping = _INITIAL_SUBSPACE_DAMPING
    for steps in range(1, stop[2] + 1):
        normal_equations(chain, placed, hessian, descent)
        to_subspace(space, z, hessian, descent, normal, gradient)
        while True:
            step = solve_damped(space, normal, gradient, damping)
            longest = np.abs(step).max()
            if not np.isfinite(longest):
                return qpos, cost, -1, False
            there = z + step
            moved = qpos_from_posture(there[3:], there[:3])
            new_cost = evaluate(chain, readings, placed, moved) + subspace_cost(space, there[3:])
            if new_cost <= cost or longest < stop[0]:
                break
            damping *= DAMPING_INCREASE
        converged = longest < stop[0] or cost - new_cost < stop[1]
        if new_cost <= cost:
            z, qpos, cost, damping = there, moved, new_cost, damping / DAMPING_DECREASE
        if converged:
            return qpos, cost, steps, True
    return qpos, cost, stop[2], False


@compiled
def project_posture(space: Subspace, posture: Floats) -> Floats:
    """The posture (P,) of the space that is nearest to one."""
    out: Floats = posture - np.dot(np.dot(space.normals, posture - space.mean), space.normals)
    return out


@compiled
def subspace_cost(space: Subspace, posture: Floats) -> float:
    """Of a posture (P,)."""
    away = posture - space.mean
    return dot(away, 0.5 * np.dot(space.curvature, away) - space.linear)


@compiled
def qpos_from_posture(posture: Floats, ground: Floats) -> Floats:
    """The configuration (P + 3,) of a posture (P,), height, tilt and hinges, on a ground frame (3,)."""
    out = np.empty(len(posture) + 3)
    out[0], out[1], out[2] = ground[0], ground[1], posture[0]
    angle = np.sqrt(posture[1] ** 2 + posture[2] ** 2 + posture[3] ** 2)
    share = np.sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    w, x, y, z = np.cos(0.5 * angle), share * posture[1], share * posture[2], share * posture[3]
    c, s = np.cos(0.5 * ground[2]), np.sin(0.5 * ground[2])
    out[3], out[4], out[5], out[6] = c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w
    out[7:] = posture[4:]
    return out


@compiled
def _root_jacobian(z: Floats) -> Floats:
    """(4, 3) how the root turns, in its own axes, as yaw and tilt (3) do.

    Its turn is about_z(yaw) exp(tilt): yaw turns it about exp(-tilt) z, and tilt by its right Jacobian.
    """
    x, y, up = z[4], z[5], z[6]
    squared = x * x + y * y + up * up
    angle = np.sqrt(squared)
    half, sine, rest = 0.5, 1.0, 1.0 / 6.0
    if angle > 1e-4:
        half = (1.0 - np.cos(angle)) / squared
        sine, rest = np.sin(angle) / angle, (angle - np.sin(angle)) / (squared * angle)
    cross = np.array([[0.0, -up, y], [up, 0.0, -x], [-y, x, 0.0]])
    twice = np.dot(cross, cross)
    out = np.empty((4, 3))
    out[0] = half * twice[2] + sine * cross[2]
    out[0, 2] += 1.0
    out[1:] = np.eye(3) + half * cross + rest * twice
    return out


@compiled
def to_subspace(space: Subspace, z: Floats, hessian: Floats, descent: Floats, normal: Floats, gradient: Floats) -> None:
    """Makes normal equations (3 + P, 3 + P), lower triangle, and descent of z from those of the solver's directions.

    Hinges are the same in both; so are the root's moves, with the height after the yaw. The space's cost is added.
    """
    slope, root, turn, curvature = np.zeros((7, 6)), np.empty((6, 6)), _root_jacobian(z), space.curvature
    slope[0, 0] = slope[1, 1] = slope[3, 2] = 1.0
    slope[2, 3:], slope[4:, 3:] = turn[0], turn[1:]
    for k in range(6):
        for m in range(k + 1):
            root[k, m] = root[m, k] = hessian[k, m]
    normal[:7, :7] = np.dot(np.dot(slope, root), slope.T)
    normal[3:7, 3:7] += curvature[:4, :4]
    for r in range(6, len(hessian)):
        row, was, more = normal[r + 1], hessian[r], curvature[r - 2]
        row[0], row[1], row[3] = was[0], was[1], was[2] + more[0]
        row[2] = turn[0, 0] * was[3] + turn[0, 1] * was[4] + turn[0, 2] * was[5]
        for k in range(1, 4):
            row[3 + k] = turn[k, 0] * was[3] + turn[k, 1] * was[4] + turn[k, 2] * was[5] + more[k]
        for c in range(6, r + 1):
            row[c + 1] = was[c] + more[c - 2]
    gradient[:7] = np.dot(slope, descent[:6])
    gradient[7:] = descent[6:]
    gradient[3:] += space.linear - np.dot(curvature, z[3:] - space.mean)


@compiled
def solve_damped(space: Subspace, normal: Floats, gradient: Floats, damping: float) -> Floats:
    """Levenberg and Marquardt's step (3 + P,) within the space; NaN when the matrix is not positive definite."""
    factor, step = normal.copy(), gradient.copy()
    count = len(step)
    for k in range(count):
        if k >= 3:
            factor[k, k] -= space.spring[k - 3] * (damping / (1.0 + damping))  # the spring is not damped
        factor[k, k] = factor[k, k] * (1.0 + damping) + _MIN_DIAGONAL
    for k in range(count - 1, -1, -1):  # L^T D L, as `_factorise`
        pivot = factor[k]
        if not pivot[k] > 0.0:
            step[:] = np.nan
            return step
        for i in range(k):
            share, row = pivot[i] / pivot[k], factor[i]
            for j in range(i + 1):
                row[j] -= share * pivot[j]
            step[i] -= share * step[k]
    for k in range(count):
        for i in range(k):
            step[k] -= factor[k, i] * step[i]
        step[k] /= factor[k, k]
    step[3:] -= np.dot(np.dot(space.normals, step[3:]), space.normals)
    return step
