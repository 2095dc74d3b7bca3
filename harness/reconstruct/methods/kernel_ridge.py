"""Kernel ridge regression (`kernel_ridge`): one smooth map from readings to posture, learnt from all examples.

A control for the papers' local models (docs/papers.md E): one Gaussian kernel over all examples, no neighbours and no
history. Inputs are the stations' positions and bone orientations, relative to the heading of the station nearest to
the pelvis, so neither place nor heading matters. A missing reading is replaced by its value at the last estimate. The
root is fitted to the trackers afterwards.

Source: Saunders et al. 1998 (kernel ridge regression); noise on the examples' readings (docs/notes/ideas.md G1).

Options (fields of `KernelRidge`): `most_frames` 2000 examples, `ridge` 0.01, `width` 1.4 (kernel width over the RMS
distance of two examples), `lever_m` 0.3 (weight of orientations), and the noise of the examples' readings. They were
chosen on built-in takes that no scenario evaluates.
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
from harness.reconstruct.features.posture_statistics import mean_posture
from harness.reconstruct.features.virtual_trackers import station_poses
from harness.reconstruct.solver.anchor_frame import anchor_of
from harness.reconstruct.solver.outlier_gate import OutlierGate
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.reconstruct.solver.status_monitor import StatusMonitor
from harness.stream.frame import TrackerFrame

_JUMP_M = 0.3
"""Outlier gate [m]: wider than for `ik`, since a regressed pose is farther from the readings than a fitted one."""


@dataclass(frozen=True)
class KernelRidge:
    """Options of kernel ridge regression, a `Method`."""

    name: str = "kernel_ridge"
    summary: str = "one smooth map from readings to posture, learnt from all examples at once"
    needs_examples: bool = True
    most_frames: int = 2000
    """Largest number of example frames; more are thinned at random."""
    ridge: float = 0.01
    """Ridge that is added to the kernel matrix, whose diagonal is 1."""
    width: float = 1.4
    """Standard deviation of the kernel, in RMS distances of two examples."""
    lever_m: float = 0.3
    """Displacement that counts as much as a rotation of one radian [m]."""
    position_noise_m: float = 0.004
    """Noise added to the examples' positions on each axis, standard deviation [m]."""
    orientation_noise_rad: float = 0.01
    """Noise added to the examples' orientations about each axis, standard deviation [rad]."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedKernelRidge":
        """Choose the example frames; BadInput without examples."""
        frames = sum(len(take) for take in examples)
        if frames < 2:
            raise BadInput("Kernel ridge regression needs examples, and there are none.", "Name some in the scenario.")
        kept = np.sort(rng.permutation(frames)[: self.most_frames])
        return FittedKernelRidge(self, body, tuple(examples), kept, rng.standard_normal((len(kept), 12, 6)))


@dataclass(frozen=True, eq=False)
class FittedKernelRidge:
    """The chosen examples. The map depends on the mounts, so each session learns it."""

    options: KernelRidge
    body: Body
    takes: tuple[BodyMotion, ...]
    frames: Ints
    """(N,) indices of the chosen frames among all."""
    noise: Floats
    """(N, 12, 6) standard normal, for the readings of up to twelve stations."""

    def begin(self, calibration: Calibration) -> "KernelRidgeSession":
        return KernelRidgeSession(self, calibration)


class KernelRidgeSession:
    """Learns the map for a calibration and applies it to each frame."""

    def __init__(self, fitted: FittedKernelRidge, calibration: Calibration) -> None:
        options, body, count = fitted.options, fitted.body, len(calibration.stations)
        self._lever_m = options.lever_m
        self._residuals = Residuals(body, calibration, Loss())
        self._monitor, self._gate = StatusMonitor(), OutlierGate(count, _JUMP_M)
        self._anchor = anchor_of(calibration.bones)
        self._mean_qpos = self._estimate = mean_posture(body, fitted.takes)

        read = [station_poses(body, take, calibration) for take in fitted.takes]
        position_m, turned = (np.concatenate(parts)[fitted.frames] for parts in zip(*read, strict=True))
        noise = fitted.noise[:, :count]
        position_m = position_m + options.position_noise_m * noise[..., :3]
        turned = rotations.multiply(rotations.exp(options.orientation_noise_rad * noise[..., 3:]), turned)
        x = self._features(position_m, turned)
        angles = np.concatenate([take.qpos[:, 7:] for take in fitted.takes])[fitted.frames]
        y = rotations.wrap_angle(angles - self._mean_qpos[7:])

        self._x_mean, self._x = x.mean(axis=0), x - x.mean(axis=0)
        self._width = 2.0 * options.width**2 * 2.0 * float(np.mean(np.sum(self._x**2, axis=1)))
        factor = cho_factor(self._kernel(self._x) + options.ridge * np.eye(len(x)))
        self._weights: Floats = cho_solve(factor, y)

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_valid = self._monitor.update(frame)
        if any_valid:
            self._gate.read(frame, self._residuals)
            qpos = self._mean_qpos.copy()
            near = self._kernel(self._features(*self._completed_readings()) - self._x_mean)
            qpos[7:] += (near @ self._weights)[0]
            qpos[:7] = self._estimate[:7]
            self._estimate = place_root(self._residuals, qpos)
            self._gate.update(self._residuals, self._estimate)
        return Estimate(self._estimate, status)

    def _completed_readings(self) -> tuple[Floats, Floats]:
        """Positions (1, S, 3) and bone orientations (1, S, 4); missing ones are those of the last estimate."""
        residuals, count = self._residuals, len(self._residuals.bones)
        if residuals.measured.all():
            return residuals.target_m[None], residuals.world_from_target[None]
        here, facing = residuals.measured[:count, None], residuals.measured[count:, None]
        residuals.kinematics.set(place_root(residuals, self._estimate))
        at_m, turned = residuals.kinematics.station_poses(
            residuals.bones, residuals.mount_m, _identity_orientations(count)
        )
        position_m = np.where(here, residuals.target_m, at_m)
        return position_m[None], np.where(facing, residuals.world_from_target, turned)[None]

    def _features(self, position_m: Floats, turned: Floats) -> Floats:
        """(N, 9 S) inputs: position [m] and two axes of each station's bone, relative to the anchor's heading."""
        level = rotations.about_z(-rotations.yaw_rad(turned[:, self._anchor]))[:, None]
        flat = position_m[:, self._anchor, None] * [1.0, 1.0, 0.0]
        place = rotations.rotate(level, position_m - flat)
        axes = self._lever_m * rotations.to_matrix(rotations.multiply(level, turned))[..., :2]
        return np.concatenate([place.reshape(len(place), -1), axes.reshape(len(axes), -1)], axis=1)

    def _kernel(self, x: Floats) -> Floats:
        """(M, N) kernel between inputs (M, 9 S) and those of the examples."""
        far = np.sum(x**2, axis=1)[:, None] + np.sum(self._x**2, axis=1) - 2.0 * x @ self._x.T
        out: Floats = np.exp(-far / self._width)
        return out


def _identity_orientations(count: int) -> Floats:
    """(S, 4) identity quaternions."""
    return np.tile(rotations.IDENTITY, (count, 1))
