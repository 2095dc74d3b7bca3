"""Continuous device time from stamps of a clock that may be set to zero at any time and may be damaged.

Stamps are 32-bit floats in milliseconds (docs/is900.md 8), so their resolution degrades with the time since `MZ`: 0.001
ms after 10 s, 0.25 ms after an hour, 8 ms after a day. Nothing can restore it; setting the clock to zero again prevents
it.
"""

import numpy as np

from harness.core.arrays import Floats, Ints

CLOCK_TOLERANCE_S = 0.25
"""Delays of the host's reading vary by less than this, and no sound record is further out of sequence [s]."""
AHEAD_SHARE = 0.25
"""Share of a period by which a station's stamp may be early [choice]. It covers the jitter of a device and a rate that
is known to 10 %."""
MAX_STAMP_S = 1e7
"""Stamps beyond this are damaged: 32-bit milliseconds have a step of one second there [s]."""

MAX_RATE_DIFFERENCE = 1e-3
"""The host's and the device's clock differ in rate by less than this share; crystals differ by 1e-4 [choice]."""

_FIRST_CHUNK = 32
"""Number of records in the first chunk that is checked at once; each further chunk is twice as long."""

_Moment = tuple[float, float]
"""Device time and host time of a record [s]."""


class ClockUnwrapper:
    """Converts stamps to seconds that continue where the clock was set back.

    A stamp is ahead when it has advanced since its station's last stamp by more than a period and by more than the
    host's clock, unless other records were read as soon after their stamps: then the host read the last one late. A
    stamp that is ahead, or that steps back by more than `CLOCK_TOLERANCE_S`, is damaged (NaN), unless the next stamp
    agrees with it. Time then goes on, or it continues by the host's clock where the device has reset its own. A smaller
    step back is returned as it is, since the stamp before it may be the wrong one; `TimeOrder` removes it.
    """

    def __init__(self, period_s: float, zeroed_s: float | None = None) -> None:
        """`period_s` is the time between two rounds of stations [s].

        `zeroed_s` is the host time at which the device's clock was set to zero, if known [s].
        """
        self._period_s, self._zeroed_s = period_s, zeroed_s
        self._epoch_s = 0.0
        """Offset added to stamps [s]."""
        self._last: _Moment | None = None
        """The accepted record with the latest time, unwrapped."""
        self._last_of: dict[int, _Moment] = {}
        """The last accepted record of each station, unwrapped."""
        self._rejected: _Moment | None = None
        """The latest record with its raw stamp, if it was not accepted."""
        self._least_lag_s = np.inf
        """Least `_lag_s` of the accepted records, which is that of the records that were read at once [s]."""
        self.resets = 0
        """Number of times the clock was reset."""

    def unwrap(self, stamp_s: Floats, received_s: Floats, station: Ints) -> Floats:
        """Return continuous device time (N,) for stamps (N,) of station rows (N,), received at host times (N,) [s].

        NaN stands for damaged stamps.
        """
        out: Floats = np.empty(len(stamp_s))
        start, count = 0, _FIRST_CHUNK
        while start < len(out):
            rows = slice(start, start + count)
            out[rows] = self._unwrap_chunk(stamp_s[rows], received_s[rows], station[rows])
            start, count = start + count, 2 * count
        return out

    def _unwrap_chunk(self, stamp_s: Floats, received_s: Floats, station: Ints) -> Floats:
        out: Floats = stamp_s + self._epoch_s
        if self._all_sound(out, received_s, station):
            for row in np.unique(station).tolist():
                at = int(np.flatnonzero(station == row)[-1])
                self._last_of[row] = float(out[at]), float(received_s[at])
            self._last = float(out[-1]), float(received_s[-1])
            self._least_lag_s = min(self._least_lag_s, float(np.min(_lag_s(out, received_s))))
            return out
        for i, record in enumerate(zip(stamp_s.tolist(), received_s.tolist(), station.tolist(), strict=True)):
            out[i] = self._unwrap_one(*record)
        return out

    def _all_sound(self, now_s: Floats, received_s: Floats, station: Ints) -> bool:
        """Whether all records (N,) are certainly accepted. The result is that of one by one, but faster."""
        if self._last is None or self._rejected is not None or len(now_s) < 2:
            return False
        if not bool(np.all(np.diff(now_s, prepend=self._last[0]) >= 0.0)):
            return False
        for row in np.unique(station).tolist():
            rows, own = np.flatnonzero(station == row), self._last_of.get(row)
            if own is None:
                return False
            device_s, host_s = np.diff(now_s[rows], prepend=own[0]), np.diff(received_s[rows], prepend=own[1])
            if not bool(np.all(device_s < np.maximum(host_s, self._period_s) + AHEAD_SHARE * self._period_s)):
                return False
        return True

    def _unwrap_one(self, stamp_s: float, received_s: float, station: int) -> float:
        if not 0.0 <= stamp_s < MAX_STAMP_S:
            return float("nan")
        now = stamp_s + self._epoch_s, received_s
        agrees = self._rejected is not None and self._follows(self._rejected, (stamp_s, received_s))
        if self._last is None:
            return (
                self._accept(now, station) if agrees or self._may_be_first(now) else self._reject(stamp_s, now, station)
            )
        if self._last[0] - CLOCK_TOLERANCE_S < now[0] < self._last[0]:
            return now[0]
        if self._follows(self._last, now, self._last_of.get(station)):
            return self._accept(now, station)
        if not agrees:
            return self._reject(stamp_s, now, station)
        expected_s = max(self._last[0] + received_s - self._last[1], float(np.nextafter(self._last[0], np.inf)))
        if abs(now[0] - expected_s) >= CLOCK_TOLERANCE_S:
            self._epoch_s = expected_s - stamp_s
            self.resets += 1
            now = expected_s, received_s
        self._last_of.clear()
        return self._accept(now, station)

    def _may_be_first(self, now: _Moment) -> bool:
        """Whether this may be the first stamp: the clock cannot be ahead of the time since it was set to zero."""
        return self._zeroed_s is None or now[0] < now[1] - self._zeroed_s + CLOCK_TOLERANCE_S

    def _follows(self, previous: _Moment, current: _Moment, own: _Moment | None = None) -> bool:
        """Whether a record may follow the previous one of any station, and the last of its own station if given."""
        device_s, host_s = (a - b for a, b in zip(current, own or previous, strict=True))
        if device_s >= max(host_s, self._period_s) + AHEAD_SHARE * self._period_s:
            return own is not None and previous[0] <= current[0] and self._is_read_late(current)
        return previous[0] <= current[0]

    def _is_read_late(self, now: _Moment) -> bool:
        """Whether other records were read as soon after their stamps, so that this stamp is not ahead."""
        return bool(_lag_s(*now) >= self._least_lag_s - AHEAD_SHARE * self._period_s)

    def _accept(self, now: _Moment, station: int) -> float:
        self._last, self._last_of[station], self._rejected = now, now, None
        self._least_lag_s = min(self._least_lag_s, float(_lag_s(*now)))
        return now[0]

    def _reject(self, stamp_s: float, now: _Moment, station: int) -> float:
        self._rejected = stamp_s, now[1]
        self._last_of.pop(station, None)  # the wrong one may be the station's last, which the host may have read late
        return float("nan")


def _lag_s(measured_s: Floats | float, received_s: Floats | float) -> Floats | float:
    """Host time minus device time, by a host's clock that is certainly the slower one [s]."""
    return (1.0 - MAX_RATE_DIFFERENCE) * received_s - measured_s


class TimeOrder:
    """Removes device times that do not advance, so that time never steps back: after a wrong time it waits.

    Stations of one round may report the same time, in the order of their rows.
    """

    def __init__(self) -> None:
        self._last_s, self._station = -np.inf, -1

    def enforce(self, measured_s: Floats, station: Ints) -> Floats:
        """Return the times (N,) of readings of station rows (N,), with NaN where a time does not advance [s]."""
        step_s = np.diff(measured_s, prepend=self._last_s)
        if bool(np.all((step_s > 0.0) | ((step_s == 0.0) & (np.diff(station, prepend=self._station) > 0)))):
            self._last_s, self._station = float(measured_s[-1]), int(station[-1])
            return measured_s
        return np.array([self._next(*now) for now in zip(measured_s.tolist(), station.tolist(), strict=True)])

    def _next(self, measured_s: float, station: int) -> float:
        if measured_s > self._last_s or (measured_s == self._last_s and station > self._station):
            self._last_s, self._station = measured_s, station
            return measured_s
        return float("nan")
