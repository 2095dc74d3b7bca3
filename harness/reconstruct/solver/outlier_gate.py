"""The outlier gate: it leaves out a position that jumps away from where it must be (docs/notes/traps.md F7).

A robust loss alone cannot reject an echo: under a wide prior the limb simply follows it. A reading jumps when it is far
from two predictions at constant velocity, one of the estimated body and one of the station's own readings. Neither
suffices alone. The body may be late in a punch, and readings that were left out predict nothing.

True motion at 40 Hz is more than 10 cm from its own prediction in 27 of 215,790 readings of CMU's library. So after a
first jump the next reading decides. A punch goes on with the velocity of the jump; an echo goes on with the velocity
before it, at a constant offset (`simulate.components.echo`). Later, the reading is taken again when it is nearer to the
body than to the body plus that offset. When many positions jump at once, the performer has moved; after `patience_s` a
reading is accepted anyway.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.compiled import compiled, specialise
from harness.reconstruct.solver.residuals import Residuals
from harness.reconstruct.solver.status_monitor import DeviceTime
from harness.stream import TrackerFrame

JUMP_M, PATIENCE_S = 0.15, 0.25
"""More than the body departs from a prediction within a period; longer than a burst of echoes (8 records at 40 Hz)."""
_SIGMAS = 3.0
"""Standard deviations of a predicted place by which the next reading may be farther [choice]."""
READING_JUMP_M = 0.10
"""More than readings of true motion depart from their own prediction within a period."""
_MAX_PERIOD_S = 0.1
"""After a longer gap no position is predicted."""


class StationHistory(NamedTuple):
    """The last readings of S stations, and where the last answer has them."""

    position_m: Floats
    """(S, 3) last position [m]."""
    step_m: Floats
    """(S, 3) its difference from the one before [m]."""
    velocity_m_s: Floats
    """(S, 3) velocity before this frame, and during a burst that before the burst [m/s]."""
    has_velocity: Bools
    """(S,) whether that velocity is of two readings in a row; else it is the body's."""
    offset_m: Floats
    """(S, 3) offset of the readings that are left out [m]."""
    left_out: Ints
    """(S,) number of readings that were left out in a row."""
    read_at_s: Floats
    """(S,) time of the last position [s]."""
    accepted_at_s: Floats
    """(S,) time of the last position that was not left out [s]."""
    body_m: Floats
    """(S, 3) positions in the last answer [m]."""
    body_velocity_m_s: Floats
    """(S, 3) velocities to it from the answer before [m/s]."""


class OutlierGate:
    """The outlier gate for the positions of S stations, for one session."""

    def __init__(
        self, stations: int, jump_m: float = JUMP_M, patience_s: float = PATIENCE_S, clock: DeviceTime | None = None
    ) -> None:
        """`clock` is that of the session; without one the gate has its own."""
        self._limits, self._moving, self._updated_at_s = (jump_m, patience_s), False, -np.inf
        never, positions, self._no_offset_s = np.zeros(stations, bool), np.zeros((stations, 3)), np.zeros(stations)
        self._history = StationHistory(
            **{name: positions.copy() for name in ("position_m", "step_m", "velocity_m_s", "offset_m")},
            **{name: positions.copy() for name in ("body_m", "body_velocity_m_s")},
            has_velocity=never.copy(),
            left_out=np.zeros(stations, np.int64),
            read_at_s=np.full(stations, -np.inf),
            accepted_at_s=np.full(stations, -np.inf),
        )
        self._time, self._now_s = clock or DeviceTime(), -np.inf
        arguments = self._limits, positions, never, *(self._no_offset_s,) * 2, self._history, never
        self._judge = specialise(_judge, 0.0, 0.0, False, *arguments)
        self._follow = specialise(_follow, 0.0, positions, self._history)
        self.left_out = False
        """Whether anything was left out of the last frame."""
        self.all_moved = False
        """Whether at least half of the last frame's positions jumped, so that the performer has moved."""
        self.readings, self.rejected = 0, 0
        """Number of positions that were measured in this session, and of those that were left out."""

    def read(self, frame: TrackerFrame, residuals: Residuals, offset_s: Floats | None = None) -> None:
        """Let the residuals read a frame, then leave out the positions that jumped.

        `offset_s` (S,) are the stations' sampling times from the instant that estimates answer [s]; None for 0.
        """
        variance = residuals.variance[: len(residuals.bones)].copy()
        residuals.read(frame)
        self._now_s = self._time.frame_time_s(frame)
        jumped = self.find_jumps(self._now_s, residuals.target_m, frame.position_valid, offset_s, variance)
        count = jumped.tobytes().count(True)
        self.readings += frame.position_valid.tobytes().count(True)
        self.rejected += count
        self.left_out = count > 0
        if self.left_out:
            residuals.leave_out(np.concatenate([jumped, np.zeros_like(jumped)]))

    def update(self, residuals: Residuals, qpos: Floats) -> None:
        """Take the configuration (55,) that answers the frame read last, for the next prediction."""
        residuals.evaluate(qpos)
        self.update_stations(self._now_s, residuals.station_m)

    def find_jumps(
        self,
        now_s: float,
        target_m: Floats,
        measured: Bools,
        offset_s: Floats | None = None,
        variance_m2: Floats | None = None,
    ) -> Bools:
        """(S,) which of the measured positions `target_m` (S, 3), in the world [m], to leave out of this frame.

        The body is predicted at the time now + `offset_s` (S,) of each station [s]. A station may be farther from it
        where its own place was predicted in the frame before, with `variance_m2` (S,).
        """
        out: Bools = np.empty(len(measured), bool)
        self.all_moved = self._judge(
            *(now_s, now_s - self._updated_at_s, self._moving, self._limits),
            *(np.ascontiguousarray(target_m), np.ascontiguousarray(measured)),
            self._no_offset_s if offset_s is None else np.ascontiguousarray(offset_s),
            self._no_offset_s if variance_m2 is None else variance_m2,
            *(self._history, out),
        )
        return out

    def update_stations(self, now_s: float, station_m: Floats) -> None:
        """Take the stations' positions (S, 3) in the answer to this frame [m]."""
        period_s = now_s - self._updated_at_s
        self._moving = 0.0 < period_s <= _MAX_PERIOD_S
        self._follow(period_s if self._moving else np.inf, np.ascontiguousarray(station_m), self._history)
        self._updated_at_s = now_s


@compiled
def _judge(
    now_s: float,
    period_s: float,
    moving: bool,
    limits: tuple[float, float],
    target_m: Floats,
    measured: Bools,
    offset_s: Floats,
    variance_m2: Floats,
    history: StationHistory,
    out: Bools,
) -> bool:
    """Fill in which measured positions (S,) jumped, and not for too long, and take the frame into the history.

    `limits` are the distance of a jump [m], and the patience [s]. Returns whether at least half of the measured
    positions are far from the body's; then none is left out. Nothing jumps unless the body's velocity is known
    (`moving`).
    """
    out[:] = False
    all_moved = False
    if moving and 0.0 < period_s <= _MAX_PERIOD_S:
        far, known = 0, 0
        for s in range(len(out)):
            known += measured[s] or variance_m2[s] > 0.0
            if not measured[s]:
                continue
            if not history.has_velocity[s] and history.left_out[s] == 0:
                history.velocity_m_s[s] = history.body_velocity_m_s[s]
            expected_m = history.body_m[s] + (period_s + offset_s[s]) * history.body_velocity_m_s[s]
            from_body_m = target_m[s] - expected_m
            from_readings_m = target_m[s] - history.position_m[s] - period_s * history.velocity_m_s[s]
            spread_m2 = variance_m2[s] if history.left_out[s] == 0 else 0.0
            is_far = _squared(from_body_m) > limits[0] ** 2 + _SIGMAS**2 * spread_m2
            far += is_far
            if history.left_out[s] == 0:
                follows = _follows(history.read_at_s[s], now_s, period_s)
                out[s] = is_far and not (follows and _squared(from_readings_m) <= READING_JUMP_M**2)
                history.offset_m[s] = from_readings_m if follows else from_body_m
            else:
                in_burst = _squared(from_body_m) > _squared(from_body_m - history.offset_m[s])
                out[s] = in_burst and not _goes_on(target_m[s], s, now_s, period_s, history)
        all_moved = bool(far > 0 and 2 * far >= known)
        for s in range(len(out)):
            out[s] = out[s] and not all_moved and now_s - history.accepted_at_s[s] <= limits[1]
    _record(now_s, period_s, target_m, measured, out, history)
    return all_moved


@compiled
def _follow(period_s: float, station_m: Floats, history: StationHistory) -> None:
    """Take the stations' positions (S, 3) in an answer, `period_s` after the one before; inf for no velocity."""
    for s in range(len(station_m)):
        for i in range(3):
            history.body_velocity_m_s[s, i] = (station_m[s, i] - history.body_m[s, i]) / period_s
            history.body_m[s, i] = station_m[s, i]


@compiled
def _record(
    now_s: float, period_s: float, target_m: Floats, measured: Bools, out: Bools, history: StationHistory
) -> None:
    """Take the measured positions (S, 3) of a frame, of which those `out` (S,) are left out, into the history."""
    for s in range(len(out)):
        if not measured[s]:
            history.has_velocity[s] = False
            continue
        one_motion = history.left_out[s] == 0 or _goes_on(target_m[s], s, now_s, period_s, history)
        history.has_velocity[s] = not out[s] and one_motion and _follows(history.read_at_s[s], now_s, period_s)
        history.step_m[s] = target_m[s] - history.position_m[s]
        history.position_m[s] = target_m[s]
        history.read_at_s[s] = now_s
        if history.has_velocity[s]:
            history.velocity_m_s[s] = history.step_m[s] / period_s
        if out[s]:
            history.left_out[s] += 1
        else:
            history.left_out[s] = 0
            history.accepted_at_s[s] = now_s


@compiled
def _goes_on(target_m: Floats, s: int, now_s: float, period_s: float, history: StationHistory) -> bool:
    """Whether a reading (3,) goes on with the step of the one that was left out first, rather than as before it."""
    step_m = target_m - history.position_m[s]
    as_jumped, as_before = step_m - history.step_m[s], step_m - period_s * history.velocity_m_s[s]
    follows = _follows(history.read_at_s[s], now_s, period_s)
    return bool(history.left_out[s] == 1 and follows and _squared(as_jumped) <= _squared(as_before))


@compiled
def _follows(read_at_s: float, now_s: float, period_s: float) -> bool:
    """Whether the last reading was in the frame before this one."""
    return bool(0.0 < period_s <= _MAX_PERIOD_S and now_s - read_at_s <= 1.5 * period_s)


@compiled
def _squared(vector: Floats) -> float:
    return float(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
