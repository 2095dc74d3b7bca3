"""Assembly of records into frames: one row per station, in station order."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.stream.frame import TrackerFrame, split_frames
from harness.stream.polhemus.codec.clock import TimeOrder
from harness.stream.polhemus.codec.readings import Readings, concatenate_readings

TIMEOUT_PERIODS = 1.5
"""A frame that lacks stations is closed after this many periods."""
_SEQUENTIAL_BELOW = 24
"""Up to this many readings are split faster one by one than all at once."""
_NEVER = -np.inf


@dataclass(frozen=True)
class _RoundState:
    """The stamps, host times and stations with which the next reading is compared."""

    first_s: float = _NEVER
    """Stamp of the first reading of this round of stations [s]."""
    first_station: int = 0
    """Station of that reading."""
    previous_s: float = _NEVER
    """Stamp of the previous reading [s]."""
    host_first_s: float = _NEVER
    """Host time of the first reading of this round, used where stamps are missing [s]."""
    host_first_station: int = 0
    """Station of that reading."""
    seen: int = 0
    """Stations of the latest frame, one bit each."""
    seen_before: int = 0
    """Stations of the frame before it, one bit each."""


class FrameAssembler:
    """Closes a frame when the station number does not increase, when every station is present, or after 1.5 periods.

    By the device's clock, a reading a period or more after the first of its frame belongs to the next frame. Where
    stamps are missing, the host's clock and 1.5 periods serve instead. A station number that does not increase in the
    middle of a period, or a stamp that steps back, shows a damaged record. The readings on both sides are then suspect,
    since either may be the wrong one. A time that does not advance is removed. Where stamps are missing, a station that
    is silent in round after round is no sign of damage. A reading that is already `suspect` stays so.
    """

    def __init__(self, stations: int, period_s: float) -> None:
        self._stations = stations
        self._period_s = period_s
        self._open: Readings | None = None
        """Readings of the unfinished frame."""
        self._round, self._round_after = _RoundState(), _RoundState()
        """State before and after those readings."""
        self._order = TimeOrder()
        self._received_s = _NEVER
        """When the latest closed frame was complete (host clock) [s]."""

    @property
    def since_s(self) -> float | None:
        """When the first reading of the unfinished frame arrived (host clock) [s]; None when there is none."""
        return None if self._open is None else float(self._open.received_s[0])

    def add(self, new_readings: Readings) -> list[TrackerFrame]:
        """Return the frames that these readings complete."""
        if len(new_readings) == 0:
            return []
        readings = new_readings if self._open is None else concatenate_readings([self._open, new_readings])
        frame, suspect = self._split_whole_rounds(readings) or self._split(readings)
        readings = readings.with_suspect(suspect)
        open_from = int(np.searchsorted(frame, frame[-1]))
        if len(readings) - open_from == self._stations:
            open_from, self._round = len(readings), self._round_after
        self._open = readings[open_from:] if open_from < len(readings) else None
        return self._frames(readings[:open_from], frame[:open_from])

    def expire(self, now_s: float) -> list[TrackerFrame]:
        """Return the unfinished frame if its first reading arrived more than 1.5 periods before `now_s`.

        `now_s` is a time of the host clock [s].
        """
        return self.finish() if self.has_timed_out(self.since_s, now_s) else []

    def has_timed_out(self, since_s: float | None, now_s: float) -> bool:
        """Whether a frame that began at `since_s` has waited 1.5 periods for its last stations."""
        return since_s is not None and now_s - since_s > TIMEOUT_PERIODS * self._period_s

    def finish(self) -> list[TrackerFrame]:
        """Return the unfinished frame."""
        readings, self._open, self._round = self._open, None, self._round_after
        return [] if readings is None else self._frames(readings, np.zeros(len(readings), dtype=np.int64))

    def _split_whole_rounds(self, readings: Readings) -> tuple[Ints, Bools] | None:
        """The result of `_split` for rounds without a gap or a doubt, all at once; None for any other readings."""
        count, size, state = len(readings), self._stations, self._round
        if count <= _SEQUENTIAL_BELOW or not np.array_equal(readings.station, np.arange(count) % size):
            return None
        stamp_s, first_s = readings.measured_s, readings.measured_s[::size]
        round_s = np.diff(first_s, prepend=state.first_s)
        in_order = np.all(np.diff(stamp_s, prepend=state.previous_s) >= 0.0)
        on_time = np.all(stamp_s - np.repeat(first_s, size)[:count] < self._period_s)
        apart = round_s[0] >= self._shortest_gap_s(state.first_station, 0)
        if not (in_order and on_time and apart and np.all(round_s[1:] >= self._shortest_gap_s(0, 0))):
            return None  # also where a stamp is NaN
        last, everyone = size * (len(first_s) - 1), (1 << size) - 1
        before = last - size  # where the last round but one begins; there are at least two rounds
        seen_before = everyone if before > 0 else state.seen
        begins_s, host_s = stamp_s.item, readings.received_s.item
        self._round = _RoundState(begins_s(before), 0, begins_s(last - 1), host_s(before), 0, everyone, seen_before)
        seen = (1 << (count - last)) - 1
        self._round_after = _RoundState(begins_s(last), 0, begins_s(count - 1), host_s(last), 0, seen, everyone)
        return np.arange(count) // size, readings.suspect.copy()

    def _split(self, readings: Readings) -> tuple[Ints, Bools]:
        """Return the frame (N,) of each reading, counted from 0, and which readings (N,) are suspect.

        A reading may become suspect here because of its neighbours.
        """
        frame, suspect = np.zeros(len(readings), dtype=np.int64), readings.suspect.copy()
        state = self._round
        first_s, first_station, previous_s = state.first_s, state.first_station, state.previous_s
        host_first_s, host_first_station = state.host_first_s, state.host_first_station
        seen, seen_before = state.seen, state.seen_before
        previous_station, filled, number, frame_began_s = self._stations, self._stations, -1, _NEVER
        rows = zip(readings.station.tolist(), readings.measured_s.tolist(), readings.received_s.tolist(), strict=True)
        for i, (station, stamp_s, received_s) in enumerate(rows):
            elapsed_s = stamp_s - first_s
            unstamped = elapsed_s != elapsed_s  # NaN: a stamp is missing
            increases, steps_back = station > previous_station, stamp_s < previous_s
            # Too early: the station number does not increase, but the next round cannot have begun yet.
            if unstamped:
                # The host may read late, so time alone is no evidence: the round must also be incomplete and differ
                # from the round before it.
                differs = 0 < seen_before != seen < (1 << self._stations) - 1
                shortest_s = self._shortest_gap_s(host_first_station, station)
                too_early = not increases and differs and received_s - host_first_s < shortest_s
            else:
                too_early = not increases and elapsed_s < self._shortest_gap_s(first_station, station)
            if too_early or steps_back:
                suspect[i] = True
                if filled < self._stations:
                    suspect[i - 1] = True
            if unstamped:
                too_late = received_s - frame_began_s > TIMEOUT_PERIODS * self._period_s
            else:
                too_late = elapsed_s >= self._period_s
            starts_frame = too_late or not increases
            if starts_frame:
                self._round = _RoundState(
                    first_s, first_station, previous_s, host_first_s, host_first_station, seen, seen_before
                )
                number, filled, frame_began_s, seen, seen_before = number + 1, 0, received_s, 0, seen
            if steps_back or first_s != first_s or (starts_frame and not too_early):
                first_s, first_station = stamp_s, station
            if starts_frame and not too_early:
                host_first_s, host_first_station = received_s, station
            if stamp_s == stamp_s:
                previous_s = stamp_s
            previous_station, filled, seen = station, filled + 1, seen | 1 << station
            frame[i] = number
        self._round_after = _RoundState(
            first_s, first_station, previous_s, host_first_s, host_first_station, seen, seen_before
        )
        return frame, suspect

    def _shortest_gap_s(self, first: int, station: int) -> float:
        """Shortest time from the first reading of a round to a station of the next round, if all slots are as long as
        possible [s].
        """
        slots_between = max(first - station, 0) + 0.5
        return (1.0 - slots_between / self._stations) * self._period_s

    def _frames(self, readings: Readings, frame: Ints) -> list[TrackerFrame]:
        """Build whole frames from readings (N,), whose frame numbers `frame` (N,) run from 0 without gaps."""
        if len(readings) == 0:
            return []
        count, index = int(frame[-1]) + 1, (frame, readings.station)

        def to_frames(column: Floats | Bools, *width: int, missing: float = np.nan) -> Floats:
            out = np.full((count, self._stations, *width), missing)
            out[index] = column
            return out

        measured_s = self._order.enforce(readings.measured_s, readings.station)
        suspect = readings.suspect | (np.isnan(measured_s) & ~np.isnan(readings.measured_s))
        usable = readings.quality > 0.0
        position_valid = usable & np.isfinite(readings.position_m).all(axis=1)
        with np.errstate(invalid="ignore", over="ignore"):
            length = np.sqrt(np.sum(readings.tracker_from_station**2, axis=1))
            orientation_valid = usable & (length > 0.5) & (length < 2.0)
            quaternion = readings.tracker_from_station / length[:, None]
        columns = (
            self._received_times_s(readings, frame).tolist(),
            to_frames(measured_s),
            to_frames(np.where(position_valid[:, None], readings.position_m, np.nan), 3),
            to_frames(np.where(orientation_valid[:, None], quaternion, np.nan), 4),
            to_frames(position_valid, missing=0.0) > 0.0,
            to_frames(orientation_valid, missing=0.0) > 0.0,
            to_frames(readings.quality, missing=0.0),
            to_frames(suspect, missing=0.0) > 0.0,
        )
        return split_frames(*columns)

    def _received_times_s(self, readings: Readings, frame: Ints) -> Floats:
        """Time of the last reading of each frame (F,) [s]; strictly increasing, if only by one rounding step."""
        last = np.append(np.flatnonzero(np.diff(frame)), len(frame) - 1)
        out: Floats = np.maximum.accumulate(readings.received_s[last])
        with np.errstate(invalid="ignore"):  # times of a damaged recording may be infinite
            increases = bool(np.all(np.diff(out, prepend=self._received_s) > 0.0))
        if increases:
            self._received_s = float(out[-1])
            return out
        for i, received_s in enumerate(out.tolist()):
            if received_s <= self._received_s:
                out[i] = np.nextafter(self._received_s, np.inf)
            self._received_s = float(out[i])
        return out
