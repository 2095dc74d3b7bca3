"""Contact of the feet with the floor, as terms of a Gaussian prior of the posture.

A station on the shin shows where the ankle is, but not how the foot turns. Two facts about the floor say more:

- A toe that is nearly still is in contact and stays there. Its displacement d since the last frame pulls it back with
  the weight 1 / (1 + d^2)^2, where d is in units of a scale (Geman and McClure 1985). Fast toes are free.
- A toe does not sink into the floor. Its depth below it pulls in the same way. Far below, it is on another floor.

Both terms are linearised in the foot's angles at the prior's mean. The measured pose of the shin is taken as exact.
"""

from typing import NamedTuple

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled, specialise
from harness.core.compiled_rotations import Vector, as_tuple, quaternion_product, rotate
from harness.reconstruct.solver.ground_frame import HINGES, POSTURE_SIZE
from harness.reconstruct.solver.kinematic_tree import KinematicTree, build_tree
from harness.reconstruct.solver.normal_equations import StationTargets
from harness.reconstruct.solver.residuals import Residuals
from harness.reconstruct.solver.subspace_minimiser import Subspace

FEET = ("lfoot", "rfoot")
"""Bones whose far ends are the toes."""
_SPEED_M_S = 0.4
"""Standard deviation of a toe's speed in contact, and the scale beyond which it is not in contact."""
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
    targets: StationTargets
    mount_m: Floats
    """(S, 3) positions of the stations in their bones' frames [m]."""
    station: Ints
    """(F,) station on the shin of each foot; -1 for none."""


class FloorContact:
    """Contact of the feet whose shins carry stations, for one session."""

    def __init__(self, body: Body, residuals: Residuals, floor_m: float, rate_hz: float) -> None:
        """`floor_m` is the height of a toe on the floor [m]; frames follow each other at `rate_hz` [Hz]."""
        tree, carriers = toe_tree(body), residuals.tree.station_body.tolist()
        shins = tree.parent[tree.station_body].tolist()
        station: Ints = np.array([carriers.index(shin) if shin in carriers else -1 for shin in shins], np.int64)
        self._feet = Feet(tree, residuals.targets, residuals.tree.mount_m, station)
        self._scales = floor_m, _SPEED_M_S / rate_hz, _DEPTH_SIGMA_M, _DEPTH_SCALE_M
        self._last_m = np.full((len(FEET), 3), np.nan)
        posture, none = np.zeros(POSTURE_SIZE), np.zeros((0, POSTURE_SIZE))
        example = Subspace(posture, none, np.zeros((POSTURE_SIZE, POSTURE_SIZE)), posture, posture)
        self._find = specialise(_find_toes, self._feet, posture[HINGES], self._last_m)
        self._constrain = specialise(_constrain, self._feet, example, self._last_m, False, self._scales)

    def record(self, qpos: Floats) -> None:
        """Note where the toes of the answer (55,) to this frame are."""
        self._find(self._feet, qpos[7:], self._last_m)

    def constrain(self, prior: Subspace, history: bool) -> Subspace:
        """A Gaussian prior times the terms, linearised at its mean; without a `history` the floor's alone."""
        return self._constrain(self._feet, prior, self._last_m, history, self._scales)


@compiled
def _find_toes(feet: Feet, hinges: Floats, toe_m: Floats) -> None:
    """Fill in `toe_m` (F, 3); NaN where the shin's station is missing or not measured."""
    slope = np.empty((3, len(feet.tree.depth)))
    for foot in range(len(feet.station)):
        toe_m[foot] = np.nan
        if _is_measured(feet, foot):
            toe_m[foot, 0], toe_m[foot, 1], toe_m[foot, 2] = _toe_m(feet, foot, hinges, slope)


@compiled
def _constrain(
    feet: Feet, prior: Subspace, last_m: Floats, history: bool, scales: tuple[float, float, float, float]
) -> Subspace:
    """`FloorContact.constrain`, for the last toes (F, 3), NaN where unknown."""
    tree = feet.tree
    floor_m, step_m, depth_sigma_m, depth_scale_m = scales
    curvature, descent = prior.curvature.copy(), np.zeros(len(prior.mean))
    slope, pull, hinges = np.empty((3, len(tree.depth))), np.empty(3), prior.mean[HINGES]
    for foot in range(len(feet.station)):
        if not _is_measured(feet, foot):
            continue
        at = _toe_m(feet, foot, hinges, slope)
        stays, moved = 0.0, 0.0
        for k in range(3):
            pull[k] = last_m[foot, k] - at[k]
            moved += (pull[k] / step_m) ** 2
        if history and not np.isnan(moved):
            stays = 1.0 / ((1.0 + moved) * step_m) ** 2
        else:
            pull[:] = 0.0
        depth = floor_m - at[2]
        sinks = 1.0 / ((1.0 + (depth / depth_scale_m) ** 2) * depth_sigma_m) ** 2 if depth > 0.0 else 0.0
        body = tree.station_body[foot]
        for dof in range(tree.first_dof[body], tree.first_dof[body + 1]):
            i = dof + _POSTURE_OF_DOF
            descent[i] += sinks * slope[2, dof] * depth
            for k in range(3):
                descent[i] += stays * slope[k, dof] * pull[k]
            for other in range(tree.first_dof[body], tree.first_dof[body + 1]):
                j = other + _POSTURE_OF_DOF
                curvature[i, j] += sinks * slope[2, dof] * slope[2, other]
                for k in range(3):
                    curvature[i, j] += stays * slope[k, dof] * slope[k, other]
    if not descent.any():
        return prior
    mean = prior.mean + np.linalg.solve(curvature, descent)
    return Subspace(mean, prior.normals, curvature, prior.linear, prior.spring)


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
