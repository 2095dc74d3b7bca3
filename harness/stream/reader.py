"""The whole way from bytes to frames, without input or output: what every source of IS-900 bytes goes through."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.errors import BadInput
from harness.stream.assemble import Assembler
from harness.stream.capture import Capture
from harness.stream.clock import Unwrapper
from harness.stream.decoder import Decoder, Event, Garbage, Records, Reply
from harness.stream.frame import TrackerFrame
from harness.stream.items import STANDARD_LIST, STATION_CHARACTERS
from harness.stream.readings import Readings, readings
from harness.stream.records import Settings


@dataclass(frozen=True)
class WireFormat:
    """What both ends agree on before data flow."""

    stations: tuple[str, ...]
    """Names, in the order of the device's stations."""
    rate_hz: float
    """Records per second of each station."""
    items: tuple[int, ...] = STANDARD_LIST
    """Output list of every station."""
    settings: Settings = field(default_factory=Settings)
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
    """Takes bytes as they come, gives frames as they become complete, and counts what else there was."""

    def __init__(self, wire: WireFormat) -> None:
        self.wire = wire
        self.records = 0
        self.garbage_bytes = 0
        self.replies: deque[Reply] = deque(maxlen=100)
        """The latest lines that were no data."""
        self._decoder = Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings)
        self._clock = Unwrapper()
        self._assembler = Assembler(len(wire.stations), 1.0 / wire.rate_hz)
        self._stamped = 21 in wire.items
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
        return self.feed_all(Capture(data, np.array([len(data)]), np.array([received_s])))

    def feed_all(self, capture: Capture) -> list[TrackerFrame]:
        """The frames of many chunks at once; the same as chunk by chunk."""
        self._ends = np.concatenate([self._ends, self._fed + capture.ends])
        self._ends_s = np.concatenate([self._ends_s, capture.received_s])
        self._fed += len(capture.data)
        frames = self._frames(self._decoder.feed(capture.data))
        decided = int(np.searchsorted(self._ends, self._fed - self._decoder.pending, side="right"))
        self._ends, self._ends_s = self._ends[decided:], self._ends_s[decided:]
        return frames

    def expire(self, now_s: float) -> list[TrackerFrame]:
        """The frame that has waited for its last stations for more than 1.5 periods at this moment (host clock)."""
        return self._assembler.expire(now_s)

    def finish(self) -> list[TrackerFrame]:
        """What is left at the end of the stream."""
        return [*self._frames(self._decoder.finish()), *self._assembler.finish()]

    def _frames(self, events: list[Event]) -> list[TrackerFrame]:
        frames: list[TrackerFrame] = []
        for event in events:
            match event:
                case Records():
                    frames += self._assembler.add(self._readings(event))
                case Reply():
                    self.replies.append(event)
                case Garbage():
                    self.garbage_bytes += event.size
        return frames

    def _readings(self, run: Records) -> Readings:
        count = len(run.table)
        self.records += count
        last_byte = run.offset + run.size * np.arange(1, count + 1)
        received_s = self._ends_s[np.searchsorted(self._ends, last_byte)]
        raw = readings(run.table, received_s, self.wire.characters, self.wire.settings)
        measured_s = self._clock.unwrap(raw.measured_s, received_s)
        return replace(raw, measured_s=measured_s, doubtful=raw.doubtful | (np.isnan(measured_s) & self._stamped))


class CaptureStream:
    """A `TrackerStream` over bytes received before."""

    def __init__(self, wire: WireFormat, capture: Capture) -> None:
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
