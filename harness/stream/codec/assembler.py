"""Records into frames: one row per station, in station order."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.stream.codec.readings import Readings, concatenate_readings
from harness.stream.frame import TrackerFrame

TIMEOUT_PERIODS = 1.5
"""A frame that lacks stations is closed after so many periods."""
_NEVER = -np.inf


@dataclass(frozen=True)
class _RoundState:
    """What the device's clock leads to expect of the next reading."""

    began_s: float = _NEVER
    """Stamp of the first reading of this round of stations."""
    first: int = 0
    """Its station."""
    before_s: float = _NEVER
    """Stamp of the reading before."""
    arrived_s: float = _NEVER
    """Host time of the first reading of this round [s]."""
    led: int = 0
    """Its station, where stamps are missing."""
    heard: int = 0
    """Stations of the latest frame, a bit each."""
    heard_before: int = 0
    """Those of the one before."""


class FrameAssembler:
    """Closes a frame when the station number does not increase, at once when every station is there, or after
    1.5 periods.

    A reading a period or more after the first of its frame, by the device's clock, belongs to the next one (by the
    host's clock 1.5 periods, where stamps are missing). A station number that does not increase in the middle of a
    period, or a stamp that steps back, shows a damaged record: the readings on both sides are suspect, since either
    may be the wrong one. Where stamps are missing the host's clock serves, and a station that is silent round after
    round is no sign of damage. So is one that is `doubtful` by itself.
    """

    def __init__(self, stations: int, period_s: float) -> None:
        self._stations = stations
        self._period_s = period_s
        self._open: Readings | None = None
        """The beginning of a frame."""
        self._round, self._after = _RoundState(), _RoundState()
        """As it was before and after that beginning."""
        self._received_s = _NEVER
        """When the frame that was closed last was complete."""

    @property
    def since_s(self) -> float | None:
        """When the first reading of the unfinished frame came (host clock); None where none has begun."""
        return None if self._open is None else float(self._open.received_s[0])

    def add(self, more: Readings) -> list[TrackerFrame]:
        """The frames that these readings complete."""
        if len(more) == 0:
            return []
        given = more if self._open is None else concatenate_readings([self._open, more])
        frame, doubtful = self._cut(given)
        given = given.with_suspect(doubtful)
        open_from = int(np.searchsorted(frame, frame[-1]))
        if len(given) - open_from == self._stations:
            open_from, self._round = len(given), self._after
        self._open = given[open_from:] if open_from < len(given) else None
        return self._frames(given[:open_from], frame[:open_from])

    def expire(self, now_s: float) -> list[TrackerFrame]:
        """The unfinished frame, if its first reading came more than 1.5 periods before `now_s` (host clock)."""
        return self.finish() if self.has_waited(self.since_s, now_s) else []

    def has_waited(self, since_s: float | None, now_s: float) -> bool:
        """Whether a frame that began then has waited long enough for its last stations."""
        return since_s is not None and now_s - since_s > TIMEOUT_PERIODS * self._period_s

    def finish(self) -> list[TrackerFrame]:
        """The unfinished frame."""
        given, self._open, self._round = self._open, None, self._after
        return [] if given is None else self._frames(given, np.zeros(len(given), dtype=np.int64))

    def _cut(self, given: Readings) -> tuple[Ints, Bools]:
        """The frame of each reading (N,), from 0, and which ones (N,) are doubtful after a look at their neighbours."""
        frame, doubtful = np.zeros(len(given), dtype=np.int64), given.suspect.copy()
        began_s, first, before_s = self._round.began_s, self._round.first, self._round.before_s
        led_s, led = self._round.arrived_s, self._round.led
        heard, heard_before = self._round.heard, self._round.heard_before
        station_before, filled, number, arrived_s = self._stations, self._stations, -1, _NEVER
        rows = zip(given.station.tolist(), given.measured_s.tolist(), given.received_s.tolist(), strict=True)
        for i, (station, stamp_s, received_s) in enumerate(rows):
            elapsed_s = stamp_s - began_s
            untimed = elapsed_s != elapsed_s  # NaN: a stamp is missing
            increases, back = station > station_before, stamp_s < before_s
            if untimed:  # the host may read late: only a round of other stations than the one before is amiss
                amiss = 0 < heard_before != heard < (1 << self._stations) - 1
                early = not increases and amiss and received_s - led_s < self._shortest_s(led, station)
            else:
                early = not increases and elapsed_s < self._shortest_s(first, station)
            if early or back:
                doubtful[i] = True
                if filled < self._stations:
                    doubtful[i - 1] = True
            late = received_s - arrived_s > TIMEOUT_PERIODS * self._period_s if untimed else elapsed_s >= self._period_s
            opens = late or not increases
            if opens:
                self._round = _RoundState(began_s, first, before_s, led_s, led, heard, heard_before)
                number, filled, arrived_s, heard, heard_before = number + 1, 0, received_s, 0, heard
            if back or began_s != began_s or (opens and not early):
                began_s, first = stamp_s, station
            if opens and not early:
                led_s, led = received_s, station
            if stamp_s == stamp_s:
                before_s = stamp_s
            station_before, filled, heard = station, filled + 1, heard | 1 << station
            frame[i] = number
        self._after = _RoundState(began_s, first, before_s, led_s, led, heard, heard_before)
        return frame, doubtful

    def _shortest_s(self, first: int, station: int) -> float:
        """From a reading of one station to the next round's of another, were all slots as long as they may be."""
        slots_between = max(first - station, 0) + 0.5
        return (1.0 - slots_between / self._stations) * self._period_s

    def _frames(self, given: Readings, frame: Ints) -> list[TrackerFrame]:
        """Whole frames of readings (N,), of which `frame` (N,) tells the frame of each, from 0 without gaps."""
        if len(given) == 0:
            return []
        count, at = int(frame[-1]) + 1, (frame, given.station)

        def spread(column: Floats | Bools, *width: int, missing: float = np.nan) -> Floats:
            out = np.full((count, self._stations, *width), missing)
            out[at] = column
            return out

        usable = given.quality > 0.0
        placed = usable & np.isfinite(given.position_m).all(axis=1)
        with np.errstate(invalid="ignore", over="ignore"):
            length = np.sqrt(np.sum(given.tracker_from_station**2, axis=1))
            turned = usable & (length > 0.5) & (length < 2.0)
            turn = given.tracker_from_station / length[:, None]
        columns = (
            self._receptions_s(given, frame).tolist(),
            spread(given.measured_s),
            spread(np.where(placed[:, None], given.position_m, np.nan), 3),
            spread(np.where(turned[:, None], turn, np.nan), 4),
            spread(placed, missing=0.0) > 0.0,
            spread(turned, missing=0.0) > 0.0,
            spread(given.quality, missing=0.0),
            spread(given.suspect, missing=0.0) > 0.0,
        )
        return [TrackerFrame(*row) for row in zip(*columns, strict=True)]

    def _receptions_s(self, given: Readings, frame: Ints) -> Floats:
        """When the last reading of each frame came (F,); frames of one chunk follow each other by the least step."""
        last = np.append(np.flatnonzero(np.diff(frame)), len(frame) - 1)
        out = np.maximum.accumulate(given.received_s[last])
        for i, received_s in enumerate(out.tolist()):
            if received_s <= self._received_s:
                out[i] = np.nextafter(self._received_s, np.inf)
            self._received_s = float(out[i])
        return out
