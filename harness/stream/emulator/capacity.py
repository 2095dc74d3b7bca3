"""Whether a line can carry the records that a scenario asks for, checked before a client waits for them in vain."""

from harness.errors import BadInput
from harness.stream.codec.items import BITS_PER_BYTE, SHORT_LIST, record_size


def check_capacity(stations: int, rate_hz: float, items: tuple[int, ...], baud: int) -> None:
    """Raise BadInput, with the numbers and remedies, when binary records of this list do not fit the line."""
    record_bytes = record_size(items)
    required, capacity = stations * record_bytes * rate_hz, baud / BITS_PER_BYTE
    if required <= capacity:
        return
    max_stations, max_rate_hz = int(capacity / (record_bytes * rate_hz)), int(capacity / (record_bytes * stations))
    load = f"{stations} stations x {record_bytes} bytes (list {','.join(map(str, items))}) x {rate_hz:g} Hz"
    remedies = [
        *([f"--stations {max_stations}"] if max_stations else []),
        *([f"--rate {max_rate_hz}"] if max_rate_hz else []),
        f"shorter records such as --items {','.join(map(str, SHORT_LIST))} ({record_size(SHORT_LIST)} bytes)",
        "--unpaced",
        "--overload to see records dropped",
    ]
    raise BadInput(
        f"{load} = {required:.0f} bytes/s; a line of {baud} baud carries {capacity:.0f}.", f"Try {'; '.join(remedies)}."
    )
