"""Plausibility check: marks positions and orientations that no body could reach since the previous reading.

The wire has no checksum, so a damaged number may look sound. This check finds numbers that are far from the station's
last pose. Its limits are far above sport: hands and feet stay below 30 m/s. A pitcher's shoulder turns at 7000 to 9000
deg/s, which no IS-900 follows (docs/is900.md 13.1: 1200 deg/s). They also allow for what the device does by itself:
echoes displace a reading, and a station that was lost or displaced jumps to its true pose.
"""

import math

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.stream.polhemus.codec.readings import Readings

MAX_SPEED_M_S, MAX_STEP_M = 40.0, 1.0
"""Greatest speed, and the error that a reading may have in addition [m/s, m]."""
MAX_TURN_RATE_RAD_S, MAX_TURN_STEP_RAD = math.radians(4000.0), math.radians(45.0)
"""Greatest turn rate, and the error that a reading may have in addition [rad/s, rad]."""
_LIMIT_MARGIN = 0.999
"""Share of the limits below which the vectorised check is certain; readings above it are checked one by one."""

_SEQUENTIAL_BELOW = 24
"""Up to this many readings are checked faster one by one than all at once."""

_StationState = tuple[float, float, tuple[float, ...], tuple[float, ...]]
"""Device time, host time [s], position (3,) [m] and quaternion (4,) of a reading; NaN where missing."""


class PlausibilityCheck:
    """Marks a reading that the station could not reach since the last accepted one, unless the next reading agrees.

    If it agrees, the station really is there. Every decision depends on the readings alone, never on how they were
    split into chunks. Readings of a lost station, and readings that are already suspect, are ignored.
    """

    def __init__(self, stations: int, period_s: float) -> None:
        self._period_s = period_s
        self._last: list[_StationState | None] = [None] * stations
        """The reading that was accepted last, for each station."""
        self._rejected: list[_StationState | None] = [None] * stations
        """The rejected reading after it, for each station; None when there is none."""

    def mark_suspect(self, readings: Readings) -> Readings:
        """Return the readings, with unreachable ones marked as suspect."""
        usable: Bools = (readings.quality > 0.0) & ~readings.suspect
        if not usable.any():
            return readings
        suspect: Bools = readings.suspect.copy()
        if len(readings) <= _SEQUENTIAL_BELOW:
            for row in np.flatnonzero(usable).tolist():
                suspect[row] = not self._accept(int(readings.station[row]), _state_of_row(readings, row))
            return readings.with_suspect(suspect)
        for station in np.unique(readings.station[usable]).tolist():
            rows = np.flatnonzero(usable & (readings.station == station))
            if self._all_plausible(readings, rows, station):
                self._last[station] = _state_of_row(readings, int(rows[-1]))
                continue
            for row in rows.tolist():
                suspect[row] = not self._accept(station, _state_of_row(readings, row))
        return readings.with_suspect(suspect)

    def _accept(self, station: int, current: _StationState) -> bool:
        last, rejected = self._last[station], self._rejected[station]
        accepted = (
            last is None
            or self._reachable(last, current)
            or (rejected is not None and self._reachable(rejected, current))
        )
        if accepted:
            self._last[station], self._rejected[station] = current, None
        else:
            self._rejected[station] = current
        return accepted

    def _reachable(self, previous: _StationState, current: _StationState) -> bool:
        elapsed_s = current[0] - previous[0]
        if elapsed_s != elapsed_s:  # a stamp is missing; the host may read late, or several records at once
            elapsed_s = current[1] - previous[1] + 2.0 * self._period_s
        elapsed_s = max(elapsed_s, 0.0)
        distance_m = math.dist(previous[2], current[2])
        cosine = abs(sum(a * b for a, b in zip(previous[3], current[3], strict=True)))
        turn_rad = min(MAX_TURN_STEP_RAD + MAX_TURN_RATE_RAD_S * elapsed_s, math.pi)
        return not (distance_m > MAX_STEP_M + MAX_SPEED_M_S * elapsed_s or cosine < math.cos(0.5 * turn_rad) - 1e-3)

    def _all_plausible(self, readings: Readings, rows: Ints, station: int) -> bool:
        """Whether all readings (rows) of a station are certainly accepted.

        The result is that of checking one by one, but faster.
        """
        last = self._last[station]
        if self._rejected[station] is not None or (
            last is not None and not self._reachable(last, _state_of_row(readings, int(rows[0])))
        ):
            return False
        elapsed_s = np.diff(readings.measured_s[rows])
        unstamped = np.isnan(elapsed_s)
        if unstamped.any():
            elapsed_s = np.where(unstamped, np.diff(readings.received_s[rows]) + 2.0 * self._period_s, elapsed_s)
        elapsed_s = np.maximum(elapsed_s, 0.0)
        displacement_m = np.diff(readings.position_m[rows], axis=0)
        quaternion = readings.tracker_from_station[rows]
        cosine: Floats = np.abs(np.einsum("ij,ij->i", quaternion[1:], quaternion[:-1]))
        turn_rad = np.minimum(_LIMIT_MARGIN * (MAX_TURN_STEP_RAD + MAX_TURN_RATE_RAD_S * elapsed_s), np.pi)
        too_far = (
            np.einsum("ij,ij->i", displacement_m, displacement_m)
            > (_LIMIT_MARGIN * (MAX_STEP_M + MAX_SPEED_M_S * elapsed_s)) ** 2
        )
        return not bool(np.any(too_far | (cosine < np.cos(0.5 * turn_rad))))


def _state_of_row(readings: Readings, row: int) -> _StationState:
    return (
        float(readings.measured_s[row]),
        float(readings.received_s[row]),
        tuple(readings.position_m[row].tolist()),
        tuple(readings.tracker_from_station[row].tolist()),
    )
