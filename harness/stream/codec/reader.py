"""The whole way from bytes to frames, without input or output: what every source of IS-900 bytes goes through."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.errors import BadInput
from harness.stream.codec.assembler import FrameAssembler
from harness.stream.codec.capture import ByteCapture
from harness.stream.codec.clock import ClockUnwrapper
from harness.stream.codec.decoder import Decoder, DecoderEvent, Garbage, RecordRun, Reply
from harness.stream.codec.items import STANDARD_LIST, STATION_CHARACTERS
from harness.stream.codec.plausibility import PlausibilityCheck
from harness.stream.codec.readings import Readings, decode_readings, has_quality
from harness.stream.codec.records import RecordFormat, Table
from harness.stream.codec.replies import ParsedReply, TrackingStatus, parse_reply
from harness.stream.frame import TrackerFrame


@dataclass(frozen=True)
class WireFormat:
    """What both ends agree on before data flow."""

    stations: tuple[str, ...]
    """Names, in the order of the device's stations."""
    rate_hz: float
    """Records per second of each station."""
    items: tuple[int, ...] = STANDARD_LIST
    """Output list of every station."""
    settings: RecordFormat = field(default_factory=RecordFormat)
    characters: bytes = b""
    """What the stations are called on the wire, ascending; by default the first is `1`, and so on."""

    def __post_init__(self) -> None:
        if not self.characters:
            object.__setattr__(self, "characters", STATION_CHARACTERS[: len(self.stations)])
        if not 1 <= len(self.stations) <= len(STATION_CHARACTERS):
            raise BadInput(f"{len(self.stations)} stations.", f"An IS-900 has 1 to {len(STATION_CHARACTERS)}.")
        if len(set(self.stations)) < len(self.stations):
            raise BadInput(f"Stations {', '.join(self.stations)}: a name twice.", "Each has a name of its own.")
        known = [STATION_CHARACTERS.find(character) for character in self.characters]
        if len(known) != len(self.stations) or min(known) < 0 or known != sorted(set(known)):
            raise BadInput(
                f"Stations {self.characters.decode('latin-1')!r} for {len(self.stations)} names.",
                f"One of {STATION_CHARACTERS.decode()} for each, ascending, as the device reads them.",
            )


class FrameReader:
    """Takes bytes as they come, gives frames as they become complete, and counts what else there was.

    Where the list has no quality (items 40 and 76), a station is lost from a reply to `MP` that says so until one that
    does not.
    """

    def __init__(self, wire: WireFormat) -> None:
        self.wire = wire
        self.records = 0
        self.garbage_bytes = 0
        self.replies: deque[Reply] = deque(maxlen=100)
        """The latest lines that were no data."""
        self._decoder = Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings)
        self._clock = ClockUnwrapper()
        self._motion = PlausibilityCheck(len(wire.stations), 1.0 / wire.rate_hz)
        self._assembler = FrameAssembler(len(wire.stations), 1.0 / wire.rate_hz)
        self._stamped, self._tells_quality = 21 in wire.items, has_quality(wire.items)
        self._lost: Bools | None = None
        """(S,) by the latest reply to `MP`, where records do not tell."""
        self._aside: list[tuple[Table, Floats]] = []
        """Records that cannot complete a frame yet, and when they came."""
        self._row = -1
        """Of the record that came last; -1 when no frame has begun."""
        self._ends: Ints = np.zeros(0, dtype=np.int64)
        """Where the chunks end that undecided bytes came in, counted from the beginning of the stream."""
        self._ends_s: Floats = np.zeros(0)
        self._fed = 0

    @property
    def pending(self) -> int:
        """Bytes that wait for more; a record or a reply at most."""
        return self._decoder.pending

    @property
    def clock_resets(self) -> int:
        """How often the device's clock was set anew."""
        return self._clock.resets

    def feed(self, data: bytes, received_s: float) -> list[TrackerFrame]:
        """The frames that these bytes, received at this moment, complete."""
        return self._feed(data, np.array([len(data)]), np.array([received_s]))

    def feed_all(self, capture: ByteCapture) -> list[TrackerFrame]:
        """The frames of many chunks at once; the same as chunk by chunk."""
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
        """The frame that has waited for its last stations for more than 1.5 periods at this moment (host clock)."""
        began_s = self._assembler.since_s
        if began_s is None and self._aside:
            began_s = float(self._aside[0][1][0])
        return [*self._settle(), *self._assembler.expire(now_s)] if self._assembler.has_waited(began_s, now_s) else []

    def finish(self) -> list[TrackerFrame]:
        """What is left at the end of the stream."""
        return [*self._frames(self._decoder.finish()), *self._settle(), *self._assembler.finish()]

    def _frames(self, events: list[DecoderEvent]) -> list[TrackerFrame]:
        frames: list[TrackerFrame] = []
        for event in events:
            match event:
                case RecordRun():
                    if self._take(event):
                        frames += self._settle()
                case Reply():
                    frames += self._settle()
                    self.replies.append(event)
                    self._heed(parse_reply(event.line))
                case Garbage():
                    self.garbage_bytes += event.size
        return frames

    def _take(self, run: RecordRun) -> bool:
        """Put records aside until they may complete a frame; whether they may."""
        count = len(run.table)
        last_byte = run.offset + run.size * np.arange(1, count + 1)
        self._aside.append((run.table, self._ends_s[self._ends.searchsorted(last_byte)]))
        self.records += count
        before, self._row = self._row, self.wire.characters.index(run.table["station"][-1])
        return count > 1 or self._row <= before or self._row == len(self.wire.stations) - 1

    def _settle(self) -> list[TrackerFrame]:
        """The frames that the records put aside complete: a round of stations at once costs little more than one."""
        if not self._aside:
            return []
        tables, received_s = zip(*self._aside, strict=True)
        self._aside.clear()
        table = tables[0]
        if len(tables) > 1:
            table = np.frombuffer(b"".join(one.tobytes() for one in tables), table.dtype)
        frames = self._assembler.add(self._readings(table, np.concatenate(received_s)))
        if self._assembler.since_s is None:
            self._row = -1
        return frames

    def _heed(self, said: ParsedReply) -> None:
        if isinstance(said, TrackingStatus) and not self._tells_quality:
            self._lost = np.array([character in said.lost for character in self.wire.characters])

    def _readings(self, table: Table, received_s: Floats) -> Readings:
        raw = decode_readings(table, received_s, self.wire.characters, self.wire.settings)
        measured_s = self._clock.unwrap(raw.measured_s, received_s)
        doubtful = raw.suspect | np.isnan(measured_s) if self._stamped else raw.suspect
        quality = raw.quality if self._lost is None else np.where(self._lost[raw.station], 0.0, raw.quality)
        place_m, turn = raw.position_m, raw.tracker_from_station
        return self._motion.mark_suspect(
            Readings(raw.station, received_s, measured_s, place_m, turn, quality, doubtful)
        )


class CaptureStream:
    """A `TrackerStream` over bytes received before."""

    def __init__(self, wire: WireFormat, capture: ByteCapture) -> None:
        self._wire, self._capture, self._closed = wire, capture, False

    @property
    def stations(self) -> tuple[str, ...]:
        return self._wire.stations

    def __iter__(self) -> Iterator[TrackerFrame]:
        reader = FrameReader(self._wire)
        for frame in (*reader.feed_all(self._capture), *reader.finish()):
            if self._closed:
                return
            yield frame

    def close(self) -> None:
        self._closed = True
