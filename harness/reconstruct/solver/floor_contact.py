"""Contact of the feet with the floor, as terms of a Gaussian prior of the posture.

A station on the shin shows where the ankle is, but not how the foot turns. Without such a station nothing shows the
leg. Two facts about the floor say more:

- A toe that is nearly still is in contact and stays there. Its displacement d since the last frame pulls it back with
  the weight 1 / (1 + d^2)^2, where d is in units of a scale (Geman and McClure 1985). Fast toes are free.
- A toe does not sink into the floor. Its depth below it pulls in the same way. Far below, it is on another floor.

Both terms are linearised at the prior's mean. With a station on the shin its measured pose is taken as exact, and the
terms bind the foot's angles alone. A *free* foot has none: its terms bind the whole posture, on the ground frame that
is expected, and only while three stations or more show where the body is.
"""

from typing import NamedTuple

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled, specialise
from harness.core.compiled_rotations import Vector, as_tuple, quaternion_product, rotate
from harness.reconstruct.solver.ground_frame import HINGES, POSTURE_SIZE, qpos_from_posture
from harness.reconstruct.solver.kinematic_tree import (
    KinematicState,
    KinematicTree,
    build_tree,
    forward_kinematics,
    new_state,
    station_jacobian,
)
from harness.reconstruct.solver.normal_equations import StationTargets
from harness.reconstruct.solver.residuals import Residuals
from harness.reconstruct.solver.subspace_minimiser import Subspace, root_motion

FEET = ("lfoot", "rfoot")
"""Bones whose far ends are the toes."""
_SPEED_M_S, _FREE_SPEED_M_S = 0.4, 1.2
"""Standard deviation of a toe's speed in contact, and the scale beyond which it is not in contact; the same of a free
foot, whose speed is less sure."""
_FEWEST_STATIONS = 3
"""Fewest measured positions with which a free foot is bound: one hand does not show where the floor is."""
_DEPTH_SIGMA_M, _DEPTH_SCALE_M = 0.02, 0.1
"""Standard deviation of a toe's depth below the floor, and the scale beyond which the floor is another one."""
_ROOT_DOFS = 6
"""Number of directions of the root, which precede the hinges."""
_POSTURE_OF_DOF = HINGES.start - _ROOT_DOFS
"""Index of a hinge in a posture, less that of its direction."""


def toe_tree(body: Body) -> KinematicTree:
    """The body with a station on each toe."""
    bones = [body.skeleton.index(foot) for foot in FEET]
    return build_tree(body, bones, body.skeleton.bone_m[bones])


class Feet(NamedTuple):
    """The feet, and the stations that show the shins above them."""

    tree: KinematicTree
    """The body with a station on each toe."""
    state: KinematicState
    """Arrays for this body."""
    targets: StationTargets
    mount_m: Floats
    """(S, 3) positions of the stations in their bones' frames [m]."""
    station: Ints
    """(F,) station on the shin of each foot; -1 for none."""


class FloorContact:
    """Contact of the feet, for one session."""

    def __init__(self, body: Body, residuals: Residuals, floor_m: float, rate_hz: float) -> None:
        """`floor_m` is the height of a toe on the floor [m]; frames follow each other at `rate_hz` [Hz]."""
        tree, carriers = toe_tree(body), residuals.tree.station_body.tolist()
        shins = tree.parent[tree.station_body].tolist()
        station: Ints = np.array([carriers.index(shin) if shin in carriers else -1 for shin in shins], np.int64)
        self._feet = Feet(tree, new_state(tree), residuals.targets, residuals.tree.mount_m, station)
        self._scales = floor_m, _SPEED_M_S / rate_hz, _FREE_SPEED_M_S / rate_hz
        self._last_m = np.full((len(FEET), 3), np.nan)
        posture, none = np.zeros(POSTURE_SIZE), np.zeros((0, POSTURE_SIZE))
        example = Subspace(posture, none, np.zeros((POSTURE_SIZE, POSTURE_SIZE)), posture, posture)
        self._find = specialise(_find_toes, self._feet, np.zeros(3 + POSTURE_SIZE), self._last_m)
        self._constrain = specialise(_constrain, self._feet, example, self._last_m, np.zeros(3), False, self._scales)

    def record(self, qpos: Floats) -> None:
        """Note where the toes of the answer (55,) to this frame are."""
        self._find(self._feet, qpos, self._last_m)

    def constrain(self, prior: Subspace, ground: Floats, history: bool) -> Subspace:
        """A Gaussian prior times the terms, linearised at its mean; without a `history` the floor's alone.

        `ground` (3,) is the ground frame that is expected.
        """
        return self._constrain(self._feet, prior, self._last_m, ground, history, self._scales)


@compiled
def _find_toes(feet: Feet, qpos: Floats, toe_m: Floats) -> None:
    """Fill in `toe_m` (F, 3) for an answer (V + 1,); NaN where neither its shin nor three stations are measured."""
    slope, free = np.empty((3, len(feet.tree.depth))), _are_free_feet_bound(feet)
    if free:
        forward_kinematics(feet.tree, feet.state, qpos)
    for foot in range(len(feet.station)):
        toe_m[foot] = np.nan
        if _is_measured(feet, foot):
            toe_m[foot, 0], toe_m[foot, 1], toe_m[foot, 2] = _toe_m(feet, foot, qpos[7:], slope)
        elif free:
            toe_m[foot] = feet.state.station_m[foot]


@compiled
def _constrain(
    feet: Feet, prior: Subspace, last_m: Floats, ground: Floats, history: bool, scales: tuple[float, float, float]
) -> Subspace:
    """`FloorContact.constrain`, for the last toes (F, 3), NaN where unknown."""
    tree = feet.tree
    curvature, descent = prior.curvature.copy(), np.zeros(len(prior.mean))
    slope, along = np.empty((3, len(tree.depth))), np.zeros((3, len(prior.mean)))
    used = np.empty(len(prior.mean), np.int64)
    free = _are_free_feet_bound(feet)
    if free:
        forward_kinematics(tree, feet.state, qpos_from_posture(prior.mean, ground))
    for foot in range(len(feet.station)):
        body = tree.station_body[foot]
        if _is_measured(feet, foot):
            step_m, at = scales[1], _toe_m(feet, foot, prior.mean[HINGES], slope)
            count = tree.first_dof[body + 1] - tree.first_dof[body]
            for k in range(count):
                dof = tree.first_dof[body] + k
                used[k] = dof + _POSTURE_OF_DOF
                along[:, k] = slope[:, dof]
        elif free:
            toe = feet.state.station_m[foot]
            step_m, at = scales[2], (toe[0], toe[1], toe[2])
            count = _posture_jacobian(feet, foot, ground, prior.mean, used, along)
        else:
            continue
        _add_terms(at, last_m[foot], step_m if history else np.nan, scales[0], used[:count], along, curvature, descent)
    if not descent.any():
        return prior
    mean = prior.mean + np.linalg.solve(curvature, descent)
    return Subspace(mean, prior.normals, curvature, prior.linear, prior.spring)


@compiled
def _add_terms(
    at: Vector,
    last_m: Floats,
    step_m: float,
    floor_m: float,
    used: Ints,
    along: Floats,
    curvature: Floats,
    descent: Floats,
) -> None:
    """Add the terms of a toe at a place [m], whose derivatives by some numbers of the posture are given (3, N).

    `last_m` (3,) is where it was; it stays within `step_m`, NaN for no such term.
    """
    pull, moved = np.empty(3), 0.0
    for k in range(3):
        pull[k] = last_m[k] - at[k]
        moved += (pull[k] / step_m) ** 2
    stays = 0.0
    if np.isnan(moved):
        pull[:] = 0.0
    else:
        stays = 1.0 / ((1.0 + moved) * step_m) ** 2
    depth = floor_m - at[2]
    sinks = 1.0 / ((1.0 + (depth / _DEPTH_SCALE_M) ** 2) * _DEPTH_SIGMA_M) ** 2 if depth > 0.0 else 0.0
    for m in range(len(used)):
        descent[used[m]] += sinks * along[2, m] * depth
        for k in range(3):
            descent[used[m]] += stays * along[k, m] * pull[k]
        for n in range(len(used)):
            curvature[used[m], used[n]] += sinks * along[2, m] * along[2, n]
            for k in range(3):
                curvature[used[m], used[n]] += stays * along[k, m] * along[k, n]


@compiled
def _posture_jacobian(feet: Feet, foot: int, ground: Floats, posture: Floats, used: Ints, along: Floats) -> int:
    """Fill in the derivatives (3, N) of a toe [m] by the N numbers of the posture that move it, and their indices.

    `feet.state` is evaluated for the posture (P,) on the ground frame (3,). Returns N.
    """
    tree, state = feet.tree, feet.state
    station_jacobian(tree, state, foot)
    motion, last = root_motion(np.concatenate((ground, posture))), tree.station_dof[foot]
    for m in range(HINGES.start):
        used[m] = m
        for k in range(3):
            along[k, m] = 0.0
            for d in range(_ROOT_DOFS):
                along[k, m] += motion[3 + m, d] * state.jacobian[k, d]
    count = HINGES.start
    for d in range(_ROOT_DOFS, tree.depth[last] + 1):
        used[count] = tree.ancestors[last, d] + _POSTURE_OF_DOF
        along[:, count] = state.jacobian[:3, d]
        count += 1
    return count


@compiled
def _are_free_feet_bound(feet: Feet) -> bool:
    """Whether the measured positions of the frame show where the body is."""
    count = len(feet.targets.target_m)
    return bool(np.sum(feet.targets.precision[:count] > 0.0) >= _FEWEST_STATIONS)


@compiled
def _is_measured(feet: Feet, foot: int) -> bool:
    """Whether the shin of a foot has a station, whose position and orientation are measured."""
    station, precision = feet.station[foot], feet.targets.precision
    count = len(feet.targets.target_m)
    return bool(station >= 0 and precision[station] > 0.0 and precision[count + station] > 0.0)


@compiled
def _toe_m(feet: Feet, foot: int, hinges: Floats, slope: Floats) -> Vector:
    """The toe of a foot [m], by the measured pose of the shin's station and the foot's angles.

    Its derivatives by the foot's directions are filled into the columns of `slope` (3, V) [m/rad].
    """
    tree, targets, station = feet.tree, feet.targets, feet.station[foot]
    body, toe, mount = tree.station_body[foot], tree.mount_m[foot], feet.mount_m[station]
    first, end, ankle = tree.first_dof[body], tree.first_dof[body + 1], tree.joint_m[body]
    q = as_tuple(targets.world_from_target[station])
    to_ankle = rotate(q, ankle[0] - mount[0], ankle[1] - mount[1], ankle[2] - mount[2])
    for dof in range(first, end):
        axis, half = tree.axis[dof], 0.5 * hinges[dof - _ROOT_DOFS]
        slope[0, dof], slope[1, dof], slope[2, dof] = rotate(q, axis[0], axis[1], axis[2])
        sine = np.sin(half)
        q = quaternion_product(q, (np.cos(half), sine * axis[0], sine * axis[1], sine * axis[2]))
    x, y, z = rotate(q, toe[0], toe[1], toe[2])
    for dof in range(first, end):
        a, b, c = slope[0, dof], slope[1, dof], slope[2, dof]
        slope[0, dof], slope[1, dof], slope[2, dof] = b * z - c * y, c * x - a * z, a * y - b * x
    at = targets.target_m[station]
    return at[0] + to_ankle[0] + x, at[1] + to_ankle[1] + y, at[2] + to_ankle[2] + z
