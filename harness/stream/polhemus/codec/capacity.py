"""Whether a line carries the records that are asked for, at ten bits a byte, and a list their positions
(docs/is900.md 10).
"""

import math
from collections.abc import Iterable

import numpy as np

from harness.errors import BadInput
from harness.stream.polhemus.codec.items import (
    BITS_PER_BYTE,
    FULL_SCALE_M,
    SHORT_LIST,
    STANDARD_LIST,
    describe_list,
    position_range_m,
    record_size,
)
from harness.stream.polhemus.codec.replies import Emitter

TRACKING_REPLY_BYTES = 48
"""Length of the reply to `MP` [bytes] (docs/is900.md 7)."""
EMITTER_RANGE_M = 4.0
"""Largest distance at which an emitter is heard [m] (docs/is900.md 13.1)."""
_SHORT_ITEMS = f"--items {','.join(map(str, SHORT_LIST))}"


def required_bit_rate(stations: int, items: tuple[int, ...], rate_hz: float, poll_hz: float = 0.0) -> float:
    """Bit rate of this many stations at `rate_hz` when `MP` is polled at `poll_hz` [bit/s]."""
    return BITS_PER_BYTE * (stations * record_size(items) * rate_hz + TRACKING_REPLY_BYTES * poll_hz)


def check_capacity(
    port: str,
    baud: int | None,
    stations: int,
    items: tuple[int, ...],
    rate_hz: float,
    poll_hz: float,
    reach_m: float | None = None,
) -> None:
    """Raise BadInput when the stations of a device send more than the line carries.

    `baud` is None where there is no such limit. The message names the short list unless the stations are known to
    reach beyond its range (`reach_m`).
    """
    if baud is None or required_bit_rate(stations, items, rate_hz, poll_hz) <= baud:
        return
    fitting = max((n for n in range(stations) if required_bit_rate(n, items, rate_hz, poll_hz) <= baud), default=0)
    remedies = [f"{fitting} station{'s' * (fitting > 1)}"] if fitting else []
    short_fits = required_bit_rate(stations, SHORT_LIST, rate_hz, poll_hz) <= baud
    if short_fits and record_size(items) > record_size(SHORT_LIST) and (reach_m or 0.0) < FULL_SCALE_M:
        remedies.append(
            f"{_SHORT_ITEMS} ({describe_list(SHORT_LIST)}: positions farther than "
            f"{FULL_SCALE_M:g} m from the tracker's origin on any axis are not valid)"
        )
    max_rate_hz = (baud - required_bit_rate(0, items, 0.0, poll_hz)) / required_bit_rate(stations, items, 1.0)
    remedies.append(f"a device that runs at {math.floor(max_rate_hz)} Hz or less")
    if baud < 115200:
        remedies.append("a device set to 115200 baud")
    raise BadInput(
        f"Port {port}: {stations} stations x {record_size(items)} bytes x {BITS_PER_BYTE} bits x {rate_hz:g} Hz are "
        f"{required_bit_rate(stations, items, rate_hz, poll_hz):.0f} bit/s, but the line carries {baud}.",
        f"Try {', or '.join(remedies)}.",
    )


def check_emulated_capacity(stations: int, rate_hz: float, items: tuple[int, ...], baud: int, reach_m: float) -> None:
    """Raise BadInput, with the numbers and remedies, when records of an emulated device do not fit its line.

    `reach_m` is how far the stations are from the tracker's origin at most, on any axis [m].
    """
    record_bytes, capacity = record_size(items), baud / BITS_PER_BYTE
    required = stations * record_bytes * rate_hz
    if required <= capacity:
        return
    max_stations, max_rate_hz = int(capacity / (record_bytes * rate_hz)), int(capacity / (record_bytes * stations))
    load = f"{stations} stations x {record_bytes} bytes (list {','.join(map(str, items))}) x {rate_hz:g} Hz"
    remedies = {
        f"--stations {max_stations}": max_stations,
        f"--rate {max_rate_hz}": max_rate_hz,
        f"shorter records such as {_SHORT_ITEMS} ({describe_list(SHORT_LIST)})": reach_m < FULL_SCALE_M,
        "--unpaced": True,
        "tracker.overload = true in the scenario to see records dropped": True,
    }
    text = "; ".join(remedy for remedy, helps in remedies.items() if helps)
    raise BadInput(f"{load} = {required:.0f} bytes/s; a line of {baud} baud carries {capacity:.0f}.", f"Try {text}.")


def check_range(items: tuple[int, ...], reach_m: float) -> None:
    """Raise BadInput when stations that reach this far from the tracker's origin leave the range of a list [m]."""
    range_m = position_range_m(items)
    if range_m is not None and reach_m >= range_m:
        raise BadInput(
            f"The motion reaches {reach_m:.2f} m from the tracker's origin on an axis; list "
            f"{','.join(map(str, items))} ({describe_list(items)}) carries less.",
            f"Try --items {','.join(map(str, STANDARD_LIST))}, another clip, or no --items: positions beyond the range "
            "are then not valid for a client that asks for this list.",
        )


def emitter_reach_m(emitters: Iterable[Emitter]) -> float:
    """Return the largest coordinate that stations before some emitter have at least [m]; 0 without emitters.

    A station can be anywhere on the emitter's axis up to its range. The point that is nearest to the origin counts: an
    emitter at the ceiling is no trouble for an origin at the floor.
    """
    reach_m = 0.0
    for emitter in emitters:
        position_m, normal = np.array(emitter.position_m), np.array(emitter.normal)
        ahead_m = np.clip(-np.dot(position_m, normal), 0.0, EMITTER_RANGE_M)
        reach_m = max(reach_m, float(np.abs(position_m + ahead_m * normal).max()))
    return reach_m
