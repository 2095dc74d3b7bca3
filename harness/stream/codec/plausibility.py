"""Whether a body could have moved so: places and turns that nothing could reach since the reading before.

The wire has no checksum, so a damaged number may be a sound one. What is caught here is what lies far from where the
station was. Limits are far above sport (hands and feet stay below 30 m/s, a pitcher's shoulder turns at 7000 to 9000
deg/s, which no IS-900 follows: section 13.1 has 1200), and allow for what the device does by itself: echoes push a
reading aside, and a station that was lost or displaced steps to where it is.
"""

import math

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.stream.codec.readings import Readings

MAX_SPEED_M_S, MAX_STEP_M = 40.0, 1.0
"""Speed, and what a reading may be off besides [m/s, m]."""
MAX_TURN_RATE_RAD_S, MAX_TURN_STEP_RAD = math.radians(4000.0), math.radians(45.0)
"""Likewise for turns [rad/s, rad]."""
_LIMIT_MARGIN = 0.999
"""Of the limits: what is nearer has no need to be looked at one by one."""

_SEQUENTIAL_BELOW = 24
"""So many readings are looked at one by one faster than all at once."""

_StationState = tuple[float, float, tuple[float, ...], tuple[float, ...]]
"""Device time, host time [s], place (3,) [m] and quaternion (4,) of a reading; NaN for what it lacks."""


class PlausibilityCheck:
    """Marks a reading that nobody could reach since the last one believed, unless the next agrees with it: then the
    station really is there. Every decision depends on the readings alone, never on how they came in pieces.

    A lost station, and readings doubtful by themselves, are no evidence.
    """

    def __init__(self, stations: int, period_s: float) -> None:
        self._period_s = period_s
        self._last: list[_StationState | None] = [None] * stations
        """Of each station, the reading that was believed last."""
        self._odd: list[_StationState | None] = [None] * stations
        """The one after it, where it was not."""

    def mark_suspect(self, given: Readings) -> Readings:
        """The same readings, of which those are doubtful too that nobody could reach."""
        usable: Bools = (given.quality > 0.0) & ~given.suspect
        if not usable.any():
            return given
        doubtful: Bools = given.suspect.copy()
        if len(given) <= _SEQUENTIAL_BELOW:
            for row in np.flatnonzero(usable).tolist():
                doubtful[row] = not self._believed(int(given.station[row]), _state_of_row(given, row))
            return given.with_suspect(doubtful)
        for station in np.unique(given.station[usable]).tolist():
            rows = np.flatnonzero(usable & (given.station == station))
            if self._calm(given, rows, station):
                self._last[station] = _state_of_row(given, int(rows[-1]))
                continue
            for row in rows.tolist():
                doubtful[row] = not self._believed(station, _state_of_row(given, row))
        return given.with_suspect(doubtful)

    def _believed(self, station: int, now: _StationState) -> bool:
        last, odd = self._last[station], self._odd[station]
        believed = last is None or self._reachable(last, now) or (odd is not None and self._reachable(odd, now))
        if believed:
            self._last[station], self._odd[station] = now, None
        else:
            self._odd[station] = now
        return believed

    def _reachable(self, before: _StationState, now: _StationState) -> bool:
        elapsed_s = now[0] - before[0]
        if elapsed_s != elapsed_s:  # a stamp is missing: the host may read late, or several at once
            elapsed_s = now[1] - before[1] + 2.0 * self._period_s
        elapsed_s = max(elapsed_s, 0.0)
        moved_m = math.dist(before[2], now[2])
        along = abs(sum(a * b for a, b in zip(before[3], now[3], strict=True)))
        turn_rad = min(MAX_TURN_STEP_RAD + MAX_TURN_RATE_RAD_S * elapsed_s, math.pi)
        return not (moved_m > MAX_STEP_M + MAX_SPEED_M_S * elapsed_s or along < math.cos(0.5 * turn_rad) - 1e-3)

    def _calm(self, given: Readings, rows: Ints, station: int) -> bool:
        """Whether a station's readings (rows) are all believed, for sure; the same as one by one, but fast."""
        last = self._last[station]
        if self._odd[station] is not None or (
            last is not None and not self._reachable(last, _state_of_row(given, int(rows[0])))
        ):
            return False
        elapsed_s = np.diff(given.measured_s[rows])
        untimed = np.isnan(elapsed_s)
        if untimed.any():
            elapsed_s = np.where(untimed, np.diff(given.received_s[rows]) + 2.0 * self._period_s, elapsed_s)
        elapsed_s = np.maximum(elapsed_s, 0.0)
        step_m = np.diff(given.position_m[rows], axis=0)
        turn = given.tracker_from_station[rows]
        along: Floats = np.abs(np.einsum("ij,ij->i", turn[1:], turn[:-1]))
        turn_rad = np.minimum(_LIMIT_MARGIN * (MAX_TURN_STEP_RAD + MAX_TURN_RATE_RAD_S * elapsed_s), np.pi)
        far = np.einsum("ij,ij->i", step_m, step_m) > (_LIMIT_MARGIN * (MAX_STEP_M + MAX_SPEED_M_S * elapsed_s)) ** 2
        return not bool(np.any(far | (along < np.cos(0.5 * turn_rad))))


def _state_of_row(given: Readings, row: int) -> _StationState:
    return (
        float(given.measured_s[row]),
        float(given.received_s[row]),
        tuple(given.position_m[row].tolist()),
        tuple(given.tracker_from_station[row].tolist()),
    )
