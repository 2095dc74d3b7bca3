"""A measured number with its 95 % interval, or the reason why it was not measured."""

import math
from dataclasses import dataclass
from typing import Any

from harness.errors import BadInput

NORMAL_QUANTILE = 1.959963984540054
"""Half width of a normal 95 % interval, in standard deviations."""
CHI_QUANTILE = 2.795483482915108
"""95 % quantile of the length of a vector of three standard normal numbers."""


@dataclass(frozen=True)
class Measured:
    """A number that was estimated from a recording."""

    value: float
    """Estimate; NaN if it was not measured."""
    low: float = math.nan
    """Lower end of the 95 % interval, in the unit of the value."""
    high: float = math.nan
    """Upper end."""
    count: int = 0
    """Number of observations that the estimate rests on, such as events or samples."""
    reason: str = ""
    """Reason why the number was not measured; "" if it was."""

    def __post_init__(self) -> None:
        if self.reason:
            return
        if not self.low <= self.value <= self.high:
            raise BadInput(
                f"An estimate of {self.value:g} with the interval {self.low:g} to {self.high:g}.",
                "The interval must contain the estimate; state a reason where nothing was measured.",
            )

    @classmethod
    def missing(cls, reason: str) -> "Measured":
        """A number that was not measured, and why."""
        return cls(math.nan, reason=reason)

    @classmethod
    def normal(cls, value: float, deviation: float, count: int = 0, least: float = -math.inf) -> "Measured":
        """An estimate with this standard deviation; the interval is cut at the least possible value."""
        half = NORMAL_QUANTILE * deviation
        return cls(float(value), float(max(value - half, min(least, value))), float(value + half), count)

    @property
    def is_measured(self) -> bool:
        """Whether there is a number."""
        return not self.reason

    def contains(self, value: float) -> bool:
        """Whether the interval contains a value."""
        return self.low <= value <= self.high

    def deviation_towards(self, value: float) -> float:
        """Standard deviation of the estimate on the side of a value, read off the interval."""
        side = self.high - self.value if value > self.value else self.value - self.low
        return side / NORMAL_QUANTILE

    def as_dict(self) -> dict[str, Any]:
        """Value, ends of the interval and count, or the reason."""
        if self.reason:
            return {"reason": self.reason}
        return {"value": self.value, "low": self.low, "high": self.high, "count": self.count}
