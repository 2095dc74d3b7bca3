"""Bundle adjustment of calibration poses: eq. 1 of Liu et al. 2011 (docs/papers.md A3; docs/calibration.md).

Residuals are in units of their standard deviation. Poses are coupled only by the shared unknowns, so each pose is
eliminated alone (Schur complement). The reduced system is also the information about the shared unknowns when
the poses are unknown. `bundle_fit` takes the Levenberg-Marquardt steps.
"""

from dataclasses import dataclass

import numpy as np

from harness.calibrate.held_pose_model import heading_between_rad
from harness.calibrate.station_kinematics import StationKinematics, StationPoses
from harness.calibrate.unknowns import CalibrationSolution, SharedUnknowns, apply_step
from harness.core import rotations
from harness.core.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class ResidualScales:
    """Standard deviations that residuals are divided by, and the skin offsets of the nominal mounts."""

    pose_error_rad: float
    """Error of each hinge, and of the lean of the body, against the nominal pose [rad]."""
    mount_spread: float
    """Spread of trackers about their nominal mounts, in units of `held_pose_model.MOUNT_*_SD_M`."""
    skin_offset_m: Floats
    """(S, 3) offset of the nominal mounts from the bones, an argument of `SharedUnknowns.nominal_m` [m]."""
    position_sd_m: float
    """Error of a station's median position in a pose, on each axis [m]."""
    orientation_sd_rad: float
    """Error of a station's median orientation in a pose, about each axis [rad]."""


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations about a solution, in X shared unknowns and Y more for each of P poses."""

    shared: Floats
    """(X, X) block of the shared unknowns."""
    coupling: Floats
    """(P, Y, X) blocks that couple each pose with the shared unknowns."""
    pose_blocks: Floats
    """(P, Y, Y) block of each pose."""
    shared_gradient: Floats
    """(X,) right-hand side of the shared unknowns."""
    pose_gradient: Floats
    """(P, Y) right-hand side of each pose."""

    def step(self, damping: float) -> tuple[Floats, Floats]:
        """Solve with Marquardt damping: steps of the shared unknowns (X,) and of the poses (P, Y)."""
        pose_blocks: Floats = self.pose_blocks * (1.0 + damping * np.eye(self.pose_blocks.shape[1]))
        solved = _solve(pose_blocks, np.concatenate([self.coupling, self.pose_gradient[..., None]], axis=2))
        reduced = self.shared * (1.0 + damping * np.eye(len(self.shared))) - _summed_product(
            self.coupling, solved[..., :-1]
        )
        slope = self.shared_gradient - _summed_product(self.coupling, solved[..., -1:])[:, 0]
        shared = _solve(reduced, slope)
        return shared, solved[..., -1] - solved[..., :-1] @ shared

    def information(self) -> Floats:
        """(X, X) information about the shared unknowns with the poses marginalised."""
        out = self.shared - _summed_product(self.coupling, _solve(self.pose_blocks, self.coupling))
        return 0.5 * (out + out.T)

    def variances(self) -> tuple[Floats, Floats]:
        """Covariance (X, X) of the shared unknowns, and variances (P, Y) of the poses' unknowns."""
        covariance = _solve(self.information(), np.eye(len(self.shared)))
        inverse = _solve(self.pose_blocks, np.eye(self.pose_blocks.shape[1])[None])
        gain = inverse @ self.coupling
        pose_variance = np.diagonal(inverse, axis1=1, axis2=2) + np.sum((gain @ covariance) * gain, axis=2)
        return covariance, pose_variance


class BundleAdjustment:
    """The least-squares problem of P calibration poses of S stations.

    `place_m` (P, S, 3) [m] and `turn` (P, S, 3, 3) are median station positions and orientations, z upward;
    `nominal_rad` (P, D) are the hinge angles of the poses as shown, which the performer misses by a little.
    """

    def __init__(self, shared: SharedUnknowns, nominal_rad: Floats, place_m: Floats, turn: Floats) -> None:
        self.shared, self.nominal_rad, self.place_m, self.turn = shared, nominal_rad, place_m, turn
        self.kinematics = StationKinematics(shared.template, shared.carriers)
        self.hinges: Ints = np.flatnonzero(self.kinematics.hinge_turns_station.any(axis=0))
        """(H,) hinges that turn a station. The others keep their nominal angles, since no reading depends on them."""

    def start(self) -> CalibrationSolution:
        """Start: mean bones, nominal mounts and hinges; roots and strap orientations that fit the readings best."""
        skeleton = self.shared.space.mean_skeleton(self.shared.template)
        mount_m = self.shared.nominal_m(skeleton.bone_m, self.shared.skin_offset_m(skeleton.bone_m))
        poses, stations = self.place_m.shape[:2]
        upright = np.tile(np.eye(3), (poses, 1, 1))
        straight = np.tile(np.eye(3), (stations, 1, 1))
        at = self.kinematics.forward_kinematics(
            skeleton.bone_m, np.zeros((poses, 3)), upright, self.nominal_rad, mount_m, straight
        )
        heading_rad = np.array([heading_between_rad(a, b) for a, b in zip(at.place_m, self.place_m, strict=True)])
        root = rotations.to_matrix(rotations.about_z(heading_rad))
        carried = root[:, None] @ at.world_from_station
        return CalibrationSolution(
            bone_m=skeleton.bone_m,
            weights_m=np.zeros(len(self.shared.space.modes)),
            mount_m=mount_m,
            bone_from_station=rotations.nearest_rotation((np.swapaxes(carried, -1, -2) @ self.turn).mean(axis=0)),
            root_m=self.place_m.mean(axis=1) - (root @ at.place_m.mean(axis=1)[..., None])[..., 0],
            world_from_root=root,
            angles_rad=self.nominal_rad,
        )

    def apply_step(self, at: CalibrationSolution, step: tuple[Floats, Floats]) -> CalibrationSolution:
        return apply_step(at, self.shared, *step, self.hinges)

    def forward_kinematics(self, at: CalibrationSolution) -> StationPoses:
        return self.kinematics.forward_kinematics(
            at.bone_m, at.root_m, at.world_from_root, at.angles_rad, at.mount_m, at.bone_from_station
        )

    def residuals(self, reached: StationPoses) -> tuple[Floats, Floats]:
        """Measured minus predicted: positions (P, S, 3) [m] and rotation vectors (P, S, 3) in world axes [rad]."""
        turn = self.turn @ np.swapaxes(reached.world_from_station, -1, -2)
        return self.place_m - reached.place_m, rotations.log(rotations.from_matrix(turn))

    def pose_errors(self, at: CalibrationSolution) -> Floats:
        """(P, 2 + H) sine of the lean on two axes, and hinges minus their nominal angles [rad]."""
        return np.concatenate([_tilt(at)[0], (at.angles_rad - self.nominal_rad)[:, self.hinges]], axis=1)

    def cost(self, at: CalibrationSolution, scales: ResidualScales, weight: Floats) -> float:
        """Weighted sum of squared residuals; `weight` (P, S, 2) is that of each position and orientation."""
        place_m, turn_rad = self.residuals(self.forward_kinematics(at))
        read = weight[..., 0] * np.sum((place_m / scales.position_sd_m) ** 2, axis=2)
        read = read + weight[..., 1] * np.sum((turn_rad / scales.orientation_sd_rad) ** 2, axis=2)
        expected, _ = self.shared.prior_residuals(at, scales.mount_spread, scales.skin_offset_m)
        return float(np.sum(read) + np.sum((self.pose_errors(at) / scales.pose_error_rad) ** 2) + expected @ expected)

    def normal_equations(self, at: CalibrationSolution, scales: ResidualScales, weight: Floats) -> NormalEquations:
        """Normal equations at a solution; the arguments are those of `cost`."""
        residual, by_shared, by_pose = self._readings(
            at, np.sqrt(weight) / [scales.position_sd_m, scales.orientation_sd_rad]
        )
        expected, slope = self.shared.prior_residuals(at, scales.mount_spread, scales.skin_offset_m)
        pose_error, pose_jacobian = (
            self.pose_errors(at) / scales.pose_error_rad,
            self._pose_error_jacobian(at) / scales.pose_error_rad,
        )
        by_pose_t, pose_jacobian_t = np.swapaxes(by_pose, 1, 2), np.swapaxes(pose_jacobian, 1, 2)
        return NormalEquations(
            shared=_summed_product(by_shared, by_shared) + slope.T @ slope,
            coupling=by_pose_t @ by_shared,
            pose_blocks=by_pose_t @ by_pose + pose_jacobian_t @ pose_jacobian,
            shared_gradient=_summed_product(by_shared, residual[..., None])[:, 0] - slope.T @ expected,
            pose_gradient=(by_pose_t @ residual[..., None] - pose_jacobian_t @ pose_error[..., None])[..., 0],
        )

    def _readings(self, at: CalibrationSolution, scale: Floats) -> tuple[Floats, Floats, Floats]:
        """Residuals (P, 6 S) of positions and orientations times `scale` (P, S, 2), and the prediction's Jacobians.

        The Jacobians are those of the shared unknowns (P, 6 S, X) and of the poses' unknowns (P, 6 S, 6 + H).
        """
        layout, reached = self.shared, self.forward_kinematics(at)
        residual = np.stack(self.residuals(reached), axis=2)
        shared = np.zeros((*residual.shape, layout.count))
        shared[:, :, 0, :, layout.bones] = self.kinematics.bone_jacobian(reached, layout.bone_of, layout.vector)
        mounts = self.kinematics.mount_jacobian(reached)
        for j in range(residual.shape[1]):
            columns = slice(3 * j, 3 * j + 3)
            shared[:, j, 0, :, layout.mount][..., columns] = mounts[:, j]
            shared[:, j, 1, :, layout.turn][..., columns] = reached.world_from_station[:, j]
        roots, hinges = self.kinematics.root_jacobian(reached), self.kinematics.hinge_jacobian(reached)
        by_pose = np.stack(
            [np.concatenate([r, h[..., self.hinges]], axis=3) for r, h in zip(roots, hinges, strict=True)], axis=2
        )
        rows = (len(residual), -1)
        scale = scale[..., None]
        return (
            (residual * scale).reshape(rows),
            (shared * scale[..., None]).reshape(*rows, layout.count),
            (by_pose * scale[..., None]).reshape(*rows, by_pose.shape[-1]),
        )

    def _pose_error_jacobian(self, at: CalibrationSolution) -> Floats:
        """(P, 2 + H, 6 + H) Jacobian of `pose_errors` in the poses' unknowns."""
        count = len(self.hinges)
        slope = np.zeros((len(at.root_m), 2 + count, 6 + count))
        slope[:, :2, 3:6] = _tilt(at)[1]
        slope[:, 2:, 6:] = np.eye(count)
        return slope


def _tilt(at: CalibrationSolution) -> tuple[Floats, Floats]:
    """(P, 2) sine of the roots' lean on two axes, and its Jacobian (P, 2, 3) in small rotations."""
    up = at.world_from_root[:, 2]
    turned = np.swapaxes(at.world_from_root, 1, 2) @ rotations.cross_matrix(np.array([0.0, 0.0, 1.0]))
    return np.stack([up[:, 1], -up[:, 0]], axis=1), np.stack([turned[:, 1], -turned[:, 0]], axis=1)


def _solve(matrix: Floats, right: Floats) -> Floats:
    return np.asarray(np.linalg.solve(matrix, right), dtype=float)


def _summed_product(a: Floats, b: Floats) -> Floats:
    """Sum over the first two axes: (P, R, X) and (P, R, Z) to (X, Z)."""
    out: Floats = a.reshape(-1, a.shape[-1]).T @ b.reshape(-1, b.shape[-1])
    return out
