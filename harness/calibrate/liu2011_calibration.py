"""Skeleton and mounts by eq. 1 of Liu et al. 2011 as printed (docs/papers.md A3; docs/calibration.md).

The joint angles of the eight poses are taken as known. The unknowns are bone lengths, mode weights and mounts. Our
choices where the paper is silent:

- Rotations differ by a rotation vector.
- The directions of bones are those of the mean skeleton.
- The performer's place and heading are no joint angles, so they are free in each pose.
- Both weights, and where Levenberg-Marquardt stops, were chosen on simulated performers who appear in no table
  (docs/notes/calibration.md). The minimum itself is hardly determined by poses that are missed: neither the mode
  weights nor the mounts have a prior.

Poses and their holds are found as for `pose_calibration`, which is our own version of the equation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import Mount
from harness.calibrate.bundle_adjustment import BundleAdjustment
from harness.calibrate.hold import UnusableHold
from harness.calibrate.pose_calibration import calibration_of, measure_poses, pose_bundle
from harness.calibrate.skeleton_prior import SkeletonPrior
from harness.calibrate.unknowns import CalibrationSolution
from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.calibration import Calibration
from harness.core.skeleton import Skeleton
from harness.stream import TrackerFrame

_ROOT = [0, 1, 2, 5]
"""Free components of a root's step: translation, and rotation about the vertical."""
_ROUNDS, _MOST_DAMPING = 200, 1e8


@dataclass(frozen=True)
class Liu2011Constants:
    """What the paper leaves open; the defaults were chosen on performers whom no table judges."""

    alpha_1: float = 0.1
    """Weight of the orientation term [m^2/rad^2]."""
    alpha_2: float = 10.0
    """Weight of the skeleton term, which stands outside the double sum."""
    damping: float = 1.0
    """First damping of Levenberg-Marquardt, relative to the diagonal of the normal matrix."""
    tolerance: float = 0.5
    """The solver stops when a step decreases the objective by less than this share."""


@dataclass(frozen=True, eq=False)
class Liu2011Calibration:
    """Result of eq. 1; N bones, B modes."""

    calibration: Calibration
    """Mounts and room, of kind `liu2011`."""
    skeleton: Skeleton
    """The performer's skeleton, with the standard body's hinges."""
    weights_m: Floats
    """(B,) weights of the modes: lambda of eq. 1 [m]."""
    cost: float
    """Value of the objective at the solution [m^2]."""

    def __post_init__(self) -> None:
        freeze(self, weights_m=("B",))


def calibrate_liu2011(
    held: Sequence[Sequence[TrackerFrame]],
    space: SkeletonPrior,
    mounts: Sequence[Mount],
    constants: Liu2011Constants | None = None,
) -> Liu2011Calibration:
    """Minimise eq. 1 over the frames of the eight holds, in the order of `poses.POSES`.

    `mounts` are where the solver starts, in the order of the stream's stations; they do not enter the objective.
    UnusableHold when a hold has too few readings or moved, or when a bone has no length. BadInput for a wrong number of
    poses or stations.
    """
    objective = PrintedObjective(
        pose_bundle(measure_poses(held, mounts), space, mounts), constants or Liu2011Constants()
    )
    at, cost = objective.minimise()
    if (length_m := objective.signed_length_m(at)).min() <= 0.0:
        bone = objective.bundle.shared.template.names[int(np.argmin(length_m))]
        raise UnusableHold(
            f"Eq. 1 gives the bone {bone!r} a length of {1e3 * length_m.min():.0f} mm: "
            "the poses do not determine the skeleton.",
            "Hold the poses more exactly, or calibrate by `poses`.",
        )
    skeleton = objective.bundle.shared.template.with_bones(at.bone_m)
    return Liu2011Calibration(calibration_of("liu2011", at, skeleton, mounts), skeleton, at.weights_m, cost)


class PrintedObjective:
    """Eq. 1 for P poses and S stations, its Jacobian, and its minimum.

    The X unknowns are in order: N bone lengths, B mode weights, S mounts, S small rotations of stations in their own
    axes, and place and heading of each pose's root.
    """

    def __init__(self, bundle: BundleAdjustment, constants: Liu2011Constants) -> None:
        self.bundle, self._space, self._constants = bundle, bundle.shared.space, constants
        self._sqrt_alpha = np.sqrt([constants.alpha_1, constants.alpha_2])
        poses, stations = bundle.place_m.shape[:2]
        counts = [len(self._space.mean_m), len(self._space.modes), *([3 * stations] * 2), len(_ROOT) * poses]
        ends = np.cumsum(counts)
        self._lengths, self._weights, self._mount, self._turn, self._root = map(slice, (0, *ends[:-1]), ends)
        self._count = int(ends[-1])

    def minimise(self) -> tuple[CalibrationSolution, float]:
        """The solution from the mean skeleton and nominal mounts by Levenberg-Marquardt, and its cost [m^2]."""
        at, damping = self.bundle.start(), self._constants.damping
        residual = self.residuals(at)
        cost = float(residual @ residual)
        for _ in range(_ROUNDS):
            slope = self.jacobian(at)
            normal, downhill, before = slope.T @ slope, slope.T @ residual, cost
            while damping < _MOST_DAMPING:
                step = np.asarray(np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -downhill), dtype=float)
                candidate = self.apply_step(at, step)
                residual_there = self.residuals(candidate)
                if (then := float(residual_there @ residual_there)) < cost:
                    at, residual, cost, damping = candidate, residual_there, then, max(damping / 10.0, 1e-12)
                    break
                damping *= 10.0
            if before - cost <= self._constants.tolerance * before:
                break
        return at, cost

    def residuals(self, at: CalibrationSolution) -> Floats:
        """(6 P S + N,) terms whose sum of squares is eq. 1: positions, orientations, lengths [m]."""
        off_m, off_rad = self.bundle.residuals(self.bundle.forward_kinematics(at))
        lengths_m = self.signed_length_m(at) - self._space.mean_m - at.weights_m @ self._space.modes
        alpha_1, alpha_2 = self._sqrt_alpha
        return np.concatenate([off_m.ravel(), alpha_1 * off_rad.ravel(), alpha_2 * lengths_m])

    def jacobian(self, at: CalibrationSolution) -> Floats:
        """(6 P S + N, X) slope of `residuals`; that of the rotations holds for small residuals."""
        kinematics, reached = self.bundle.kinematics, self.bundle.forward_kinematics(at)
        poses, stations = reached.place_m.shape[:2]
        bones = np.arange(len(at.bone_m))
        place, turn = np.zeros((2, poses, stations, 3, self._count))
        place[..., self._lengths] = kinematics.bone_jacobian(reached, bones, self._space.direction)
        mounts, (root_m, root_rad) = kinematics.mount_jacobian(reached), kinematics.root_jacobian(reached)
        for j in range(stations):
            columns = slice(3 * j, 3 * j + 3)
            place[:, j][..., self._mount][..., columns] = mounts[:, j]
            turn[:, j][..., self._turn][..., columns] = reached.world_from_station[:, j]
        for i in range(poses):
            columns = slice(len(_ROOT) * i, len(_ROOT) * (i + 1))
            place[i][..., self._root][..., columns] = root_m[i][..., _ROOT]
            turn[i][..., self._root][..., columns] = root_rad[i][..., _ROOT]
        lengths = np.zeros((len(bones), self._count))
        lengths[:, self._lengths], lengths[:, self._weights] = np.eye(len(bones)), -self._space.modes.T
        alpha_1, alpha_2 = self._sqrt_alpha
        rows = (-1, self._count)
        return np.concatenate([-place.reshape(rows), -alpha_1 * turn.reshape(rows), alpha_2 * lengths])

    def apply_step(self, at: CalibrationSolution, step: Floats) -> CalibrationSolution:
        """A solution plus a step (X,) of the unknowns."""
        root = step[self._root].reshape(-1, len(_ROOT))
        turn = rotations.to_matrix(rotations.exp(step[self._turn].reshape(-1, 3)))
        return CalibrationSolution(
            bone_m=at.bone_m + step[self._lengths, None] * self._space.direction,
            weights_m=at.weights_m + step[self._weights],
            mount_m=at.mount_m + step[self._mount].reshape(-1, 3),
            bone_from_station=at.bone_from_station @ turn,
            root_m=at.root_m + root[:, :3],
            world_from_root=rotations.to_matrix(rotations.about_z(root[:, 3])) @ at.world_from_root,
            angles_rad=at.angles_rad,
        )

    def signed_length_m(self, at: CalibrationSolution) -> Floats:
        """(N,) lengths along the mean directions; the objective has no bound, so they may become negative [m]."""
        out: Floats = np.sum(at.bone_m * self._space.direction, axis=1)
        return out
