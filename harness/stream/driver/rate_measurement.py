"""Measurement of the rate of a device from a short stretch of its records."""

import numpy as np

from harness.core.arrays import Floats
from harness.stream.codec.commands import STREAM
from harness.stream.codec.decoder import Decoder, RecordRun
from harness.stream.codec.reader import WireFormat
from harness.stream.driver.connection import DeviceConnection

MIN_RECORDS = 3
"""Fewest records of a station that give a rate."""
PERIOD_QUANTILE = 0.1
"""Quantile of the stamp differences that is taken as the period at first. Many rounds may be missing, but some pairs
are adjacent [choice]."""
MAX_INTERVAL_S = 10.0
"""No two rounds are further apart [s] [choice]."""


def measure_rate_hz(line: DeviceConnection, wire: WireFormat) -> float | None:
    """Measure rounds per second from the device's stamps, or from the record count where there are none.

    Returns None for too few records. The device is configured for this format, and stopped before and after.
    """
    line.send(STREAM)
    data = line.listen(line.timing.measure_s)
    line.stop()
    runs = [event for event in _decoder(wire).feed(data) if isinstance(event, RecordRun)]
    tables = [run.table[run.table["station"] == wire.characters[0]] for run in runs]
    count = sum(map(len, tables))
    if count < MIN_RECORDS:
        return None
    table = np.concatenate(tables)
    if "time" in (table.dtype.names or ()):
        rate_hz = estimate_rate_hz(table["time"].astype(float) * wire.settings.seconds_per_tick)
        if rate_hz is not None:
            return rate_hz
    return count / line.timing.measure_s


def estimate_rate_hz(stamps_s: Floats) -> float | None:
    """Estimate rounds per second from the stamps (n,) [s] of one station; None for too few stamps.

    Stamps may have jitter, be damaged or be missing. A short difference is about one period. The number of periods in
    all differences is divided by their sum, in which the jitter of interior stamps cancels.
    """
    steps_s = np.diff(stamps_s)
    steps_s = steps_s[(steps_s > 0.0) & (steps_s < MAX_INTERVAL_S)]  # other differences involve a damaged stamp
    if len(steps_s) < MIN_RECORDS - 1:
        return None
    period_s = float(np.quantile(steps_s, PERIOD_QUANTILE))
    for _ in range(2):  # the first estimate is a short period
        period_s = float(np.median(steps_s / _count_periods(steps_s, period_s)))
    return float(_count_periods(steps_s, period_s).sum() / steps_s.sum())


def _count_periods(steps_s: Floats, period_s: float) -> Floats:
    return np.maximum(np.rint(steps_s / period_s), 1.0)


def _decoder(wire: WireFormat) -> Decoder:
    return Decoder(dict.fromkeys(wire.characters, wire.items), wire.settings)
