"""How fast bytes become records and frames, on one core: binary and ASCII, at once and record by record."""

import time
from collections.abc import Callable

import numpy as np

from harness.stream.capture import Capture
from harness.stream.decoder import Decoder
from harness.stream.items import STANDARD_LIST, STATION_CHARACTERS, size
from harness.stream.reader import FrameReader, WireFormat
from harness.stream.records import Said, Settings, encode, to_bytes

RATE_HZ, STATIONS = 75.0, 4


def decode_rates(records: int = 20_000, repeats: int = 3) -> dict[str, float]:
    """Records per second of the standard list, the best of so many turns (the machine may do other things besides).

    `binary` and `ascii` are bytes into records; `frames_...` bytes into frames; `live_...` likewise, but every record
    is a chunk of its own, as on a line without delay.
    """
    out: dict[str, float] = {}
    for name, settings in (("binary", Settings()), ("ascii", Settings(binary=False))):
        wire = WireFormat(tuple("abcd"), RATE_HZ, STANDARD_LIST, settings)
        capture = _capture(wire, records)
        few = _capture(wire, records // 10)
        contenders: dict[str, tuple[int, Callable[[], object]]] = {
            name: (records, lambda w=wire, c=capture: _decode(w, c)),  # type: ignore[misc]
            f"frames_{name}": (records, lambda w=wire, c=capture: FrameReader(w).feed_all(c)),  # type: ignore[misc]
            f"live_{name}": (records // 10, lambda w=wire, c=few: _one_by_one(w, c)),  # type: ignore[misc]
        }
        for contender, (count, work) in contenders.items():
            out[contender] = max(count / _seconds(work) for _ in range(repeats))
    return out


def _capture(wire: WireFormat, records: int) -> Capture:
    """Four stations that sway, record by record."""
    number = np.arange(records) % STATIONS
    time_s = (np.arange(records) // STATIONS) / RATE_HZ + 0.0033 * number
    sway = np.sin(time_s)
    turn = np.stack([np.cos(0.2 * sway), np.sin(0.2 * sway), 0.0 * sway, 0.0 * sway], axis=1)
    place_m = np.stack([number + 0.1 * sway, -0.5 * sway, 1.0 + 0.0 * sway], axis=1)
    said = Said(time_s, place_m, turn, np.ones(records))
    characters = np.frombuffer(STATION_CHARACTERS, np.uint8)[number]
    data = to_bytes(wire.items, encode(wire.items, characters, said, wire.settings), wire.settings)
    return Capture(data, size(wire.items, wire.settings.binary) * np.arange(1, records + 1), time_s + 0.005)


def _decode(wire: WireFormat, capture: Capture) -> None:
    Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings).feed(capture.data)


def _one_by_one(wire: WireFormat, capture: Capture) -> None:
    reader, begin = FrameReader(wire), 0
    for end, received_s in zip(capture.ends.tolist(), capture.received_s.tolist(), strict=True):
        reader.feed(capture.data[begin:end], received_s)
        begin = end


def _seconds(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
