"""The complete path from bytes to frames, without input or output. Every source of device bytes uses it."""

from collections import Counter, deque
from dataclasses import dataclass, field, replace

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.core.ranges import Label
from harness.errors import BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec.assembler import FrameAssembler
from harness.stream.polhemus.codec.clock import ClockUnwrapper
from harness.stream.polhemus.codec.datagram import DatagramDecoder
from harness.stream.polhemus.codec.decoder import Decoder, DecoderEvent, Garbage, RecordRun, Reply
from harness.stream.polhemus.codec.items import (
    BLANK_STATUS,
    DEVICE_NAMES,
    FAMILY_STATIONS,
    MOST_DEVICE_HZ,
    POSE_ERRORS,
    STANDARD_LIST,
    STATION_CHARACTERS,
    DeviceFamily,
    position_range_m,
    with_article,
)
from harness.stream.polhemus.codec.plausibility import PlausibilityCheck
from harness.stream.polhemus.codec.readings import Readings, decode_readings, has_quality
from harness.stream.polhemus.codec.records import RecordFormat, Table
from harness.stream.polhemus.codec.replies import ParsedReply, TrackingStatus, parse_reply


@dataclass(frozen=True, eq=False)
class ByteCapture:
    """K consecutive chunks of received bytes."""

    data: bytes
    ends: Ints
    """(K,) number of bytes received up to the end of each chunk."""
    received_s: Floats
    """(K,) host clock when each chunk was received [s]."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, ends=("K",))
        freeze(self, received_s=("K",))


LEAST_RATE_HZ, MOST_RATE_HZ = 1e-3, 1e4
"""Limits of the records per second of a station [choice]."""


@dataclass(frozen=True)
class WireFormat:
    """What both ends of the line agree on before data flow. Raises BadInput where it is contradictory."""

    stations: tuple[str, ...]
    """Station names, in the order of the device's stations."""
    rate_hz: float
    """Records per second of each station."""
    items: tuple[int, ...] = STANDARD_LIST
    """Output list of every station."""
    settings: RecordFormat = field(default_factory=RecordFormat)
    characters: bytes = b""
    """Characters of the stations on the wire, ascending; by default `1` for the first, and so on."""
    zeroed: bool = True
    """Whether the device's clock was set to zero when these records began."""
    datagrams: bool = False
    """Whether UDP packets carry the records, and not a serial line or TCP (docs/is900.md 9)."""
    family: DeviceFamily = "is900"
    """Family of the device."""

    def __post_init__(self) -> None:
        if not self.characters:
            object.__setattr__(self, "characters", STATION_CHARACTERS[: len(self.stations)])
        if self.family not in DEVICE_NAMES:
            raise BadInput(f"Device family {self.family!r} is not known.", f"It is {' or '.join(DEVICE_NAMES)}.")
        device, known = with_article(self.family), FAMILY_STATIONS[self.family]
        if not 1 <= len(self.stations) <= len(known):
            raise BadInput(
                f"{len(self.stations)} stations are not possible.",
                f"{device[0].upper()}{device[1:]} has 1 to {len(known)}.",
            )
        if not LEAST_RATE_HZ <= self.rate_hz <= MOST_RATE_HZ:
            raise BadInput(
                f"{self.rate_hz:g} records per second of each station.",
                f"A device sends {LEAST_RATE_HZ:g} to {MOST_RATE_HZ:g}; {device} up to "
                f"{MOST_DEVICE_HZ[self.family]:g}.",
            )
        for name in self.stations:
            if not Label().accepts(name):
                raise BadInput(f"The station name {name[:100]!r} cannot be used.", f"Give it {Label()}.")
        if len(set(self.stations)) < len(self.stations):
            raise BadInput(f"Stations {', '.join(self.stations)}: a name occurs twice.", "Give each its own name.")
        positions = [known.find(character) for character in self.characters]
        if len(positions) != len(self.stations) or min(positions) < 0 or positions != sorted(set(positions)):
            raise BadInput(
                f"Station characters {self.characters.decode('latin-1')!r} do not fit {len(self.stations)} names.",
                f"Give one of {known.decode()} for each, ascending, as the device reads them.",
            )

    def describe(self) -> str:
        """Return device, rate, list and format in words: `a FASTRAK at 30 Hz, items 2,11,1 in binary`."""
        form = "UDP packets" if self.datagrams else "binary" if self.settings.binary else "ASCII"
        return f"{with_article(self.family)} at {self.rate_hz:.4g} Hz, items {','.join(map(str, self.items))} in {form}"


class ReadingsDecoder:
    """Decodes the records of a session: their numbers, continuous device time, and which of them are suspect."""

    def __init__(self, wire: WireFormat, zeroed_s: float | None = None) -> None:
        """`zeroed_s` is the host time at which the device's clock was set to zero, if known [s]."""
        self._wire, self.clock = wire, ClockUnwrapper(1.0 / wire.rate_hz, zeroed_s)
        self._plausibility = PlausibilityCheck(len(wire.stations), 1.0 / wire.rate_hz)

    def __call__(self, table: Table, received_s: Floats, lost: Bools | None = None) -> tuple[Readings, Floats]:
        """The readings of a table (N,), and their stamps (N,) [s]. `lost` stations (S,) have quality 0."""
        raw = decode_readings(table, received_s, self._wire.characters, self._wire.settings)
        measured_s = self.clock.unwrap(raw.measured_s, received_s, raw.station)
        suspect = raw.suspect | np.isnan(measured_s) if 21 in self._wire.items else raw.suspect
        if errors := POSE_ERRORS[self._wire.family]:
            suspect = suspect | np.isin(table["status"], np.frombuffer(errors, np.uint8))
        quality = raw.quality if lost is None else np.where(lost[raw.station], 0.0, raw.quality)
        readings = replace(raw, measured_s=measured_s, quality=quality, suspect=suspect)
        return self._plausibility.mark_suspect(readings), raw.measured_s


class FrameReader:
    """Converts bytes to frames as they become complete, and counts everything else.

    Where the list has no quality (items 40 and 76), a station is lost from a reply to `MP` that says so until one that
    does not.
    """

    def __init__(self, wire: WireFormat, zeroed_s: float | None = None) -> None:
        """`zeroed_s` is the host time at which the device's clock was set to zero, if known [s]."""
        self.wire = wire
        self.records = 0
        self.out_of_range: Ints = np.zeros(len(wire.stations), dtype=np.int64)
        """(S,) number of records of each station whose position is beyond the range of the list."""
        self.station_records: Counter[str] = Counter()
        """Number of records by station, also of those that are not in the format, whose bytes are garbage."""
        self.device_errors: set[tuple[str, str]] = set()
        """Stations whose records carried an error of a FASTRAK's own tests, each with the error's letter."""
        self.garbage_bytes = 0
        self.other_bytes = 0
        """Garbage that is records of stations that are not in the format [bytes]."""
        self._garbage_end, self._other_station = -1, 0
        self.replies: deque[Reply] = deque(maxlen=100)
        """The latest lines that are not data records."""
        self._decoder = make_decoder(wire)
        self._decode_readings = ReadingsDecoder(wire, zeroed_s)
        self._assembler = FrameAssembler(len(wire.stations), 1.0 / wire.rate_hz)
        self._has_quality = has_quality(wire.items)
        self._lost: Bools | None = None
        """(S,) lost stations by the latest reply to `MP`, where records have no quality."""
        self._deferred: list[tuple[Table, Floats]] = []
        """Records that cannot complete a frame yet, and their host times."""
        self._row = -1
        """Station row of the latest record; -1 when no frame has begun."""
        self._ends: Ints = np.zeros(0, dtype=np.int64)
        """Offsets in the stream at which the chunks with undecided bytes end."""
        self._ends_s: Floats = np.zeros(0)
        self._fed = 0

    @property
    def pending(self) -> int:
        """Number of undecided bytes; at most a record or a reply."""
        return self._decoder.pending

    @property
    def clock_resets(self) -> int:
        """Number of times the device's clock was reset."""
        return self._decode_readings.clock.resets

    def feed(self, data: bytes, received_s: float) -> list[TrackerFrame]:
        """Return the frames that these bytes, received at `received_s` [s], complete."""
        return self._feed(data, np.array([len(data)]), np.array([received_s]))

    def feed_all(self, capture: ByteCapture) -> list[TrackerFrame]:
        """Return the frames that many chunks complete; the result is the same as chunk by chunk."""
        return self._feed(capture.data, capture.ends, capture.received_s)

    def _feed(self, data: bytes, ends: Ints, received_s: Floats) -> list[TrackerFrame]:
        self._ends = np.concatenate([self._ends, self._fed + ends])
        self._ends_s = np.concatenate([self._ends_s, received_s])
        self._fed += len(data)
        frames = self._frames(self._decoder.feed(data))
        decided = int(self._ends.searchsorted(self._fed - self._decoder.pending, side="right"))
        self._ends, self._ends_s = self._ends[decided:], self._ends_s[decided:]
        return frames

    def expire(self, now_s: float) -> list[TrackerFrame]:
        """Return the frame whose first reading is more than 1.5 periods older than `now_s` (host clock) [s]."""
        began_s = self._assembler.since_s
        if began_s is None and self._deferred:
            began_s = float(self._deferred[0][1][0])
        return (
            [*self._process_deferred(), *self._assembler.expire(now_s)]
            if self._assembler.has_timed_out(began_s, now_s)
            else []
        )

    def finish(self) -> list[TrackerFrame]:
        """Return the remaining frame at the end of the stream."""
        return [*self._frames(self._decoder.finish()), *self._process_deferred(), *self._assembler.finish()]

    def _frames(self, events: list[DecoderEvent]) -> list[TrackerFrame]:
        frames: list[TrackerFrame] = []
        for event in events:
            match event:
                case RecordRun():
                    if self._defer(event):
                        frames += self._process_deferred()
                case Reply():
                    frames += self._process_deferred()
                    self.replies.append(event)
                    self._take_reply(parse_reply(event.line))
                case Garbage():
                    self._take_garbage(event)
        return frames

    def _take_garbage(self, garbage: Garbage) -> None:
        self.garbage_bytes += garbage.size
        if garbage.station or garbage.offset != self._garbage_end:
            self._other_station = garbage.station
        self._garbage_end = garbage.offset + garbage.size
        if self._other_station:
            self.other_bytes += garbage.size
        if garbage.station:
            self.station_records[chr(garbage.station)] += 1

    def _defer(self, run: RecordRun) -> bool:
        """Defer records until they may complete a frame; return whether they may."""
        count = len(run.table)
        last_byte = run.offset + run.size * np.arange(1, count + 1)
        self._deferred.append((run.table, self._ends_s[self._ends.searchsorted(last_byte)]))
        self.records += count
        self.station_records.update(map(chr, run.table["station"].tolist()))
        if self.wire.family == "fastrak" and np.any(failed := run.table["status"] != BLANK_STATUS):
            rows = run.table[failed]
            self.device_errors |= set(zip(map(chr, rows["station"]), map(chr, rows["status"]), strict=True))
        previous_row, self._row = self._row, self.wire.characters.index(run.table["station"][-1])
        return count > 1 or self._row <= previous_row or self._row == len(self.wire.stations) - 1

    def _process_deferred(self) -> list[TrackerFrame]:
        """Return the frames that the deferred records complete. Together they cost little more than one record."""
        if not self._deferred:
            return []
        tables, received_s = zip(*self._deferred, strict=True)
        self._deferred.clear()
        table = tables[0]
        if len(tables) > 1:
            table = np.frombuffer(b"".join(part.tobytes() for part in tables), table.dtype)
        frames = self._assembler.add(self._readings(table, np.concatenate(received_s)))
        if self._assembler.since_s is None:
            self._row = -1
        return frames

    def _take_reply(self, reply: ParsedReply) -> None:
        if isinstance(reply, TrackingStatus) and not self._has_quality:
            self._lost = np.array([character in reply.lost for character in self.wire.characters])

    def _readings(self, table: Table, received_s: Floats) -> Readings:
        readings, _ = self._decode_readings(table, received_s, self._lost)
        if position_range_m(self.wire.items):
            beyond = np.isnan(readings.position_m[:, 0]) & (readings.quality > 0.0)
            self.out_of_range += np.bincount(readings.station[beyond], minlength=len(self.wire.stations))
        return readings


def make_decoder(wire: WireFormat) -> Decoder | DatagramDecoder:
    """The decoder of bytes of this format."""
    if wire.datagrams:
        return DatagramDecoder(wire.items, wire.characters)
    return Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings)


class ContinuousFrameReader:
    """Frames of consecutive sessions: host times strictly increase, and device time never steps back.

    Each configuration resets the device's clock. Device time then continues by the host's clock from the first bytes
    that arrive, because a replay knows that moment as exactly as the live driver.
    """

    def __init__(self) -> None:
        self.device_zero_s = 0.0
        """The value of `measured_s` at which the device's own clock is zero [s]."""
        self._reader: FrameReader | None = None
        self._last_frame_s = -np.inf
        """Host time of the last frame [s]."""
        self._is_new = False
        """True until the first bytes after a configuration."""
        self._device_s = 0.0
        """Latest device time of any frame [s]."""
        self._totals = dict.fromkeys(("sessions", "records", "garbage_bytes", "clock_resets", "out_of_range"), 0)
        """Counts of the earlier sessions."""
        self._frames = 0

    @property
    def counts(self) -> dict[str, int]:
        """Numbers of sessions, frames, records, garbage bytes, clock resets and positions beyond the list's range."""
        reader = self._reader
        names = [name for name in self._totals if name != "sessions"]
        current = {} if reader is None else {name: int(np.sum(getattr(reader, name))) for name in names}
        return {"frames": self._frames} | {name: n + current.get(name, 0) for name, n in self._totals.items()}

    @property
    def reader(self) -> FrameReader | None:
        """Reader of the present session; None before the first configuration."""
        return self._reader

    def begin_session(self, wire: WireFormat, now_s: float) -> list[TrackerFrame]:
        """Start a session: later bytes have this format, and the device's clock starts at zero if `wire` says so.

        Returns the unfinished frame of the session before.
        """
        frames = self.finish()
        self._totals["sessions"] += 1
        self._reader, self._is_new = FrameReader(wire, now_s if wire.zeroed else None), True
        return frames

    def feed(self, data: bytes, now_s: float) -> list[TrackerFrame]:
        """Return the frames that these bytes complete; none before the first configuration."""
        return self.feed_all(ByteCapture(data, np.array([len(data)]), np.array([now_s])))

    def feed_all(self, capture: ByteCapture) -> list[TrackerFrame]:
        """Return the frames that one or more chunks complete."""
        if self._reader is None or not len(capture.ends):
            return []
        if self._is_new and self._frames:
            self.device_zero_s = self._device_s + max(float(capture.received_s[0]) - self._last_frame_s, 0.0)
        self._is_new = False
        return self._to_stream_time(self._reader.feed_all(capture))

    def expire(self, now_s: float) -> list[TrackerFrame]:
        """Return the frame that is overdue at `now_s` [s].

        Call it only after a read that found nothing: bytes that a busy host has not read yet must not cost their frame.
        """
        return [] if self._reader is None else self._to_stream_time(self._reader.expire(now_s))

    def finish(self) -> list[TrackerFrame]:
        """End the session and return its unfinished frame."""
        if self._reader is None:
            return []
        frames = self._to_stream_time(self._reader.finish())
        self._totals, self._reader = {name: n for name, n in self.counts.items() if name != "frames"}, None
        return frames

    def _to_stream_time(self, frames: list[TrackerFrame]) -> list[TrackerFrame]:
        """Convert the frames to the time of the whole stream."""
        out = []
        for frame in frames:
            if self.device_zero_s:
                frame = replace(frame, measured_s=frame.measured_s + self.device_zero_s)
            if frame.received_s <= self._last_frame_s:
                frame = replace(frame, received_s=float(np.nextafter(self._last_frame_s, np.inf)))
            self._last_frame_s = frame.received_s
            self._device_s = float(np.fmax.reduce(frame.measured_s, initial=self._device_s))
            out.append(frame)
        self._frames += len(out)
        return out
