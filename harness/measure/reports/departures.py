"""Departures of measured numbers from what is expected, each with a raw p-value."""

import math
from dataclasses import dataclass

from harness.core.number_format import Interval

NAMED_LEVEL = 0.05
"""Largest corrected p-value with which a departure is named."""


@dataclass(frozen=True)
class Departure:
    """One measured number beside the expected one."""

    key: str
    """Name of the number: the dotted key of a scenario, or a name of the timing or of the registration."""
    station: str
    """Station that was measured; "" is all stations together."""
    measured: Interval
    expected: Interval
    """The expected number; its interval has no width where it is known exactly, as that of a preset."""
    p: float
    """Two-sided p-value of the difference, not corrected for the number of checks."""
    p_holm: float = 1.0
    """`p` corrected for the number of checks (Holm 1979); 1 before the correction."""

    @property
    def is_named(self) -> bool:
        """Whether the measured number differs from the expected one at the 5 % level over all checks."""
        return self.p_holm <= NAMED_LEVEL


def compare_with_expected(key: str, station: str, measured: Interval, expected: Interval) -> Departure:
    """Compare a measured number with the expected one by a normal test.

    The standard deviation of each is read off its interval, on the side of the other. Both must be measured.
    """
    difference = measured.value - expected.value
    deviation = math.hypot(measured.deviation_towards(expected.value), expected.deviation_towards(measured.value))
    if difference == 0.0:
        p = 1.0
    elif deviation == 0.0:
        p = 0.0
    else:
        p = math.erfc(abs(difference) / deviation / math.sqrt(2.0))
    return Departure(key, station, measured, expected, p)
