"""The rate of a device: a short stretch of its records, looked at."""

import numpy as np

from harness.core.arrays import Floats
from harness.stream.codec.commands import STREAM
from harness.stream.codec.decoder import Decoder, RecordRun
from harness.stream.codec.reader import WireFormat
from harness.stream.driver.connection import DeviceConnection

MIN_RECORDS = 3
"""Records of a station that make a rate."""
PERIOD_QUANTILE = 0.1
"""This share of the differences is shorter than the one that is taken for a period: many rounds may be missing, but
not all between two that came [choice]."""
MAX_INTERVAL_S = 10.0
"""No two rounds are further apart [choice]."""


def measure_rate_hz(line: DeviceConnection, wire: WireFormat) -> float | None:
    """Rounds per second, by the device's stamps, or by how many come where there are none; None for too few.

    The device is set up for this format, and stopped before and after.
    """
    line.send(STREAM)
    heard = line.listen(line.timing.measure_s)
    line.stop()
    runs = [event for event in _decoder(wire).feed(heard) if isinstance(event, RecordRun)]
    first = [run.table[run.table["station"] == wire.characters[0]] for run in runs]
    count = sum(map(len, first))
    if count < MIN_RECORDS:
        return None
    table = np.concatenate(first)
    if "time" in (table.dtype.names or ()):
        rate_hz = estimate_rate_hz(table["time"].astype(float) * wire.settings.seconds_per_tick)
        if rate_hz is not None:
            return rate_hz
    return count / line.timing.measure_s


def estimate_rate_hz(stamps_s: Floats) -> float | None:
    """Rounds per second of one station's stamps, (n,): jittered, spoilt, and with rounds missing; None for too few.

    A short difference is about one period. So many periods as all differences hold are divided by their sum, in which
    the jitter of the stamps between cancels.
    """
    steps_s = np.diff(stamps_s)
    steps_s = steps_s[(steps_s > 0.0) & (steps_s < MAX_INTERVAL_S)]  # others are of a spoilt stamp
    if len(steps_s) < MIN_RECORDS - 1:
        return None
    period_s = float(np.quantile(steps_s, PERIOD_QUANTILE))
    for _ in range(2):  # a short one at first
        period_s = float(np.median(steps_s / _count_periods(steps_s, period_s)))
    return float(_count_periods(steps_s, period_s).sum() / steps_s.sum())


def _count_periods(steps_s: Floats, period_s: float) -> Floats:
    return np.maximum(np.rint(steps_s / period_s), 1.0)


def _decoder(wire: WireFormat) -> Decoder:
    return Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings)
