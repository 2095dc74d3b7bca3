"""Kernel ridge regression (`kernel_ridge`): one smooth map from readings to posture, learnt from all examples.

A control for the papers' local models (docs/papers.md E): one Gaussian kernel over all examples, no neighbours and no
history. Inputs are the stations' positions and bone orientations, relative to the heading of the station nearest to
the pelvis, so neither place nor heading matters. Without that station's orientation the heading is estimated from the
positions. Readings that a session never has take no part; one that is missing for a while is replaced by its value at
the last estimate. The root is fitted to the trackers afterwards.

Source: Saunders et al. 1998 (kernel ridge regression); noise on the examples' readings (docs/notes/ideas.md G1).

Options (fields of `KernelRidge`): `most_frames` 2000 examples, `ridge` 0.01, `width` 1.4 (kernel width over the RMS
distance of two examples), `lever_m` 0.3 (weight of orientations), and the noise of the examples' readings. They were
chosen on built-in takes that no scenario evaluates.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated, NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Origin
from harness.core.motion import BodyMotion
from harness.core.ranges import Range
from harness.errors import BadInput
from harness.reconstruct.contract import CalibrationCache
from harness.reconstruct.features.posture_statistics import mean_posture
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.features.virtual_trackers import station_poses
from harness.reconstruct.solver.frame_reader import SessionReader
from harness.reconstruct.solver.ground_frame import MIN_HEADING_EXPLAINED, HeadingEstimator, anchor_of, ground_from_qpos
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.stream import TrackerFrame

_JUMP_M = 0.3
"""Outlier gate [m]: wider than for `ik`, since a regressed pose is farther from the readings than a fitted one."""


@dataclass(frozen=True)
class KernelRidge:
    """Options of kernel ridge regression, a `Method`."""

    name: str = "kernel_ridge"
    summary: str = "one smooth map from readings to posture, learnt from all examples at once"
    needs_examples: bool = True
    training_data = "examples"
    most_frames: Annotated[int, Range(2, 1_000_000)] = 2000
    """Largest number of example frames; more are thinned at random."""
    ridge: Annotated[float, Range(1e-12, 1e6)] = 0.01
    """Ridge that is added to the kernel matrix, whose diagonal is 1."""
    width: Annotated[float, Range(1e-06, 1e6)] = 1.4
    """Standard deviation of the kernel, in RMS distances of two examples."""
    lever_m: Annotated[float, Range(1e-06, 100.0)] = 0.3
    """Displacement that counts as much as a rotation of one radian [m]."""
    position_noise_m: Annotated[float, Range(0.0, 10.0)] = 0.004
    """Noise added to the examples' positions on each axis, standard deviation [m]."""
    orientation_noise_rad: Annotated[float, Range(0.0, 10.0)] = 0.01
    """Noise added to the examples' orientations about each axis, standard deviation [rad]."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedKernelRidge":
        """Choose the example frames; BadInput without examples."""
        frames = sum(len(take) for take in examples)
        if frames < 2:
            raise BadInput("Kernel ridge regression needs examples, and there are none.", "Name some in the scenario.")
        kept = np.sort(rng.permutation(frames)[: self.most_frames])
        noise, increments = rng.standard_normal((len(kept), 12, 6)), StationIncrements(body, tuple(examples))
        return FittedKernelRidge(self, body, tuple(examples), kept, noise, increments)


@dataclass(frozen=True, eq=False)
class FittedKernelRidge:
    """The chosen examples. The map depends on the mounts and on the readings, so sessions learn it."""

    options: KernelRidge
    body: Body
    takes: tuple[BodyMotion, ...]
    frames: Ints
    """(N,) indices of the chosen frames among all."""
    noise: Floats
    """(N, 12, 6) standard normal, for the readings of up to twelve stations."""

    increments: StationIncrements
    """How far stations move in a time."""
    maps: "CalibrationCache[ReadingMaps]" = field(default_factory=CalibrationCache, repr=False)
    """Maps of the last calibration, shared by sessions of one performer."""

    def begin(self, calibration: Calibration) -> "KernelRidgeSession":
        return KernelRidgeSession(self, calibration)


class ReadingMap(NamedTuple):
    """Kernel ridge regression of hinges on some of the readings."""

    columns: Bools
    """(9 S,) readings that take part."""
    heading: HeadingEstimator | None
    """Heading from positions; None takes it from the anchor's orientation."""
    mean: Floats
    """(C,) mean of the examples' inputs."""
    inputs: Floats
    """(N, C) the examples' inputs less their mean."""
    width: float
    """Twice the squared width of the kernel."""
    weights: Floats
    """(N, 48) weight of each example for each hinge."""

    def angles(self, inputs: Floats) -> Floats:
        """(M, 48) hinge angles less their mean [rad] for inputs (M, C)."""
        out: Floats = gaussian_kernel(inputs - self.mean, self.inputs, self.width) @ self.weights
        return out


class ReadingMaps:
    """The maps for one calibration, each learnt when a session first has its readings."""

    def __init__(self, fitted: FittedKernelRidge, calibration: Calibration) -> None:
        options, body, count = fitted.options, fitted.body, len(calibration.stations)
        self.count, self.lever_m, self.anchor = count, options.lever_m, anchor_of(calibration.bones)
        self.mean_qpos = mean_posture(body, fitted.takes)
        read = [station_poses(body, take, calibration) for take in fitted.takes]
        position_m, turned = (np.concatenate(parts)[fitted.frames] for parts in zip(*read, strict=True))
        noise, qpos = fitted.noise[:, :count], np.concatenate([take.qpos for take in fitted.takes])[fitted.frames]
        self._examples = (
            position_m + options.position_noise_m * noise[..., :3],
            rotations.multiply(rotations.exp(options.orientation_noise_rad * noise[..., 3:]), turned),
        )
        self._yaw_rad = ground_from_qpos(qpos)[:, 2]
        self._angles = rotations.wrap_angle(qpos[:, 7:] - self.mean_qpos[7:])
        self._options, self._maps = options, dict[bytes, ReadingMap]()

    def learnt(self, measured: Bools) -> ReadingMap:
        """The map for sessions that have had these readings (2 S,) of positions, then orientations; cached."""
        key = measured.tobytes()
        if key not in self._maps:
            self._maps[key] = self._learn(measured)
        return self._maps[key]

    def _learn(self, measured: Bools) -> ReadingMap:
        places, turns = measured[: self.count], measured[self.count :]
        columns = np.repeat(np.stack([places, turns], axis=1).reshape(-1), [3, 6] * self.count)
        heading = None
        if places[self.anchor] and not turns[self.anchor]:
            facing_x = rotations.rotate(rotations.about_z(-self._yaw_rad)[:, None], self._examples[0])
            estimator = HeadingEstimator.fit(facing_x, self.anchor, places)
            heading = estimator if estimator.explained > MIN_HEADING_EXPLAINED else None
        x = self.inputs(*self._examples, columns, heading)
        mean = x.mean(axis=0)
        x = x - mean
        width = 2.0 * self._options.width**2 * 2.0 * float(np.mean(np.sum(x**2, axis=1)))
        factor = cho_factor(gaussian_kernel(x, x, width) + self._options.ridge * np.eye(len(x)))
        return ReadingMap(columns, heading, mean, x, width, cho_solve(factor, self._angles))

    def inputs(self, position_m: Floats, turned: Floats, columns: Bools, heading: HeadingEstimator | None) -> Floats:
        """(N, C) inputs: position [m] and two axes of each station's bone, relative to the anchor's heading."""
        yaw_rad = rotations.yaw_rad(turned[:, self.anchor]) if heading is None else heading.heading_rad(position_m)
        level = rotations.about_z(-yaw_rad)[:, None]
        flat = position_m[:, self.anchor, None] * [1.0, 1.0, 0.0]
        place = rotations.rotate(level, position_m - flat)
        axes = rotations.to_matrix(rotations.multiply(level, turned))[..., :2].reshape(*place.shape[:2], 6)
        both = np.concatenate([place, self.lever_m * axes], axis=2)
        out: Floats = both.reshape(len(both), -1)[:, columns]
        return out


class KernelRidgeSession:
    """Applies the map of the readings that this session has had to each frame."""

    def __init__(self, fitted: FittedKernelRidge, calibration: Calibration) -> None:
        count = len(calibration.stations)
        self._residuals = Residuals(fitted.body, calibration, Loss())
        self._reader = SessionReader(self._residuals, fitted.increments.moments(calibration), _JUMP_M)
        self._maps = fitted.maps.get(calibration, lambda: ReadingMaps(fitted, calibration))
        self._estimate = self._maps.mean_qpos
        self._measured_before = np.zeros(2 * count, bool)
        """(2 S,) positions, then orientations, that this session has had. The others take no part in the map."""

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_valid = self._reader.read(frame)
        if any_valid:
            self._measured_before |= self._residuals.measured
            learnt = self._maps.learnt(self._measured_before)
            position_m, turned = self._residuals.target_m, self._residuals.world_from_target
            if not self._residuals.measured.all():
                position_m, turned = self._residuals.completed(place_root(self._residuals, self._estimate))
            inputs = self._maps.inputs(position_m[None], turned[None], learnt.columns, learnt.heading)
            qpos = self._maps.mean_qpos.copy()
            qpos[7:] += learnt.angles(inputs)[0]
            qpos[:7] = self._estimate[:7]
            self._estimate = place_root(self._residuals, qpos)
            self._reader.update(self._estimate)
        return Estimate(self._estimate, status, Origin.MODEL if any_valid else Origin.BRIDGED)


def gaussian_kernel(x: Floats, examples: Floats, width: float) -> Floats:
    """(M, N) kernel between inputs (M, C) and those of examples (N, C)."""
    far = np.sum(x**2, axis=1)[:, None] + np.sum(examples**2, axis=1) - 2.0 * x @ examples.T
    out: Floats = np.exp(-far / width)
    return out
