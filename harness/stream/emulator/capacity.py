"""Whether a line can carry the records that a scenario asks for, checked before a client waits for them in vain."""

from harness.errors import BadInput
from harness.stream.codec.items import (
    BITS_PER_BYTE,
    FULL_SCALE_M,
    SHORT_LIST,
    STANDARD_LIST,
    describe_list,
    position_range_m,
    record_size,
)


def check_range(items: tuple[int, ...], reach_m: float) -> None:
    """Raise BadInput when stations that reach this far from the tracker's origin leave the range of a list [m]."""
    range_m = position_range_m(items)
    if range_m is None or reach_m < range_m:
        return
    raise BadInput(
        f"The motion reaches {reach_m:.2f} m from the tracker's origin on an axis; list {','.join(map(str, items))} "
        f"({describe_list(items)}) carries less.",
        f"Try --items {','.join(map(str, STANDARD_LIST))}, another clip, or no --items: positions beyond the range are "
        "then not valid for a client that asks for this list.",
    )


def check_capacity(stations: int, rate_hz: float, items: tuple[int, ...], baud: int, reach_m: float) -> None:
    """Raise BadInput, with the numbers and remedies, when binary records of this list do not fit the line.

    `reach_m` is how far the stations are from the tracker's origin at most, on any axis [m].
    """
    record_bytes = record_size(items)
    required, capacity = stations * record_bytes * rate_hz, baud / BITS_PER_BYTE
    if required <= capacity:
        return
    max_stations, max_rate_hz = int(capacity / (record_bytes * rate_hz)), int(capacity / (record_bytes * stations))
    load = f"{stations} stations x {record_bytes} bytes (list {','.join(map(str, items))}) x {rate_hz:g} Hz"
    remedies = [
        *([f"--stations {max_stations}"] if max_stations else []),
        *([f"--rate {max_rate_hz}"] if max_rate_hz else []),
        *(
            [f"shorter records such as --items {','.join(map(str, SHORT_LIST))} ({describe_list(SHORT_LIST)})"]
            if reach_m < FULL_SCALE_M
            else []
        ),
        "--unpaced",
        "tracker.overload = true in the scenario to see records dropped",
    ]
    raise BadInput(
        f"{load} = {required:.0f} bytes/s; a line of {baud} baud carries {capacity:.0f}.", f"Try {'; '.join(remedies)}."
    )
