"""Best match (`best_match`): the most similar example frame, placed where the trackers are.

A baseline: the simplest method that learns from examples, with no blending, no history and no inverse kinematics. For
every example frame the horizontal shift and the rotation about the vertical are found that fit it to the readings best,
so neither place nor heading matters. The frame of least distance is the estimate.

Source: the nearest example of Slyper and Hodgins 2008; the distance is eq. 2 of Kim et al. 2012, over positions,
velocities and orientations of the stations. Ours: the exact minimum over shift and rotation, weights by each station's
quality, and leaving out lost stations.

It has no options.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Origin
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.contract import Fitted
from harness.reconstruct.features.example_features import FeatureWeights
from harness.reconstruct.features.query_features import LONGEST_GAP_ADVICE, LONGEST_GAP_S
from harness.reconstruct.features.station_increments import StationIncrements
from harness.reconstruct.features.virtual_trackers import station_poses
from harness.reconstruct.solver.frame_reader import SessionReader
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.stream import TrackerFrame

Complexes = NDArray[np.complex128]
"""Horizontal vectors as complex numbers, x + i y."""
_JUMP_M = 0.3
"""Outlier gate [m]: wider than for `ik`, since an example is farther from the readings than a fitted pose."""
_WEIGHTS = FeatureWeights()
_FIXED_WEIGHTS = "Leave it out: the weights of eq. 2 are fixed."


@dataclass(frozen=True)
class BestMatch:
    """The best match, a `Method`."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {
        **dict.fromkeys(("position_weight", "velocity_weight", "orientation_weight"), _FIXED_WEIGHTS),
        "longest_gap_s": LONGEST_GAP_ADVICE,
    }

    name: str = "best_match"
    summary: str = "the nearest example frame, placed at the trackers: a baseline"
    needs_examples: bool = True
    training_data = "examples"

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> Fitted["BestMatchSession"]:
        """Keep the examples; BadInput without one of at least two frames."""
        takes = tuple(take for take in examples if len(take) > 1)
        if not takes:
            raise BadInput("The best match needs examples, and there are none.", "Name some in the scenario.")
        return Fitted(partial(BestMatchSession, body, takes, StationIncrements(body, takes)))


class BestMatchSession:
    """Search among N example frames, with station poses for the mounts of a calibration."""

    def __init__(
        self, body: Body, takes: Sequence[BodyMotion], increments: StationIncrements, calibration: Calibration
    ) -> None:
        self._residuals = Residuals(body, calibration, Loss())
        self._reader = SessionReader(self._residuals, increments.moments(calibration), _JUMP_M)
        self._qpos = np.concatenate([take.qpos for take in takes])
        read = [station_poses(body, take, calibration) for take in takes]
        velocity = [_backward_difference(m) * take.rate_hz for (m, _), take in zip(read, takes, strict=True)]
        self._position = _StationVectors(np.concatenate([m for m, _ in read]))
        self._velocity = _StationVectors(np.concatenate(velocity))
        self._turned = np.ascontiguousarray(np.concatenate([q for _, q in read]).transpose(1, 2, 0))
        """(S, 4, N) orientations of the bones that carry the stations."""
        self._before: tuple[Floats, Floats, Bools] | None = None
        self._estimate = self._qpos[0]

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_valid = self._reader.read(frame)
        if any_valid:
            velocity_m_s, moving = self._velocities(frame)
            self._estimate = self._nearest(velocity_m_s, moving)
            self._reader.update(self._estimate)
        return Estimate(self._estimate, status, Origin.MODEL if any_valid else Origin.BRIDGED)

    def _velocities(self, frame: TrackerFrame) -> tuple[Floats, Bools]:
        """(S, 3) velocities since the last frame [m/s], and (S,) where they are has_velocity."""
        measured = self._residuals.measured[: len(self._residuals.bones)]
        now = self._residuals.target_m.copy(), frame.measured_s, measured
        before, self._before = self._before, now
        if before is None:
            return np.zeros_like(now[0]), np.zeros_like(now[2])
        gap_s = now[1] - before[1]
        has_velocity = now[2] & before[2] & (gap_s > 0.0) & (gap_s <= LONGEST_GAP_S)
        return np.where(has_velocity[:, None], now[0] - before[0], 0.0) / np.where(has_velocity, gap_s, 1.0)[
            :, None
        ], has_velocity

    def _nearest(self, velocity_m_s: Floats, moving: Bools) -> Floats:
        """The nearest example, rotated and shifted to the readings (55,).

        Rotating an example by y lowers its squared distance by Re(e^-iy pull), so the best y is the angle of `pull`.
        """
        count = len(self._residuals.bones)
        position_confidence, orientation_confidence = (
            self._residuals.confidence[:count],
            self._residuals.confidence[count:],
        )
        target_m = self._residuals.target_m
        middle_m = np.zeros(3)
        if total := float(position_confidence.sum()):
            middle_m[:2] = position_confidence @ target_m[:, :2] / total
        squared, pull = self._position.compare(target_m - middle_m, position_confidence, centred=True)
        distance, pull = _WEIGHTS.position * squared, _WEIGHTS.position * pull
        squared, velocity_pull = self._velocity.compare(velocity_m_s, moving * position_confidence, centred=False)
        distance += _WEIGHTS.velocity * squared
        pull += _WEIGHTS.velocity * velocity_pull
        squared, orientation_pull = self._orientation(orientation_confidence)
        distance += _WEIGHTS.orientation * squared
        pull += _WEIGHTS.orientation * orientation_pull
        best = int(np.argmin(distance - np.abs(pull)))
        return self._placed_example(best, float(np.angle(pull[best])), middle_m, position_confidence)

    def _orientation(self, orientation_confidence: Floats) -> tuple[Floats, Complexes]:
        """Squared distance (N,) of orientations without the rotation about the vertical, and its `pull` (N,).

        The distance is sin^2 of half the angle: min |q -+ p|^2 of eq. 2 to first order, with period pi in the rotation.
        """
        target = np.sqrt(orientation_confidence)[:, None] * self._residuals.world_from_target
        half_round = rotations.multiply(rotations.about_z(-np.pi), target)
        plain, turned = np.matmul(np.stack([target, half_round], axis=1), self._turned).swapaxes(0, 1)
        plain_plain, turned_turned, plain_turned = (
            np.einsum("sn,sn->n", a, b) for a, b in ((plain, plain), (turned, turned), (plain, turned))
        )
        squared: Floats = orientation_confidence.sum() - 0.5 * (plain_plain + turned_turned)
        pull: Complexes = 0.5 * (plain_plain - turned_turned) + 1j * plain_turned
        return squared, pull

    def _placed_example(
        self, best: int, yaw_rad: float, target_middle_m: Floats, position_confidence: Floats
    ) -> Floats:
        """(55,) an example rotated about the vertical and shifted to the readings' weighted mean."""
        out: Floats = self._qpos[best].copy()
        turn = rotations.about_z(yaw_rad)
        out[3:7] = rotations.multiply(turn, out[3:7])
        if position_confidence.any():
            middle = self._position.flat[best] @ position_confidence / position_confidence.sum()
            middle_m = np.array([middle.real, middle.imag, 0.0])
            out[:3] = rotations.rotate(turn, out[:3] - middle_m) + target_middle_m
        else:  # orientations alone give no position: keep the last one
            out[:2] = self._estimate[:2]
        return out


class _StationVectors:
    """Vectors of S stations in N frames, compared with readings up to a rotation about the vertical."""

    def __init__(self, vectors: Floats) -> None:
        self.flat: Complexes = vectors[..., 0] + 1j * vectors[..., 1]
        self._up = np.ascontiguousarray(vectors[..., 2])
        self._squares: Floats = np.sum(vectors**2, axis=2)

    def compare(self, reading: Floats, confidence: Floats, centred: bool) -> tuple[Floats, Complexes]:
        """Squared distance (N,), weighted by the stations' confidence (S,), without the rotation, and its `pull` (N,).

        With `centred` the readings have no horizontal mean, and the examples' weighted mean is removed as well.
        """
        seen, total = confidence[:, None] * reading, float(confidence.sum())
        squared = self._squares @ confidence + float(np.vdot(seen, reading)) - 2.0 * (self._up @ seen[:, 2])
        if centred and total:
            middle = self.flat @ (confidence / total)
            squared -= total * (middle.real**2 + middle.imag**2)
        pull: Complexes = (self.flat @ (2.0 * seen[:, 0] - 2.0j * seen[:, 1])).conj()
        return squared, pull


def _backward_difference(points_m: Floats) -> Floats:
    """(T, ...) difference to the frame before; the first equals the second."""
    steps = np.diff(points_m, axis=0)
    return np.concatenate([steps[:1], steps])
