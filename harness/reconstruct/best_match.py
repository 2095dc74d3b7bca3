"""The example whose trackers would have read most like the frame, stood where the trackers are.

The plainest method that learns from examples: no blending, no memory, no kinematics after it. Distances are those of
Kim et al. 2012, eq. 2, over positions, velocities and orientations of the stations, after the turn about the
vertical and the horizontal shift that serve each example best; so neither place nor heading matters, and a station
that is lost is simply left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body import kinematics
from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import Take
from harness.errors import BadInput
from harness.reconstruct.coverage import Coverage
from harness.reconstruct.residuals import Loss, Residuals
from harness.stream.frame import TrackerFrame


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

    def fit(self, body: Body, examples: Sequence[Take], rng: np.random.Generator) -> "FittedBestMatch":
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
    takes: tuple[Take, ...]

    def begin(self, calibration: Calibration) -> "BestMatchSession":
        return BestMatchSession(self, calibration)


class BestMatchSession:
    """What the stations would have read in every example, N frames in all, and the search among them."""

    def __init__(self, fitted: FittedBestMatch, calibration: Calibration) -> None:
        self._options = fitted.options
        self._residuals = Residuals(fitted.body, calibration, Loss())
        self._coverage = Coverage()
        self._qpos = np.concatenate([take.qpos for take in fitted.takes])
        read = [_station_poses(fitted.body, take, calibration) for take in fitted.takes]
        velocity = [_since_last(m) * take.rate_hz for (m, _), take in zip(read, fitted.takes, strict=True)]
        self._position_m = np.concatenate([m for m, _ in read])
        self._velocity_m_s = np.concatenate(velocity)
        self._turned = np.concatenate([q for _, q in read])
        self._turned_by_half = rotations.multiply(rotations.about_z(np.pi), self._turned)
        self._before: tuple[Floats, Floats, Bools] | None = None
        self._answer = self._qpos[0]

    def step(self, frame: TrackerFrame) -> Estimate:
        status, any_seen = self._coverage.seen(frame)
        if any_seen:
            self._residuals.read(frame)
            velocity, moving = self._velocity(frame)
            self._answer = self._nearest(velocity, moving)
        return Estimate(self._answer, status)

    def _velocity(self, frame: TrackerFrame) -> tuple[Floats, Bools]:
        """(S, 3) since the last frame [m/s], and where it is known."""
        now = self._residuals.target_m, frame.measured_s, frame.position_valid
        before, self._before = self._before, now
        if before is None:
            return np.zeros_like(now[0]), np.zeros_like(now[2])
        gap_s = now[1] - before[1]
        known = now[2] & before[2] & (gap_s > 0.0) & (gap_s <= self._options.longest_gap_s)
        return (now[0] - before[0]) / np.where(known, gap_s, 1.0)[:, None], known

    def _nearest(self, velocity_m_s: Floats, moving: Bools) -> Floats:
        """The best example, turned and shifted (55,).

        Turning an example by an angle y changes every squared distance by a term in cos y and sin y alone (for
        orientations after 2 - 2 |p q| is replaced by 2 - 2 (p q)^2), so the best y of all N comes in closed form.
        """
        options, count = self._options, len(self._residuals.bones)
        here, facing = self._residuals.measured[:count], self._residuals.measured[count:]
        target_m, target = self._residuals.target_m[here], self._residuals.world_from_target[facing]
        at_m, speed, seen_speed = self._position_m[:, here], self._velocity_m_s[:, moving], velocity_m_s[moving]
        middle_m, target_middle_m = _middle(at_m), _middle(target_m[None])[0]
        flat, target_flat = _complex(at_m - middle_m[:, None]), _complex(target_m - target_middle_m)
        flat_speed, seen_flat_speed = _complex(speed), _complex(seen_speed)
        straight = np.sum(self._turned[:, facing] * target, axis=2)
        half_round = np.sum(self._turned_by_half[:, facing] * target, axis=2)

        pull = options.position_weight * 2.0 * (np.conj(flat) @ target_flat)
        pull = pull + options.velocity_weight * 2.0 * (np.conj(flat_speed) @ seen_flat_speed)
        pull = pull + options.orientation_weight * np.sum((straight + 1j * half_round) ** 2, axis=1)
        yaw = np.angle(pull)
        turn = np.exp(1j * yaw)[:, None]
        likeness = np.cos(0.5 * yaw)[:, None] * straight + np.sin(0.5 * yaw)[:, None] * half_round
        distance = (
            options.position_weight * _squares(turn * flat - target_flat, (at_m - target_m)[..., 2])
            + options.velocity_weight * _squares(turn * flat_speed - seen_flat_speed, (speed - seen_speed)[..., 2])
            + options.orientation_weight * np.sum(2.0 - 2.0 * np.abs(likeness), axis=1)
        )
        best = int(np.argmin(distance))
        return self._stood(best, float(yaw[best]), middle_m[best], target_middle_m, bool(here.any()))

    def _stood(self, best: int, yaw_rad: float, middle_m: Floats, target_middle_m: Floats, anywhere: bool) -> Floats:
        out: Floats = self._qpos[best].copy()
        turn = rotations.about_z(yaw_rad)
        out[3:7] = rotations.multiply(turn, out[3:7])
        if anywhere:
            out[:3] = rotations.rotate(turn, out[:3] - middle_m) + target_middle_m
        else:  # orientations alone do not say where: stay
            out[:2] = self._answer[:2]
        return out


def _station_poses(body: Body, take: Take, worn: Calibration) -> tuple[Floats, Floats]:
    """Positions (T, S, 3) [m] of the stations, and orientations (T, S, 4) of the bones that carry them."""
    start_m, turned = kinematics.bone_poses(body.skeleton, take.qpos)
    bones = [body.skeleton.index(bone) for bone in worn.bones]
    return start_m[:, bones] + rotations.rotate(turned[:, bones], worn.mount_m), turned[:, bones]


def _since_last(points_m: Floats) -> Floats:
    """(T, ...) steps up to each frame; the first is taken to be like the second."""
    steps = np.diff(points_m, axis=0)
    return np.concatenate([steps[:1], steps])


def _middle(points_m: Floats) -> Floats:
    """(N, 3) horizontal mean of points (N, P, 3); heights are left alone, the floor is common to all."""
    out = np.zeros((len(points_m), 3))
    if points_m.shape[1]:
        out[:, :2] = points_m[..., :2].mean(axis=1)
    return out


def _complex(vectors: Floats) -> np.ndarray[tuple[int, ...], np.dtype[np.complex128]]:
    out: np.ndarray[tuple[int, ...], np.dtype[np.complex128]] = vectors[..., 0] + 1j * vectors[..., 1]
    return out


def _squares(flat: np.ndarray[tuple[int, ...], np.dtype[np.complex128]], up: Floats) -> Floats:
    out: Floats = np.sum(np.abs(flat) ** 2 + up**2, axis=1)
    return out
