"""How far stations move in a time: second moments of their increments over the examples, all stations jointly.

The increment of station s over an age a is D_s(a) = x_s(t - a) - x_s(t): of its position [m], and the rotation vector
of its bone [rad]. Moments E[D D^T] are kept for ages of whole steps: one period of the examples at 40 Hz, more at
higher rates, so that the ages reach as far back as readings are kept. Examples of a slower tracker are interpolated by
cubic splines. Both horizontal axes share one table, so that no heading counts; the vertical axis has its own.
`solver.reading_prediction` predicts with them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.reconstruct.contract import CalibrationCache
from harness.reconstruct.database.frames import TakeSegment
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.features.virtual_trackers import VirtualTrackers
from harness.reconstruct.solver.ground_frame import qpos_from_postures
from harness.reconstruct.solver.reading_prediction import (
    AGES,
    NEWEST_AGE,
    OLDEST_AGE,
    OLDEST_S,
    IncrementMoments,
    unlearnt_moments,
)

_SAMPLE = 4000
"""Largest number of frames whose increments are averaged, evenly spaced [choice]."""
_LEAST_RATE_HZ = 40.0
"""Rate from which on examples tell ages finely enough; slower ones are interpolated [Hz]."""
_FEWEST = 40
"""Fewest such frames; with fewer, the moments are those of no examples [choice]."""


@dataclass(frozen=True, eq=False)
class StationIncrements:
    """Moments of increments for the mounts of a calibration; those of the last calibration are kept."""

    body: Body
    examples: Sequence[BodyMotion] | MotionDatabase
    _cache: CalibrationCache[IncrementMoments] = field(default_factory=CalibrationCache, repr=False)

    def moments(self, calibration: Calibration) -> IncrementMoments:
        """The moments for the stations of a calibration; without enough examples, `unlearnt_moments`."""
        return self._cache.get(calibration, lambda: self._learn(calibration))

    def _learn(self, calibration: Calibration) -> IncrementMoments:
        trackers, stations = VirtualTrackers(self.body, calibration), len(calibration.stations)
        total, count = np.zeros((4, stations * AGES, stations * AGES)), 0
        rate_hz = _rate_hz(self.examples)
        factor = max(1, math.ceil(_LEAST_RATE_HZ / rate_hz - 1e-9)) if rate_hz else 1
        step = max(1, math.ceil(OLDEST_S * factor * rate_hz / OLDEST_AGE - 1e-9))
        for qpos, now in _sampled_runs(self.examples, step, factor):
            at_m, turned = _upsampled(*trackers.station_poses(qpos), factor)
            before = now[:, None] - step * np.arange(-NEWEST_AGE, OLDEST_AGE + 1)
            moved = at_m[before] - at_m[now][:, None]  # (N, A, S, 3)
            turn = rotations.log(rotations.multiply(turned[before], rotations.inverse(turned[now])[:, None]))
            for channel, increments in ((0, moved), (2, turn)):
                rows = increments.transpose(3, 0, 2, 1).reshape(3, len(now), -1)
                total[channel] += 0.5 * (rows[0].T @ rows[0] + rows[1].T @ rows[1])
                total[channel + 1] += rows[2].T @ rows[2]
            count += len(now)
        if count < _FEWEST:
            return unlearnt_moments(stations)
        return IncrementMoments((total / count).reshape(4, stations, AGES, stations, AGES), step / (factor * rate_hz))


def _rate_hz(examples: Sequence[BodyMotion] | MotionDatabase) -> float:
    """The rate of the examples [Hz]; 0 without any."""
    if isinstance(examples, MotionDatabase):
        return examples.rate_hz
    return examples[0].rate_hz if examples else 0.0


def _sampled_runs(
    examples: Sequence[BodyMotion] | MotionDatabase, step: int, factor: int
) -> Iterator[tuple[Floats, Ints]]:
    """Configurations (T, 55) and rows of sampled frames of each take that is long enough; `step` frames between ages.

    The rows have all ages within the take.
    """
    if isinstance(examples, MotionDatabase):
        lengths = [factor * (len(segment) - 1) + 1 for segment in examples.segments]
    else:
        lengths = [factor * (len(take) - 1) + 1 for take in examples]
    stride = max(1, sum(max(length - (AGES - 1) * step, 0) for length in lengths) // _SAMPLE)
    for at, length in enumerate(lengths):
        now = np.arange(OLDEST_AGE * step, length - NEWEST_AGE * step, stride, dtype=np.int64)
        if not len(now):
            continue
        if isinstance(examples, MotionDatabase):
            yield _segment_qpos(examples, examples.segments[at]), now
            examples.release_memory()
        else:
            yield examples[at].qpos, now


def _upsampled(at_m: Floats, turned: Floats, factor: int) -> tuple[Floats, Floats]:
    """Positions (T, S, 3) and orientations (T, S, 4) at `factor` times the rate, by cubic splines."""
    if factor == 1:
        return at_m, turned
    rows = np.arange(len(at_m))
    fine = np.arange(factor * (len(at_m) - 1) + 1) / factor
    turn = CubicSpline(rows, rotations.continuous(turned))(fine)
    return CubicSpline(rows, at_m)(fine), turn / np.linalg.norm(turn, axis=-1, keepdims=True)


def _segment_qpos(database: MotionDatabase, segment: TakeSegment) -> Floats:
    """Configurations (T, 55) of a segment, from the origin on: the steps between its frames added up."""
    rows = slice(segment.start, segment.stop)
    step = database.step[rows].astype(float)
    yaw = np.cumsum(step[:, 2])
    before = np.concatenate([[0.0], yaw[:-1]])
    cosine, sine = np.cos(before), np.sin(before)
    x = np.cumsum(cosine * step[:, 0] - sine * step[:, 1])
    y = np.cumsum(sine * step[:, 0] + cosine * step[:, 1])
    return qpos_from_postures(database.posture[rows], np.stack([x, y, yaw], axis=1))
