"""Features of a frame's readings, as `ExampleFeatures` has them for examples, and the confidence in each.

The anchor's own orientation gives the heading. Where it was not measured, the root of the last estimate is fitted to
the readings and the missing values are taken from it. Their confidence is 0, so they only propose candidates in the
search (`index.exact`).
"""

import math

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.calibration import Calibration
from harness.core.compiled import compiled
from harness.reconstruct.features.example_features import ExampleFeatures, Query
from harness.reconstruct.solver.ground_frame import AnchorFrame
from harness.reconstruct.solver.residuals import Residuals
from harness.reconstruct.solver.root_placement import place_root
from harness.reconstruct.solver.status_monitor import DeviceTime
from harness.stream import TrackerFrame

LONGEST_GAP_S = 0.2
"""Longest time between two readings or examples from which a velocity is computed [s]."""
LONGEST_GAP_ADVICE = f"Leave it out: velocities are computed over at most {LONGEST_GAP_S:g} s."
"""For `RENAMED_KEYS` of methods, where it was an option."""


Reading = tuple[Floats, Floats, Bools]
"""Positions (S, 3) [m], their times (S,) [s], and where they were measured: (S,) or more, of which S count."""


class QueryFeatures:
    """Computes the features of each frame of a session."""

    def __init__(
        self, residuals: Residuals, calibration: Calibration, examples: ExampleFeatures, clock: DeviceTime | None = None
    ) -> None:
        """`clock` is that of the session; without one the features have their own."""
        count = len(calibration.stations)
        self._residuals, self._examples = residuals, examples
        self._before: Reading = np.zeros((count, 3)), np.full(count, np.nan), np.zeros(count, bool)
        self._time = clock or DeviceTime()
        self._shown_m, self._shown_s = np.zeros((count, 3)), -np.inf
        """(S, 3) positions of the last query, measured or filled in, and its time by the device's clock [s]."""

    def compute(self, frame: TrackerFrame, last_qpos: Floats) -> Query:
        """The query of a frame; the last estimate (55,) supplies missing values.

        The velocity of a station without a reading is that of its filled-in positions. A station that reports again
        has no velocity, and neither has any station at the start or after a gap.
        """
        residuals, examples = self._residuals, self._examples
        velocity_m_s, moving = np.empty_like(self._before[0]), np.empty_like(self._before[2])
        complete, all_moving = _estimate_velocities(
            *((residuals.target_m, frame.measured_s, residuals.measured), self._before, velocity_m_s, moving)
        )
        position_m, turned = residuals.target_m, residuals.world_from_target
        facing = turned[examples.anchor]
        if not complete:
            position_m, turned = residuals.completed(place_root(residuals, last_qpos))
            facing = turned[examples.anchor]
        now_s = self._time.frame_time_s(frame)
        gap_s = now_s - self._shown_s
        filled = 0.0 < gap_s <= LONGEST_GAP_S
        if not all_moving:
            if filled:
                velocity_m_s[~moving] = (position_m[~moving] - self._shown_m[~moving]) / gap_s
            filled = filled and bool((moving | ~residuals.measured[: len(moving)]).all())
        self._shown_m[:] = position_m
        self._shown_s = now_s
        w, _, _, z = facing.tolist()
        x_m, y_m, _ = position_m[examples.anchor].tolist()
        view = AnchorFrame(x_m, y_m, 2.0 * math.atan2(z, w))
        query, confidence = _compute_features(
            *((position_m, turned, velocity_m_s), view, examples.hemisphere, examples.scale),
            *(residuals.confidence, moving),
        )
        return Query(view, query, confidence, filled)


@compiled
def _estimate_velocities(now: Reading, before: Reading, velocity_m_s: Floats, has_velocity: Bools) -> tuple[bool, bool]:
    """Compute velocities (S, 3) since the last frame [m/s], 0 where unknown, and where they are known (S,), in place.

    Returns whether everything was measured, and whether all velocities are known. The frame is then stored as the last
    one (`before`).
    """
    target_m, measured_s, measured = now
    before_m, before_s, before_valid = before
    for s in range(len(target_m)):
        gap_s = measured_s[s] - before_s[s]
        has_velocity[s] = measured[s] and before_valid[s] and 0.0 < gap_s <= LONGEST_GAP_S
        for i in range(3):
            velocity_m_s[s, i] = (target_m[s, i] - before_m[s, i]) / gap_s if has_velocity[s] else 0.0
            before_m[s, i] = target_m[s, i]
        before_s[s], before_valid[s] = measured_s[s], measured[s]
    return bool(measured.all()), bool(has_velocity.all())


@compiled
def _compute_features(
    readings: tuple[Floats, Floats, Floats],
    view: AnchorFrame,
    hemisphere: Floats,
    scale: Floats,
    reading_confidence: Floats,
    moving: Bools,
) -> tuple[Floats, Floats]:
    """The features (10 S,) of positions (S, 3), bone orientations (S, 4) and velocities (S, 3), and their confidence.

    `reading_confidence` (2 S,) is that of positions, then orientations; velocities also need `moving` (S,).
    """
    position_m, turned, velocity_m_s = readings
    x_m, y_m, yaw_rad = view
    count = len(position_m)
    out, confidence = np.empty(10 * count), np.empty(10 * count)
    cosine, sine = np.cos(yaw_rad), np.sin(yaw_rad)
    c, s = np.cos(0.5 * yaw_rad), np.sin(0.5 * yaw_rad)
    for k in range(count):
        at, turn, rate = 3 * k, 3 * count + 4 * k, 7 * count + 3 * k
        x, y = position_m[k, 0] - x_m, position_m[k, 1] - y_m
        out[at], out[at + 1], out[at + 2] = cosine * x + sine * y, cosine * y - sine * x, position_m[k, 2]
        x, y = velocity_m_s[k, 0], velocity_m_s[k, 1]
        out[rate], out[rate + 1], out[rate + 2] = cosine * x + sine * y, cosine * y - sine * x, velocity_m_s[k, 2]
        q, sign = turned[k], 0.0
        out[turn], out[turn + 1] = c * q[0] + s * q[3], c * q[1] + s * q[2]  # about_z(-yaw) q
        out[turn + 2], out[turn + 3] = c * q[2] - s * q[1], c * q[3] - s * q[0]
        for i in range(4):
            sign += out[turn + i] * hemisphere[k, i]
        for i in range(4):
            out[turn + i] *= np.copysign(1.0, sign)
        confidence[at : at + 3], confidence[turn : turn + 4] = reading_confidence[k], reading_confidence[count + k]
        confidence[rate : rate + 3] = reading_confidence[k] * moving[k]
    return out * scale, confidence
