"""Kernel ridge regression from readings to posture: the plainest smooth map that can be learnt from examples.

A control for the papers' local models (docs/methods.md E): one Gaussian kernel over all examples, no neighbours, no
memory. Readings are seen from the heading of one station on the trunk, so neither place nor heading matters; a
station that is silent reads what the last answer puts there.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.features.anchor_frame import anchor_of
from harness.reconstruct.features.virtual_trackers import station_poses
from harness.reconstruct.methods.mean_pose import mean_posture
from harness.reconstruct.solver.outlier_gate import OutlierGate
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.reconstruct.solver.status_monitor import StatusMonitor
from harness.stream.frame import TrackerFrame

_JUMP_M = 0.3
"""As for the best match: a learnt pose is never as near as a fitted one."""


@dataclass(frozen=True)
class KernelRidge:
    """A `Method`; constants were chosen on built-in takes that no scenario judges."""

    name: str = "kernel_ridge"
    summary: str = "one smooth map from readings to posture, learnt from all examples at once"
    needs_examples: bool = True
    most_frames: int = 2000
    """Examples are thinned to so many, evenly at random."""
    ridge: float = 0.01
    width: float = 1.4
    """Of the kernel, in root mean square distances of two examples."""
    lever_m: float = 0.3
    """A turn by one radian counts like so many metres."""
    position_noise_m: float = 0.004
    orientation_noise_rad: float = 0.01
    """Added to the examples' readings (docs/methods.md G1)."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedKernelRidge":
        """BadInput without examples."""
        frames = sum(len(take) for take in examples)
        if frames < 2:
            raise BadInput("A regression is learnt from examples, and there are none.", "Name some in the scenario.")
        kept = np.sort(rng.permutation(frames)[: self.most_frames])
        return FittedKernelRidge(self, body, tuple(examples), kept, rng.standard_normal((len(kept), 12, 6)))


@dataclass(frozen=True, eq=False)
class FittedKernelRidge:
    """The examples; the map itself depends on where the stations are worn."""

    options: KernelRidge
    body: Body
    takes: tuple[BodyMotion, ...]
    kept: Ints
    """(N,) which frames of all."""
    noise: Floats
    """(N, 12, 6) standard normal, for the readings of up to twelve stations."""

    def begin(self, calibration: Calibration) -> "KernelRidgeSession":
        return KernelRidgeSession(self, calibration)


class KernelRidgeSession:
    """Learns the map for this calibration, then follows it."""

    def __init__(self, fitted: FittedKernelRidge, calibration: Calibration) -> None:
        options, body, count = fitted.options, fitted.body, len(calibration.stations)
        self._lever_m = options.lever_m
        self._residuals = Residuals(body, calibration, Loss())
        self._coverage, self._gate = StatusMonitor(), OutlierGate(count, _JUMP_M)
        self._anchor = anchor_of(calibration.bones)
        self._mean_qpos = self._answer = mean_posture(body, fitted.takes)

        read = [station_poses(body, take, calibration) for take in fitted.takes]
        position_m, turned = (np.concatenate(parts)[fitted.kept] for parts in zip(*read, strict=True))
        noise = fitted.noise[:, :count]
        position_m = position_m + options.position_noise_m * noise[..., :3]
        turned = rotations.multiply(rotations.exp(options.orientation_noise_rad * noise[..., 3:]), turned)
        x = self._features(position_m, turned)
        angles = np.concatenate([take.qpos[:, 7:] for take in fitted.takes])[fitted.kept]
        y = (angles - self._mean_qpos[7:] + np.pi) % (2.0 * np.pi) - np.pi

        self._middle, self._x = x.mean(axis=0), x - x.mean(axis=0)
        self._width = 2.0 * options.width**2 * 2.0 * float(np.mean(np.sum(self._x**2, axis=1)))
        factor = cho_factor(self._kernel(self._x) + options.ridge * np.eye(len(x)))
        self._weights: Floats = cho_solve(factor, y)

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._coverage.update(frame)
        if any_seen:
            self._gate.read(frame, self._residuals)
            qpos = self._mean_qpos.copy()
            near = self._kernel(self._features(*self._filled()) - self._middle)
            qpos[7:] += (near @ self._weights)[0]
            qpos[:7] = self._answer[:7]
            self._answer = place_root(self._residuals, qpos)
            self._gate.update(self._residuals, self._answer)
        return Estimate(self._answer, status)

    def _filled(self) -> tuple[Floats, Floats]:
        """Positions (1, S, 3) and bone orientations (1, S, 4), from the last answer where nothing was read."""
        residuals, count = self._residuals, len(self._residuals.bones)
        if residuals.measured.all():
            return residuals.target_m[None], residuals.world_from_target[None]
        here, facing = residuals.measured[:count, None], residuals.measured[count:, None]
        residuals.kinematics.set(place_root(residuals, self._answer))
        at_m, turned = residuals.kinematics.station_poses(
            residuals.bones, residuals.mount_m, _identity_orientations(count)
        )
        position_m = np.where(here, residuals.target_m, at_m)
        return position_m[None], np.where(facing, residuals.world_from_target, turned)[None]

    def _features(self, position_m: Floats, turned: Floats) -> Floats:
        """(N, 9 S): places and two axes of each station's bone, as seen from the anchor's heading."""
        level = rotations.about_z(-rotations.yaw_rad(turned[:, self._anchor]))[:, None]
        flat = position_m[:, self._anchor, None] * [1.0, 1.0, 0.0]
        place = rotations.rotate(level, position_m - flat)
        axes = self._lever_m * rotations.to_matrix(rotations.multiply(level, turned))[..., :2]
        return np.concatenate([place.reshape(len(place), -1), axes.reshape(len(axes), -1)], axis=1)

    def _kernel(self, x: Floats) -> Floats:
        """(M, N) between readings (M, 9 S) and the examples'."""
        far = np.sum(x**2, axis=1)[:, None] + np.sum(self._x**2, axis=1) - 2.0 * x @ self._x.T
        out: Floats = np.exp(-far / self._width)
        return out


def _identity_orientations(count: int) -> Floats:
    return np.tile(rotations.IDENTITY, (count, 1))
