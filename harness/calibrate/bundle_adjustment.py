"""Eq. 1 of Liu et al. 2011 as a bundle adjustment (docs/methods.md A3, H15): its normal equations, and the steps of
Levenberg and Marquardt.

Residuals are in units of their spread. Poses meet only in what they share, so that they are eliminated one by one
(Schur complement), which also tells how well the shared unknowns are known when the poses are not.
"""

from dataclasses import dataclass

import numpy as np

from harness.calibrate.station_kinematics import StationKinematics, StationPoses
from harness.calibrate.unknowns import CalibrationSolution, SharedUnknowns, apply_step
from harness.core import rotations
from harness.core.arrays import Floats, Ints


@dataclass(frozen=True, eq=False)
class ResidualScales:
    """What residuals are from, and the standard deviations by which they are measured."""

    pose_error_rad: float
    """Of each hinge, and of the lean of the body, from the pose that was asked for."""
    mount_spread: float
    """Of trackers from their nominal mounts, in units of `unknowns.ALONG_M` and `ACROSS_M`."""
    flesh_m: Floats
    """(S, 3) of the nominal mounts, as `SharedUnknowns.nominal_m` takes it."""
    place_m: float
    """Of a station's typical place in a pose, on each axis."""
    turn_rad: float
    """Likewise of its orientation."""


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Normal equations about a solution, in X shared and P times Y own unknowns."""

    shared: Floats
    """(X, X)"""
    across: Floats
    """(P, Y, X)"""
    own: Floats
    """(P, Y, Y)"""
    shared_slope: Floats
    """(X,)"""
    own_slope: Floats
    """(P, Y)"""

    def step(self, damping: float) -> tuple[Floats, Floats]:
        """Shared (X,) and own (P, Y)."""
        own: Floats = self.own * (1.0 + damping * np.eye(self.own.shape[1]))
        solved = _solve(own, np.concatenate([self.across, self.own_slope[..., None]], axis=2))
        reduced = self.shared * (1.0 + damping * np.eye(len(self.shared))) - _summed_product(
            self.across, solved[..., :-1]
        )
        slope = self.shared_slope - _summed_product(self.across, solved[..., -1:])[:, 0]
        shared = _solve(reduced, slope)
        return shared, solved[..., -1] - solved[..., :-1] @ shared

    def information(self) -> Floats:
        """(X, X) about what is shared when the poses are not known."""
        out = self.shared - _summed_product(self.across, _solve(self.own, self.across))
        return 0.5 * (out + out.T)

    def variances(self) -> tuple[Floats, Floats]:
        """Covariance (X, X) of what is shared, and variances (P, Y) of the poses' own."""
        covariance = _solve(self.information(), np.eye(len(self.shared)))
        inverse = _solve(self.own, np.eye(self.own.shape[1])[None])
        gain = inverse @ self.across
        own = np.diagonal(inverse, axis1=1, axis2=2) + np.sum((gain @ covariance) * gain, axis=2)
        return covariance, own


class BundleAdjustment:
    """Typical places (P, S, 3) and orientations (P, S, 3, 3) of stations in P poses whose hinges (P, D) are known
    but for a miss; z is upward."""

    def __init__(self, shared: SharedUnknowns, asked_rad: Floats, place_m: Floats, turn: Floats) -> None:
        self.shared, self.asked_rad, self.place_m, self.turn = shared, asked_rad, place_m, turn
        self.chain = StationKinematics(shared.template, shared.carriers)
        self.hinges: Ints = np.flatnonzero(self.chain.turns.any(axis=0))
        """(H,) those that turn a station. Of the others nothing is told: they are as asked."""

    def start(self) -> CalibrationSolution:
        """Mean bones and nominal mounts, poses as asked, where stations are and however straps then fit best."""
        skeleton = self.shared.space.mean_skeleton(self.shared.template)
        mount_m = self.shared.nominal_m(skeleton.bone_m, self.shared.flesh_m(skeleton.bone_m))
        poses, stations = self.place_m.shape[:2]
        upright = np.tile(np.eye(3), (poses, 1, 1))
        straight = np.tile(np.eye(3), (stations, 1, 1))
        at = self.chain.reach(skeleton.bone_m, np.zeros((poses, 3)), upright, self.asked_rad, mount_m, straight)
        heading_rad = np.array([heading_between_rad(a, b) for a, b in zip(at.place_m, self.place_m, strict=True)])
        root = rotations.to_matrix(rotations.about_z(heading_rad))
        carried = root[:, None] @ at.world_from_station
        return CalibrationSolution(
            bone_m=skeleton.bone_m,
            weights_m=np.zeros(len(self.shared.space.modes)),
            mount_m=mount_m,
            bone_from_station=mean_rotations(np.swapaxes(carried, -1, -2) @ self.turn),
            root_m=self.place_m.mean(axis=1) - (root @ at.place_m.mean(axis=1)[..., None])[..., 0],
            world_from_root=root,
            angles_rad=self.asked_rad,
        )

    def moved(self, at: CalibrationSolution, step: tuple[Floats, Floats]) -> CalibrationSolution:
        return apply_step(at, self.shared, *step, self.hinges)

    def reach(self, at: CalibrationSolution) -> StationPoses:
        return self.chain.reach(
            at.bone_m, at.root_m, at.world_from_root, at.angles_rad, at.mount_m, at.bone_from_station
        )

    def residuals(self, reached: StationPoses) -> tuple[Floats, Floats]:
        """From where stations should be to where they were: (P, S, 3) [m], and turns (P, S, 3) in world axes [rad]."""
        turn = self.turn @ np.swapaxes(reached.world_from_station, -1, -2)
        return self.place_m - reached.place_m, rotations.log(rotations.from_matrix(turn))

    def pose_errors(self, at: CalibrationSolution) -> Floats:
        """(P, 2 + H) lean, as its sine, and hinges from what was asked [rad]."""
        return np.concatenate([_tilt(at)[0], (at.angles_rad - self.asked_rad)[:, self.hinges]], axis=1)

    def cost(self, at: CalibrationSolution, given: ResidualScales, weight: Floats) -> float:
        """Sum of squared residuals; `weight` (P, S, 2) of each place and turn."""
        place_m, turn_rad = self.residuals(self.reach(at))
        read = weight[..., 0] * np.sum((place_m / given.place_m) ** 2, axis=2)
        read = read + weight[..., 1] * np.sum((turn_rad / given.turn_rad) ** 2, axis=2)
        expected, _ = self.shared.prior_residuals(at, given.mount_spread, given.flesh_m)
        return float(np.sum(read) + np.sum((self.pose_errors(at) / given.pose_error_rad) ** 2) + expected @ expected)

    def normal(self, at: CalibrationSolution, given: ResidualScales, weight: Floats) -> NormalEquations:
        """About a solution; arguments as of `cost`."""
        residual, shared, own = self._readings(at, np.sqrt(weight) / [given.place_m, given.turn_rad])
        expected, slope = self.shared.prior_residuals(at, given.mount_spread, given.flesh_m)
        missed, missed_slope = (
            self.pose_errors(at) / given.pose_error_rad,
            self._missed_slope(at) / given.pose_error_rad,
        )
        flipped, missed_flipped = np.swapaxes(own, 1, 2), np.swapaxes(missed_slope, 1, 2)
        return NormalEquations(
            shared=_summed_product(shared, shared) + slope.T @ slope,
            across=flipped @ shared,
            own=flipped @ own + missed_flipped @ missed_slope,
            shared_slope=_summed_product(shared, residual[..., None])[:, 0] - slope.T @ expected,
            own_slope=(flipped @ residual[..., None] - missed_flipped @ missed[..., None])[..., 0],
        )

    def _readings(self, at: CalibrationSolution, scale: Floats) -> tuple[Floats, Floats, Floats]:
        """Residuals (P, 6 S) of places and turns times `scale` (P, S, 2), and how what is predicted changes with
        shared (P, 6 S, X) and own unknowns (P, 6 S, 6 + H)."""
        layout, reached = self.shared, self.reach(at)
        residual = np.stack(self.residuals(reached), axis=2)
        shared = np.zeros((*residual.shape, layout.count))
        shared[:, :, 0, :, layout.bones] = self.chain.bone_jacobian(reached, layout.bone_of, layout.vector)
        mounts = self.chain.mount_jacobian(reached)
        for j in range(residual.shape[1]):
            own_three = slice(3 * j, 3 * j + 3)
            shared[:, j, 0, :, layout.mount][..., own_three] = mounts[:, j]
            shared[:, j, 1, :, layout.turn][..., own_three] = reached.world_from_station[:, j]
        roots, hinges = self.chain.root_jacobian(reached), self.chain.hinge_jacobian(reached)
        own = np.stack(
            [np.concatenate([r, h[..., self.hinges]], axis=3) for r, h in zip(roots, hinges, strict=True)], axis=2
        )
        rows = (len(residual), -1)
        scale = scale[..., None]
        return (
            (residual * scale).reshape(rows),
            (shared * scale[..., None]).reshape(*rows, layout.count),
            (own * scale[..., None]).reshape(*rows, own.shape[-1]),
        )

    def _missed_slope(self, at: CalibrationSolution) -> Floats:
        """(P, 2 + H, 6 + H) of `missed`."""
        count = len(self.hinges)
        slope = np.zeros((len(at.root_m), 2 + count, 6 + count))
        slope[:, :2, 3:6] = _tilt(at)[1]
        slope[:, 2:, 6:] = np.eye(count)
        return slope


def heading_between_rad(from_m: Floats, to_m: Floats) -> float:
    """The turn about the vertical that takes points (S, 3) nearest to others, each about its mean."""
    a, b = ((points - points.mean(axis=0))[:, :2] @ [1.0, 1.0j] for points in (from_m, to_m))
    return float(np.angle(np.vdot(a, b)))


def mean_rotations(turns: Floats) -> Floats:
    """(S, 3, 3) the rotations nearest to the mean over the first axis of (P, S, 3, 3)."""
    u, _, v = np.linalg.svd(turns.mean(axis=0))
    u[..., -1] *= np.linalg.det(u @ v)[..., None]
    return np.asarray(u @ v)


def _tilt(at: CalibrationSolution) -> tuple[Floats, Floats]:
    """(P, 2) how far roots are off upright, as its sine, and how that changes with small turns (P, 2, 3)."""
    up = at.world_from_root[:, 2]
    turned = np.swapaxes(at.world_from_root, 1, 2) @ np.cross(np.eye(3), [0.0, 0.0, 1.0])
    return np.stack([up[:, 1], -up[:, 0]], axis=1), np.stack([turned[:, 1], -turned[:, 0]], axis=1)


def _solve(matrix: Floats, right: Floats) -> Floats:
    return np.asarray(np.linalg.solve(matrix, right), dtype=float)


def _summed_product(a: Floats, b: Floats) -> Floats:
    """Sum over the first two axes: (P, R, X) and (P, R, Z) to (X, Z)."""
    out: Floats = a.reshape(-1, a.shape[-1]).T @ b.reshape(-1, b.shape[-1])
    return out
