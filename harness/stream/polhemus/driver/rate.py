"""The rate of a device: measured from its stamps or its records, and compared with what a user says."""

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.stream.polhemus.codec.commands import STREAM
from harness.stream.polhemus.codec.decoder import Decoder, RecordRun
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.driver.connection import DeviceConnection

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


RATE_TOLERANCE = 0.1
"""Rates that differ by less than this share count as equal. `MP` rounds to whole numbers."""


def rates_agree(first_hz: float, second_hz: float) -> bool:
    """Whether two rates count as equal [Hz]."""
    return abs(first_hz - second_hz) <= RATE_TOLERANCE * second_hz


def check_requested_rate(port: str, requested_hz: float | None, device_hz: float | None) -> None:
    """Raise BadInput when the rate that a user gives is not that of the device [Hz]."""
    if requested_hz and device_hz and not rates_agree(requested_hz, device_hz):
        raise BadInput(
            f"Port {port}: a rate of {requested_hz:g} Hz is requested, but the device runs at {device_hz:.4g} Hz.",
            "Omit the rate, or give that of the device.",
        )


def too_few_records_error(port: str, line: DeviceConnection, wire: WireFormat) -> BadInput:
    """Return the error for a device whose rate is not known."""
    return BadInput(
        f"Port {port}: the device does not report its rate, and sent too few records of station "
        f"{chr(wire.characters[0])} in {line.timing.measure_s:g} s to measure it.",
        "Check that this station is plugged in, or give the rate.",
    )
