"""The rate of a device: a short stretch of its records, looked at."""

import numpy as np

from harness.stream.commands import STREAM
from harness.stream.decoder import Decoder, Records
from harness.stream.driver.line import Line
from harness.stream.reader import WireFormat

FEWEST = 3
"""Records of a station that make a rate."""


def measured_rate_hz(line: Line, wire: WireFormat) -> float | None:
    """Rounds per second, by the device's stamps, or by how many come where there are none; None for too few.

    The device is set up for this format, and stopped before and after.
    """
    line.send(STREAM)
    heard = line.listen(line.timing.measure_s)
    line.stop()
    runs = [event for event in _decoder(wire).feed(heard) if isinstance(event, Records)]
    first = [run.table[run.table["station"] == wire.characters[0]] for run in runs]
    count = sum(map(len, first))
    if count < FEWEST:
        return None
    table = np.concatenate(first)
    if "time" in (table.dtype.names or ()):
        period_s = float(np.median(np.diff(table["time"].astype(float)))) * wire.settings.seconds_per_tick
        if period_s > 0.0:
            return 1.0 / period_s
    return count / line.timing.measure_s


def _decoder(wire: WireFormat) -> Decoder:
    return Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings)
