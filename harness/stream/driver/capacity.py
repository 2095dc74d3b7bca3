"""Whether a serial line can carry the requested records: ten bits a byte (docs/is900.md 10)."""

import math

from harness.errors import BadInput
from harness.stream.codec.items import BITS_PER_BYTE, FULL_SCALE_M, SHORT_LIST, describe_list, record_size

TRACKING_REPLY_BYTES = 48
"""Length of the reply to `MP` [bytes] (docs/is900.md 7)."""


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
    """Raise BadInput when the stations send more than the line carries. `baud` is None where there is no such limit.

    The message names the short list unless the stations are known to reach beyond its range (`reach_m`).
    """
    if baud is None or required_bit_rate(stations, items, rate_hz, poll_hz) <= baud:
        return
    fitting = max((n for n in range(stations) if required_bit_rate(n, items, rate_hz, poll_hz) <= baud), default=0)
    remedies = [f"{fitting} station{'s' * (fitting > 1)}"] if fitting else []
    short_fits = required_bit_rate(stations, SHORT_LIST, rate_hz, poll_hz) <= baud
    if short_fits and record_size(items) > record_size(SHORT_LIST) and (reach_m or 0.0) < FULL_SCALE_M:
        remedies.append(
            f"--items {','.join(map(str, SHORT_LIST))} ({describe_list(SHORT_LIST)}: positions farther than "
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
