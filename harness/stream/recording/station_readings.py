"""Readings of a recording, station by station and record by record, in pieces of bounded size.

Frames leave out what a measurement of the device needs: records that came twice, and stamps as they were sent. The
readings here are decoded as those of frames are, by the same decoder, clock and plausibility check. Damaged parts of a
file are skipped, and named by `CaptureReader.damage`.
"""

import math
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from harness.core.arrays import Bools, Floats, freeze
from harness.errors import BadFile
from harness.stream.polhemus.codec.decoder import Garbage, RecordRun
from harness.stream.polhemus.codec.reader import ReadingsDecoder, WireFormat, make_decoder
from harness.stream.polhemus.codec.readings import Readings, concatenate_readings
from harness.stream.poses.pose_log import BodyPoses
from harness.stream.recording.block_content import EXPECTED_FILE, block_content, wire_format_of
from harness.stream.recording.blocks import CONFIGURED, MARK, NOTE, RECEIVED, RecordingBlock, scan_blocks
from harness.stream.recording.recording import describe_damage, open_recording

BLOCK_S = 600.0
"""Length of a piece [s]: ten minutes of twelve stations at 120 Hz take some 90 MB."""
_BATCH_BYTES = 1 << 20
"""Received bytes that are decoded together."""


@dataclass(frozen=True, eq=False)
class StationReadings:
    """N records of one station, in the order of arrival."""

    received_s: Floats
    """(N,) host clock when the last byte arrived [s]."""
    measured_s: Floats
    """(N,) device clock, continuous as in frames [s]; NaN where the stamp is missing or damaged. For a FASTRAK, which
    has no clock, `arrival_times_s`."""
    stamp_s: Floats
    """(N,) stamp as it was sent [s]; NaN where it is missing."""
    position_m: Floats
    """(N, 3) position in the tracker's frame [m]; NaN where not valid."""
    tracker_from_station: Floats
    """(N, 4) unit quaternions; NaN where not valid."""
    quality: Floats
    """(N,) tracking quality, 0 (lost) to 1."""
    suspect: Bools
    """(N,) whether there is evidence against the record."""

    def __post_init__(self) -> None:
        freeze(self, received_s=("N",))
        count = len(self.received_s)
        freeze(self, measured_s=(count,), stamp_s=(count,), quality=(count,))
        freeze(self, position_m=(count, 3), tracker_from_station=(count, 4))
        freeze(self, np.bool_, suspect=(count,))

    def __len__(self) -> int:
        return len(self.received_s)

    def select(self, rows: slice | Bools) -> "StationReadings":
        """The records of some rows."""
        return StationReadings(*(getattr(self, field.name)[rows] for field in fields(self)))

    @staticmethod
    def of_body(body: BodyPoses) -> "StationReadings":
        """The poses of a log, whose clock is both the device's and the host's; quality 1."""
        time_s, count = body.times_s, len(body.times_s)
        turn = body.quaternions
        return StationReadings(time_s, time_s, time_s, body.positions_m, turn, np.ones(count), np.zeros(count, bool))

    @staticmethod
    def join(parts: Sequence["StationReadings"]) -> "StationReadings":
        """The records of one or more parts, one after another."""
        columns = (np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(StationReadings))
        return StationReadings(*columns)


@dataclass(frozen=True, eq=False)
class CaptureBlock:
    """A piece of a capture between two marks or configurations of the device, at most `block_s` long."""

    stretch: str
    """Name of the latest mark; "" before the first one and after a mark that ends a stretch."""
    session: int
    """Number of the configuration of the device, from 0."""
    wire: WireFormat
    configured_s: float
    """Host clock when the session was configured [s]; the device's clock is zero there if `wire.zeroed`."""
    stations: Mapping[str, StationReadings]
    garbage_bytes: int
    """Bytes that belong to no record and no reply."""

    @property
    def records(self) -> int:
        """Number of records of all stations."""
        return sum(map(len, self.stations.values()))


class CaptureReader:
    """Reads the records of a recording in pieces; memory does not grow with the length of the file.

    Raises BadFile for a file that is no recording, in which no device was configured, or
    whose stations change.
    """

    def __init__(self, path: Path | str) -> None:
        self.path = Path(path)
        self.note: dict[str, Any] = {}
        """The latest note on the origin of the recording that was read so far."""
        self.damage: list[str] = []
        """Descriptions of the damaged or truncated parts that were read so far."""
        with closing(self._read_blocks()) as entries:
            first = next((block for block in entries if block.kind == CONFIGURED), None)
        if first is None:
            problem = "the device was never configured in it" + "".join(f" ({text})" for text in self.damage)
            raise BadFile(self.path, problem, EXPECTED_FILE, "It contains no readings.")
        self.wire = wire_format_of(self.path, first)
        """The wire format of the first configuration."""

    def blocks(self, block_s: float = BLOCK_S) -> Iterator[CaptureBlock]:
        """Yield the pieces of the capture, in the order of the file; pieces without a record are left out."""
        session: _Session | None = None
        stretch, begin_s, number = "", math.inf, 0
        for block in self._read_blocks():
            late = block.kind == RECEIVED and not begin_s <= block.monotonic_s < begin_s + block_s
            if session is not None and (late or block.kind in (CONFIGURED, MARK)):
                yield from session.take(stretch, at_end=block.kind == CONFIGURED)
                begin_s = block.monotonic_s
            if block.kind == MARK:
                stretch = str(block_content(self.path, block).get("stretch", ""))
            elif block.kind == CONFIGURED:
                session = _Session(self._same_stations(wire_format_of(self.path, block)), number, block.monotonic_s)
                begin_s, number = block.monotonic_s, number + 1
            elif block.kind == RECEIVED and session is not None:
                session.add(block.payload, block.monotonic_s)
        if session is not None:
            yield from session.take(stretch, at_end=True)

    def _same_stations(self, wire: WireFormat) -> WireFormat:
        if wire.stations != self.wire.stations:
            problem = f"stations {', '.join(self.wire.stations)} become {', '.join(wire.stations)}"
            advice = "Record other stations into another file."
            raise BadFile(self.path, problem, "the same stations throughout", advice)
        return wire

    def _read_blocks(self) -> Generator[RecordingBlock, None, None]:
        """Yield the whole blocks from the beginning of the file; notes and damage are kept on the way."""
        self.damage.clear()
        with open_recording(self.path) as file:
            for entry in describe_damage(scan_blocks(file), self.damage):
                if entry.kind == NOTE:
                    self.note = block_content(self.path, entry)
                yield entry


class _Session:
    """Decoding of the bytes after one configuration."""

    def __init__(self, wire: WireFormat, number: int, configured_s: float) -> None:
        self.wire, self.number, self._configured_s = wire, number, configured_s
        self._decoder = make_decoder(wire)
        self._decode_readings = ReadingsDecoder(wire, configured_s if wire.zeroed else None)
        self._chunks: list[bytes] = []
        self._ends: list[int] = []
        self._ends_s: list[float] = []
        self._fed = self._waiting = self._garbage = 0
        self._parts: list[list[StationReadings]] = [[] for _ in wire.stations]
        """Decoded readings of each station."""

    def add(self, data: bytes, received_s: float) -> None:
        """Add received bytes; they are decoded when there are many of them."""
        if not data:
            return
        self._chunks.append(data)
        self._waiting += len(data)
        self._ends.append(self._fed + self._waiting)
        self._ends_s.append(received_s)
        if self._waiting >= _BATCH_BYTES:
            self._decode(at_end=False)

    def take(self, stretch: str, *, at_end: bool) -> Iterator[CaptureBlock]:
        """Yield the readings since the last call as one piece, if there are any."""
        self._decode(at_end=at_end)
        if self._parts[0] or self._garbage:
            garbage, self._garbage = self._garbage, 0
            yield CaptureBlock(stretch, self.number, self.wire, self._configured_s, self._take_stations(), garbage)

    def _take_stations(self) -> dict[str, StationReadings]:
        """The decoded readings by station, released one after another; empty without readings."""
        if not self._parts[0]:
            return {}
        stations = {}
        for row, name in enumerate(self.wire.stations):
            parts, self._parts[row] = self._parts[row], []
            stations[name] = StationReadings.join(parts)
            del parts
        return stations

    def _decode(self, *, at_end: bool) -> None:
        data = b"".join(self._chunks)
        events = self._decoder.feed(data) if data else []
        if at_end:
            events = [*events, *self._decoder.finish()]
        self._fed += len(data)
        self._chunks, self._waiting = [], 0
        ends, ends_s = np.array(self._ends, dtype=np.int64), np.array(self._ends_s)
        decoded: list[tuple[Readings, Floats]] = []
        for event in events:
            if isinstance(event, RecordRun):
                last_byte = event.offset + event.size * np.arange(1, len(event.table) + 1)
                decoded.append(self._decode_readings(event.table, ends_s[ends.searchsorted(last_byte)]))
            elif isinstance(event, Garbage):
                self._garbage += event.size
        if decoded:
            readings = concatenate_readings([part for part, _ in decoded])
            stamps_s = np.concatenate([stamp_s for _, stamp_s in decoded])
            for row, parts in enumerate(self._parts):
                part = _select(readings, stamps_s, row)
                if self.wire.family == "fastrak":
                    times_s = arrival_times_s(part.received_s, 1.0 / self.wire.rate_hz)
                    part = replace(part, measured_s=times_s)
                parts.append(part)
        decided = int(ends.searchsorted(self._fed - self._decoder.pending, side="right"))
        self._ends, self._ends_s = self._ends[decided:], self._ends_s[decided:]


_LATE_S = 0.25
"""Records are compared with those of so much time after them [s] [choice]. Clocks part by 25 us meanwhile."""


def arrival_times_s(received_s: Floats, period_s: float) -> Floats:
    """Times (N,) of the records of a station that has no clock, from their reception (N,) by the host's clock [s].

    A record may be read late, but never early. So it came a period before the next one at the latest, two before the
    one after that, and so on; the earliest of these times counts. Times strictly increase.
    """
    count, window = len(received_s), max(round(_LATE_S / period_s), _LEAST_RECORDS)
    since_s = received_s - period_s * np.arange(count)
    ahead_s = sliding_window_view(np.append(since_s, np.full(window, np.inf)), window).min(axis=1)
    rising_s = _LEAST_STEP_S * np.arange(count)
    out: Floats = np.maximum.accumulate(ahead_s[:count] + period_s * np.arange(count) - rising_s) + rising_s
    return out


_LEAST_RECORDS = 8
"""Fewest of these records [choice]."""
_LEAST_STEP_S = 1e-9
"""Least step of these times [s]."""


def _select(readings: Readings, stamps_s: Floats, row: int) -> StationReadings:
    """The readings of one station; poses that are not valid become NaN as in frames."""
    rows = np.flatnonzero(readings.station == row)
    usable = readings.quality[rows] > 0.0
    position_m, quaternion = readings.position_m[rows], readings.tracker_from_station[rows]
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.sqrt(np.sum(quaternion**2, axis=1))
        sound = usable & (length > 0.5) & (length < 2.0)
        quaternion = quaternion / length[:, None]
    return StationReadings(
        readings.received_s[rows],
        readings.measured_s[rows],
        stamps_s[rows],
        np.where((usable & np.isfinite(position_m).all(axis=1))[:, None], position_m, np.nan),
        np.where(sound[:, None], quaternion, np.nan),
        readings.quality[rows],
        readings.suspect[rows],
    )
