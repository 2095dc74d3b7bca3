"""Whether a line can carry what a scenario asks of it, before anybody waits for records that never come."""

from harness.errors import BadInput
from harness.stream.codec.items import BITS_PER_BYTE, SHORT_LIST, record_size


def check_capacity(stations: int, rate_hz: float, items: tuple[int, ...], baud: int) -> None:
    """BadInput, with numbers and ways out, when binary records of this list do not fit the line."""
    record = record_size(items)
    wanted, capacity = stations * record * rate_hz, baud / BITS_PER_BYTE
    if wanted <= capacity:
        return
    fewer, slower_hz = int(capacity / (record * rate_hz)), int(capacity / (record * stations))
    asked = f"{stations} stations x {record} bytes (list {','.join(map(str, items))}) x {rate_hz:g} Hz"
    ways = [
        *([f"--stations {fewer}"] if fewer else []),
        *([f"--rate {slower_hz}"] if slower_hz else []),
        f"shorter records such as --items {','.join(map(str, SHORT_LIST))} ({record_size(SHORT_LIST)} bytes)",
        "--unpaced",
        "--overload to see records dropped",
    ]
    raise BadInput(
        f"{asked} = {wanted:.0f} bytes/s; a line of {baud} baud carries {capacity:.0f}.", f"Try {'; '.join(ways)}."
    )
