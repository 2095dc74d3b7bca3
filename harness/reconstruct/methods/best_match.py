"""The example whose trackers would have read most like the frame, stood where the trackers are.

The plainest method that learns from examples: no blending, no memory, no kinematics after it. Distances are those of
Kim et al. 2012, eq. 2, over positions, velocities and orientations of the stations, after the turn about the
vertical and the horizontal shift that serve each example best; so neither place nor heading matters. A station
counts by its quality; one that is lost is simply left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.errors import BadInput
from harness.reconstruct.features.virtual_trackers import station_poses
from harness.reconstruct.solver.outlier_gate import OutlierGate
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.status_monitor import StatusMonitor
from harness.stream.frame import TrackerFrame

Complexes = NDArray[np.complex128]
"""Horizontal vectors, x + iy."""
_JUMP_M = 0.3
"""An example is never as near as a fitted pose, so the gate stands wider open."""


@dataclass(frozen=True)
class BestMatch:
    """A `Method`."""

    name: str = "best_match"
    summary: str = "the most similar example of all, stood where the trackers are"
    needs_examples: bool = True
    position_weight: float = 0.6
    velocity_weight: float = 0.2
    orientation_weight: float = 0.2
    """Weights of eq. 2, for metres, metres per second and unit quaternions."""
    longest_gap_s: float = 0.2
    """A velocity is taken between readings no farther apart [s]."""

    def fit(self, body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> "FittedBestMatch":
        """BadInput without examples of two frames or more."""
        takes = tuple(take for take in examples if len(take) > 1)
        if not takes:
            raise BadInput("The best match is sought among examples, and there are none.", "Name some in the scenario.")
        return FittedBestMatch(self, body, takes)


@dataclass(frozen=True, eq=False)
class FittedBestMatch:
    """The examples."""

    options: BestMatch
    body: Body
    takes: tuple[BodyMotion, ...]

    def begin(self, calibration: Calibration) -> "BestMatchSession":
        return BestMatchSession(self, calibration)


class BestMatchSession:
    """The search among N frames of examples, whose stations are placed where this calibration wears them."""

    def __init__(self, fitted: FittedBestMatch, calibration: Calibration) -> None:
        self._options = fitted.options
        self._residuals = Residuals(fitted.body, calibration, Loss())
        self._coverage, self._gate = StatusMonitor(), OutlierGate(len(calibration.stations), _JUMP_M)
        self._qpos = np.concatenate([take.qpos for take in fitted.takes])
        read = [station_poses(fitted.body, take, calibration) for take in fitted.takes]
        velocity = [_backward_difference(m) * take.rate_hz for (m, _), take in zip(read, fitted.takes, strict=True)]
        self._position = _StationVectors(np.concatenate([m for m, _ in read]))
        self._velocity = _StationVectors(np.concatenate(velocity))
        self._turned = np.ascontiguousarray(np.concatenate([q for _, q in read]).transpose(1, 2, 0))
        """(S, 4, N) orientations of the bones that carry the stations."""
        self._before: tuple[Floats, Floats, Bools] | None = None
        self._answer = self._qpos[0]

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._coverage.update(frame)
        if any_seen:
            self._gate.read(frame, self._residuals)
            velocity_m_s, moving = self._velocities(frame)
            self._answer = self._nearest(velocity_m_s, moving)
            self._gate.update(self._residuals, self._answer)
        return Estimate(self._answer, status)

    def _velocities(self, frame: TrackerFrame) -> tuple[Floats, Bools]:
        """(S, 3) since the last frame [m/s], and where it is known."""
        here = self._residuals.measured[: len(self._residuals.bones)]
        now = self._residuals.target_m.copy(), frame.measured_s, here
        before, self._before = self._before, now
        if before is None:
            return np.zeros_like(now[0]), np.zeros_like(now[2])
        gap_s = now[1] - before[1]
        known = now[2] & before[2] & (gap_s > 0.0) & (gap_s <= self._options.longest_gap_s)
        return np.where(known[:, None], now[0] - before[0], 0.0) / np.where(known, gap_s, 1.0)[:, None], known

    def _nearest(self, velocity_m_s: Floats, moving: Bools) -> Floats:
        """The best example, turned and shifted (55,).

        Turning an example by y takes Re(e^-iy pull) off its squared distance, so the best y is the angle of `pull`.
        """
        options, count = self._options, len(self._residuals.bones)
        here, facing = self._residuals.confidence[:count], self._residuals.confidence[count:]
        target_m = self._residuals.target_m
        middle_m = np.zeros(3)
        if total := float(here.sum()):
            middle_m[:2] = here @ target_m[:, :2] / total
        far, pull = self._position.against(target_m - middle_m, here, centred=True)
        distance, pull = options.position_weight * far, options.position_weight * pull
        far, velocity_pull = self._velocity.against(velocity_m_s, moving * here, centred=False)
        distance += options.velocity_weight * far
        pull += options.velocity_weight * velocity_pull
        far, orientation_pull = self._orientation(facing)
        distance += options.orientation_weight * far
        pull += options.orientation_weight * orientation_pull
        best = int(np.argmin(distance - np.abs(pull)))
        return self._stood(best, float(np.angle(pull[best])), middle_m, here)

    def _orientation(self, facing: Floats) -> tuple[Floats, Complexes]:
        """Squared distance (N,) of orientations but for the turn, and its pull.

        sin^2 of half the angle between them: min |q -+ p|^2 of eq. 2 to first order, and of period pi in the turn.
        """
        target = np.sqrt(facing)[:, None] * self._residuals.world_from_target
        half_round = rotations.multiply(rotations.about_z(-np.pi), target)
        plain, turned = np.matmul(np.stack([target, half_round], axis=1), self._turned).swapaxes(0, 1)
        plain_plain, turned_turned, plain_turned = (
            np.einsum("sn,sn->n", one, other) for one, other in ((plain, plain), (turned, turned), (plain, turned))
        )
        far: Floats = facing.sum() - 0.5 * (plain_plain + turned_turned)
        pull: Complexes = 0.5 * (plain_plain - turned_turned) + 1j * plain_turned
        return far, pull

    def _stood(self, best: int, yaw_rad: float, target_middle_m: Floats, here: Floats) -> Floats:
        out: Floats = self._qpos[best].copy()
        turn = rotations.about_z(yaw_rad)
        out[3:7] = rotations.multiply(turn, out[3:7])
        if here.any():
            middle = self._position.flat[best] @ here / here.sum()
            middle_m = np.array([middle.real, middle.imag, 0.0])
            out[:3] = rotations.rotate(turn, out[:3] - middle_m) + target_middle_m
        else:  # orientations alone do not say where: stay
            out[:2] = self._answer[:2]
        return out


class _StationVectors:
    """N frames of one vector for each of S stations, compared with a reading up to a turn about the vertical."""

    def __init__(self, vectors: Floats) -> None:
        self.flat: Complexes = vectors[..., 0] + 1j * vectors[..., 1]
        self._up = np.ascontiguousarray(vectors[..., 2])
        self._squares: Floats = np.sum(vectors**2, axis=2)

    def against(self, reading: Floats, trust: Floats, centred: bool) -> tuple[Floats, Complexes]:
        """Squared distance (N,) summed over stations as they are trusted (S,), but for the turn, and its pull.

        `centred` readings have their horizontal mean taken out, and so have the examples, by the same weights.
        """
        seen, total = trust[:, None] * reading, float(trust.sum())
        far = self._squares @ trust + float(np.vdot(seen, reading)) - 2.0 * (self._up @ seen[:, 2])
        if centred and total:
            middle = self.flat @ (trust / total)
            far -= total * (middle.real**2 + middle.imag**2)
        pull: Complexes = (self.flat @ (2.0 * seen[:, 0] - 2.0j * seen[:, 1])).conj()
        return far, pull


def _backward_difference(points_m: Floats) -> Floats:
    """(T, ...) steps up to each frame; the first is taken to be like the second."""
    steps = np.diff(points_m, axis=0)
    return np.concatenate([steps[:1], steps])
