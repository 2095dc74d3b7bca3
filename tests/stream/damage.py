"""Damage to a capture, and what became of its records: for the laws of the codec and the table in its documents."""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.codec.capture import ByteCapture
from harness.stream.codec.decoder import Decoder, DecoderEvent, RecordRun
from harness.stream.codec.items import STANDARD_LIST, STATION_CHARACTERS, record_size
from harness.stream.codec.reader import FrameReader, WireFormat
from harness.stream.codec.records import RecordFormat, RecordValues, encode_records, to_bytes

Kind = Literal["flipped", "changed", "lost", "added"]
KINDS: tuple[Kind, ...] = ("flipped", "changed", "lost", "added")
RATE_HZ, STATIONS, ROUNDS = 40.0, 4, 8
LISTS: dict[str, tuple[tuple[int, ...], RecordFormat]] = {
    "standard": (STANDARD_LIST, RecordFormat()),
    "16-bit": ((40, 18, 19, 21, 1), RecordFormat()),
    "VRPN": ((2, 11, 0), RecordFormat(metres_per_unit=0.0254)),
    "angles": ((2, 4, 1), RecordFormat(metres_per_unit=0.0254)),
    "no end": ((40, 2, 11, 21), RecordFormat()),
    "16-bit, no end": ((18, 20), RecordFormat()),
    "ASCII standard": (STANDARD_LIST, RecordFormat(binary=False)),
    "ASCII default": ((2, 4, 1), RecordFormat(metres_per_unit=0.0254, binary=False)),
    "ASCII, no end": ((40, 2, 11), RecordFormat(binary=False)),
}
"""What is tried: a name, an output list and the settings."""


@dataclass(frozen=True, eq=False)
class Sound:
    """Rounds of four stations that move about a room as bodies do, as bytes and as values."""

    items: tuple[int, ...]
    settings: RecordFormat
    said: RecordValues
    stations: NDArray[np.uint8]

    @cached_property
    def data(self) -> bytes:
        return to_bytes(self.items, encode_records(self.items, self.stations, self.said, self.settings), self.settings)

    @property
    def size(self) -> int:
        return record_size(self.items, self.settings.binary, self.settings.stylus_bytes)

    @cached_property
    def records(self) -> list[bytes]:
        return [self.data[k : k + self.size] for k in range(0, len(self.data), self.size)]

    @property
    def wire(self) -> WireFormat:
        return WireFormat(tuple("abcd"), RATE_HZ, self.items, self.settings)

    def decoder(self) -> Decoder:
        return Decoder(dict.fromkeys(STATION_CHARACTERS[:STATIONS], self.items), self.settings)


@lru_cache(maxsize=512)
def sound(name: str, seed: int, rounds: int = ROUNDS) -> Sound:
    """A capture of one of `LISTS`. Stations are within arm's length of each other, as on a body."""
    items, settings = LISTS[name]
    rng = np.random.default_rng(seed)
    number = np.tile(np.arange(STATIONS), rounds)
    time_s = 12.0 + np.repeat(np.arange(rounds), STATIONS) / RATE_HZ + 0.0033 * number
    place_m, turn_rad = rng.uniform(-0.8, 0.8, (2, STATIONS, 3))
    sway = np.sin(2.0 * np.pi * rng.uniform(0.5, 2.0, STATIONS)[number] * time_s)[:, None]
    given = RecordValues(
        measured_s=time_s,
        position_m=place_m[number] + 0.2 * sway + 1e-3 * rng.normal(size=(len(number), 3)),
        tracker_from_station=rotations.exp(3.0 * turn_rad[number] + 0.5 * sway),
        quality=rng.uniform(0.3, 1.0, len(number)),
    )
    return Sound(items, settings, given, np.frombuffer(STATION_CHARACTERS, np.uint8)[number])


def hurt(data: bytes, kind: Kind, at: int, rng: np.random.Generator) -> bytes:
    """One bit flipped, or one byte changed, lost or added, at this place."""
    new = int(rng.integers(256))
    if kind == "flipped":
        return data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
    if kind == "changed":
        return data[:at] + bytes([new if new != data[at] else new ^ 1]) + data[at + 1 :]
    return data[:at] + data[at + 1 :] if kind == "lost" else data[:at] + bytes([new]) + data[at:]


def found(events: list[DecoderEvent], given: Sound) -> Counter[bytes]:
    """The records that came out, as bytes."""
    return Counter(
        to_bytes(given.items, event.table[k : k + 1], given.settings)
        for event in events
        if isinstance(event, RecordRun)
        for k in range(len(event.table))
    )


def cost(name: str, kind: Kind, trial: int) -> tuple[int, int]:
    """How many records are missing that a damaged byte did not touch, and how many came out that never went in, but
    for one in the place of the damaged one."""
    rng = np.random.default_rng([trial, KINDS.index(kind)])
    given = sound(name, trial % 256)
    at = int(rng.integers(given.size, len(given.data) - given.size))
    one = given.decoder()
    events = [*one.feed(hurt(given.data, kind, at, rng)), *one.finish()]
    out = found(events, given)
    touched = given.records[at // given.size] if kind != "added" or at % given.size else b""
    sent = Counter(given.records)
    missing = sum((sent - out).values()) - (touched != b"" and out[touched] == 0)
    return missing, sum((out - sent).values()) - (touched != b"")


Fate = Literal["harmless", "missing", "suspect", "small", "large"]
FATES: tuple[Fate, ...] = get_args(Fate)
SMALL_M, SMALL_RAD, SMALL_S = 0.01, float(np.deg2rad(1.0)), 1e-3
"""A reading that is wrong and not marked is off by a small amount, or by more than one of these."""


def fate(name: str, kind: Kind, trial: int) -> Fate:
    """The worst that became of any reading: all as sent, some missing, some suspect, or some wrong and not marked."""
    rng = np.random.default_rng([trial, KINDS.index(kind), 1])
    given = sound(name, trial % 64)
    record = int(rng.integers(2 * STATIONS, len(given.records) - 2 * STATIONS))
    at = record * given.size + int(rng.integers(given.size))
    return _worst(_clean(name, trial % 64), _rows(given, hurt(given.data, kind, at, rng)))


def fate_of_wrong_station(name: str, trial: int) -> Fate:
    """The same where the station's character became another's."""
    rng = np.random.default_rng([trial, 9])
    given = sound(name, trial % 64)
    data = bytearray(given.data)
    at = int(rng.integers(2 * STATIONS, len(given.records) - 2 * STATIONS)) * given.size + 1
    data[at] = int(rng.choice([other for other in STATION_CHARACTERS[:STATIONS] if other != data[at]]))
    return _worst(_clean(name, trial % 64), _rows(given, bytes(data)))


_Row = tuple[int, int, bool, bytes, Floats]
"""Frame, station, suspect, the values as bytes, and the values: stamp, place, quaternion (8,)."""


def _rows(given: Sound, data: bytes) -> list[_Row]:
    """The valid readings of all frames."""
    reader = FrameReader(given.wire)
    ends = np.append(np.arange(given.size, len(data), given.size), len(data))
    record = np.minimum((ends - 1) // given.size, len(given.records) - 1)
    capture = ByteCapture(data, ends, given.said.measured_s[record] + 100.0)
    out: list[_Row] = []
    for number, frame in enumerate([*reader.feed_all(capture), *reader.finish()]):
        values = np.column_stack([frame.measured_s, frame.position_m, frame.tracker_from_station])
        for station in np.flatnonzero(frame.position_valid | frame.orientation_valid).tolist():
            row = values[station]
            out.append((number, station, bool(frame.suspect[station]), row.tobytes(), row))
    return out


@lru_cache(maxsize=1024)
def _clean(name: str, seed: int) -> list[_Row]:
    given = sound(name, seed)
    return _rows(given, given.data)


def _worst(clean: list[_Row], seen: list[_Row]) -> Fate:
    sent = {(station, text) for _, station, _, text, _ in clean}
    passed = {(station, text) for _, station, suspect, text, _ in seen if not suspect}
    wrong = [row for row in seen if not row[2] and (row[1], row[3]) not in sent]
    if wrong:
        return "small" if all(_nearly(row, clean) for row in wrong) else "large"
    if sent <= passed:
        return "harmless"
    return "suspect" if any(suspect for _, _, suspect, _, _ in seen) else "missing"


def _nearly(row: _Row, clean: list[_Row]) -> bool:
    """Whether the station said nearly the same at about that time."""
    return any(
        _near(row[4], other) for number, station, _, _, other in clean if station == row[1] and abs(number - row[0]) < 2
    )


def _near(one: Floats, other: Floats) -> bool:
    off_m = np.linalg.norm(one[1:4] - other[1:4])
    off_rad = rotations.angle_between_rad(one[4:], other[4:])
    return not (abs(one[0] - other[0]) > SMALL_S or off_m > SMALL_M or off_rad > SMALL_RAD)
