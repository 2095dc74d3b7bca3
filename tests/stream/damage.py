"""Damage to a capture, and the fate of its records: for tests of the codec and the table of docs/notes/damage.md."""

from collections import Counter
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.polhemus.codec.decoder import Decoder, DecoderEvent, RecordRun
from harness.stream.polhemus.codec.items import STANDARD_LIST, STATION_CHARACTERS, record_size
from harness.stream.polhemus.codec.reader import ByteCapture, FrameReader, WireFormat
from harness.stream.polhemus.codec.records import RecordFormat, RecordValues, encode_records, to_bytes

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
"""Output list and format of each case, by name."""


@dataclass(frozen=True, eq=False)
class SoundCapture:
    """Rounds of four stations that move as bodies do in a room, as bytes and as values."""

    items: tuple[int, ...]
    settings: RecordFormat
    values: RecordValues
    stations: NDArray[np.uint8]

    @cached_property
    def data(self) -> bytes:
        return to_bytes(
            self.items, encode_records(self.items, self.stations, self.values, self.settings), self.settings
        )

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
def make_capture(name: str, seed: int, rounds: int = ROUNDS) -> SoundCapture:
    """A capture of one of `LISTS`. Stations are within arm's length of each other, as on a body."""
    items, settings = LISTS[name]
    rng = np.random.default_rng(seed)
    number = np.tile(np.arange(STATIONS), rounds)
    time_s = 12.0 + np.repeat(np.arange(rounds), STATIONS) / RATE_HZ + 0.0033 * number
    position_m, turn_rad = rng.uniform(-0.8, 0.8, (2, STATIONS, 3))
    sway = np.sin(2.0 * np.pi * rng.uniform(0.5, 2.0, STATIONS)[number] * time_s)[:, None]
    capture = RecordValues(
        measured_s=time_s,
        position_m=position_m[number] + 0.2 * sway + 1e-3 * rng.normal(size=(len(number), 3)),
        tracker_from_station=rotations.exp(3.0 * turn_rad[number] + 0.5 * sway),
        quality=rng.uniform(0.3, 1.0, len(number)),
    )
    return SoundCapture(items, settings, capture, np.frombuffer(STATION_CHARACTERS, np.uint8)[number])


def damage(data: bytes, kind: Kind, at: int, rng: np.random.Generator) -> bytes:
    """Flip one bit, or change, lose or add one byte, at this offset."""
    new_byte = int(rng.integers(256))
    if kind == "flipped":
        return data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :]
    if kind == "changed":
        return data[:at] + bytes([new_byte if new_byte != data[at] else new_byte ^ 1]) + data[at + 1 :]
    return data[:at] + data[at + 1 :] if kind == "lost" else data[:at] + bytes([new_byte]) + data[at:]


def decoded_records(events: list[DecoderEvent], capture: SoundCapture) -> Counter[bytes]:
    """Return the decoded records as bytes."""
    return Counter(
        to_bytes(capture.items, event.table[k : k + 1], capture.settings)
        for event in events
        if isinstance(event, RecordRun)
        for k in range(len(event.table))
    )


def count_lost(name: str, kind: Kind, trial: int) -> tuple[int, int]:
    """Return how many records are missing that a damaged byte did not touch, and how many new ones appeared.

    A new record in the place of the damaged one does not count.
    """
    rng = np.random.default_rng([trial, KINDS.index(kind)])
    capture = make_capture(name, trial % 256)
    at = int(rng.integers(capture.size, len(capture.data) - capture.size))
    decoder = capture.decoder()
    events = [*decoder.feed(damage(capture.data, kind, at, rng)), *decoder.finish()]
    decoded = decoded_records(events, capture)
    touched_record = capture.records[at // capture.size] if kind != "added" or at % capture.size else b""
    sent_values = Counter(capture.records)
    missing = sum((sent_values - decoded).values()) - (touched_record != b"" and decoded[touched_record] == 0)
    return missing, sum((decoded - sent_values).values()) - (touched_record != b"")


Fate = Literal["harmless", "missing", "suspect", "small", "large"]
FATES: tuple[Fate, ...] = get_args(Fate)
SMALL_M, SMALL_RAD, SMALL_S = 0.01, float(np.deg2rad(1.0)), 1e-3
"""A wrong unmarked reading has a small error, or an error above one of these."""


def fate_of_damage(name: str, kind: Kind, trial: int) -> Fate:
    """Return the worst fate of any reading: all intact, some missing, some suspect, or some wrong and unmarked."""
    rng = np.random.default_rng([trial, KINDS.index(kind), 1])
    capture = make_capture(name, trial % 64)
    record = int(rng.integers(2 * STATIONS, len(capture.records) - 2 * STATIONS))
    at = record * capture.size + int(rng.integers(capture.size))
    return _worst_fate(_undamaged(name, trial % 64), _valid_readings(capture, damage(capture.data, kind, at, rng)))


def fate_of_wrong_station(name: str, trial: int) -> Fate:
    """Return the worst fate of any reading when a station's character is changed to another's."""
    rng = np.random.default_rng([trial, 9])
    capture = make_capture(name, trial % 64)
    data = bytearray(capture.data)
    at = int(rng.integers(2 * STATIONS, len(capture.records) - 2 * STATIONS)) * capture.size + 1
    data[at] = int(rng.choice([other_row for other_row in STATION_CHARACTERS[:STATIONS] if other_row != data[at]]))
    return _worst_fate(_undamaged(name, trial % 64), _valid_readings(capture, bytes(data)))


_Row = tuple[int, int, bool, bytes, Floats]
"""Frame, station, suspect, the values as bytes, and the values: stamp, position, quaternion (8,)."""


def _valid_readings(capture: SoundCapture, data: bytes) -> list[_Row]:
    """Return the valid readings of all frames."""
    reader = FrameReader(capture.wire)
    ends = np.append(np.arange(capture.size, len(data), capture.size), len(data))
    record = np.minimum((ends - 1) // capture.size, len(capture.records) - 1)
    chunks = ByteCapture(data, ends, capture.values.measured_s[record] + 100.0)
    decoded: list[_Row] = []
    for number, frame in enumerate([*reader.feed_all(chunks), *reader.finish()]):
        values = np.column_stack([frame.measured_s, frame.position_m, frame.tracker_from_station])
        for station in np.flatnonzero(frame.position_valid | frame.orientation_valid).tolist():
            row = values[station]
            decoded.append((number, station, bool(frame.suspect[station]), row.tobytes(), row))
    return decoded


@lru_cache(maxsize=1024)
def _undamaged(name: str, seed: int) -> list[_Row]:
    capture = make_capture(name, seed)
    return _valid_readings(capture, capture.data)


def _worst_fate(undamaged: list[_Row], received: list[_Row]) -> Fate:
    sent_values = {(station, text) for _, station, _, text, _ in undamaged}
    unmarked = {(station, text) for _, station, suspect, text, _ in received if not suspect}
    wrong_rows = [row for row in received if not row[2] and (row[1], row[3]) not in sent_values]
    if wrong_rows:
        return "small" if all(_is_near_any(row, undamaged) for row in wrong_rows) else "large"
    if sent_values <= unmarked:
        return "harmless"
    return "suspect" if any(suspect for _, _, suspect, _, _ in received) else "missing"


def _is_near_any(row: _Row, undamaged: list[_Row]) -> bool:
    """Whether the station had nearly the same values at about that time."""
    return any(
        _is_near(row[4], other_row)
        for number, station, _, _, other_row in undamaged
        if station == row[1] and abs(number - row[0]) < 2
    )


def _is_near(decoder: Floats, other_row: Floats) -> bool:
    distance_m = np.linalg.norm(decoder[1:4] - other_row[1:4])
    angle_rad = rotations.angle_between_rad(decoder[4:], other_row[4:])
    return not (abs(decoder[0] - other_row[0]) > SMALL_S or distance_m > SMALL_M or angle_rad > SMALL_RAD)
