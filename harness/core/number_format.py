"""How tables, charts and sentences write numbers, and a number with its 95 % interval.

Decimals follow the unit or the interval's width; there is a true minus sign and no negative zero.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

from harness.errors import BadInput

NOT_MEASURED = "not measured"
MINUS = "−"
_DECIMALS = {"deg": 2, "mm": 1, "mm/s": 1, "m/s³": 1, "ms": 2, "frames/s": 0, "%": 1}
"""Decimals that suit a unit; 2 for others."""


def format_fixed(value: float | None, decimals: int, *, signed: bool = False, grouped: bool = False) -> str:
    """A number with fixed decimals; `NOT_MEASURED` for None.

    `signed` also writes "+"; `grouped` separates thousands by commas.
    """
    if value is None:
        return NOT_MEASURED
    text = f"{value:{'+' if signed else ''}{',' if grouped else ''}.{decimals}f}"
    is_zero = not text.strip("+-0.,")
    return (text.lstrip("+-") if is_zero else text).replace("-", MINUS)


def format_number(value: float | None, unit: str, *, decimals: int = 0, signed: bool = False) -> str:
    """A number with the decimals of its unit, or `decimals` if that is more; thousands are separated by commas."""
    return format_fixed(value, max(decimals, _DECIMALS.get(unit, 2)), signed=signed, grouped=True)


def format_mean_sd(mean: float | None, sd: float | None, decimals: int) -> str:
    """ "1.90 ± 0.12"; the mean alone where there is no standard deviation, `NOT_MEASURED` without a mean."""
    spread = "" if mean is None or sd is None else f" ± {format_fixed(sd, decimals)}"
    return f"{format_fixed(mean, decimals)}{spread}"


def format_share(share: float | None, decimals: int = 0) -> str:
    """A share of 1 in per cent, "93 %"; `NOT_MEASURED` for None."""
    return NOT_MEASURED if share is None else f"{format_fixed(100.0 * share, decimals)} %"


def format_change_percent(percent: float) -> str:
    """A relative change in per cent with its sign and two significant digits; a dash for NaN."""
    if math.isnan(percent):
        return "–"
    size = abs(percent)
    decimals = 0 if size >= 9.95 else 1 if size >= 0.0995 else 2
    text = format_fixed(percent, decimals, signed=True, grouped=True)
    return f"{text if text.strip('0.') else '0'} %"


def format_p_value(p: float | None) -> str:
    """Three decimals, "< 0.001" below; a dash for None."""
    if p is None:
        return "–"
    return "< 0.001" if p < 0.0005 else f"{p:.3f}"


def decimals_for(*values: float | None, digits: int = 1, most: int = 4) -> int:
    """Decimals that show `digits` significant digits of the smallest value that is not zero; from 0 to `most`."""
    smallest = min((abs(value) for value in values if value), default=1.0)
    return min(most, max(0, digits - 1 - math.floor(math.log10(smallest))))


def count_noun(count: int, noun: str) -> str:
    """ "1 clip", "1,200 clips"."""
    return f"{count:,} {noun}{'' if count == 1 else 's'}"


NORMAL_QUANTILE = 1.959963984540054
"""Half width of a normal 95 % interval, in standard deviations."""
CHI_QUANTILE = 2.795483482915108
"""95 % quantile of the length of a vector of three standard normal numbers."""
_MOST_DECIMALS, _MOST_DIGITS = 6, 7
_ROUNDING = 1e-12
"""Numbers and widths up to it are rounding of the machine, in all units that are shown."""


@dataclass(frozen=True)
class Interval:
    """A number that was estimated; `str` gives "1.20 mm (1.19 to 1.21)", with digits that suit the width."""

    value: float
    """Estimate; NaN if it was not measured."""
    low: float = math.nan
    """Lower end of the 95 % interval, in the unit of the value; NaN where it was not computed."""
    high: float = math.nan
    """Upper end."""
    count: int = 0
    """Number of observations that the estimate rests on, such as events or samples."""
    reason: str = ""
    """Reason why the number was not measured; "" if it was."""
    unit: str = ""
    """Unit that stands behind the number; "" without one, or where the head of a column names it."""
    signed: bool = False
    """Whether a positive number has a plus sign, as a difference has."""

    def __post_init__(self) -> None:
        if self.reason or (math.isnan(self.low) and math.isnan(self.high) and not math.isnan(self.value)):
            return
        if not self.low <= self.value <= self.high:
            raise BadInput(
                f"An estimate of {self.value:g} with the interval {self.low:g} to {self.high:g}.",
                "The interval must contain the estimate; state a reason where nothing was measured.",
            )

    @classmethod
    def missing(cls, reason: str) -> "Interval":
        """A number that was not measured, and why."""
        return cls(math.nan, reason=reason)

    @classmethod
    def normal(cls, value: float, deviation: float, count: int = 0, least: float = -math.inf) -> "Interval":
        """An estimate with this standard deviation; the interval is cut at the least possible value."""
        half = NORMAL_QUANTILE * deviation
        return cls(float(value), float(max(value - half, min(least, value))), float(value + half), count)

    @classmethod
    def of(
        cls, value: float | None, low: float | None, high: float | None, unit: str = "", *, signed: bool = False
    ) -> "Interval":
        """An estimate from findings, where None stands for what was not measured or computed.

        An end that rounding put on the wrong side of the estimate is moved to it.
        """
        if value is None:
            return cls.missing(NOT_MEASURED)
        if low is None or high is None:
            return cls(value, unit=unit, signed=signed)
        return cls(value, min(low, value), max(high, value), unit=unit, signed=signed)

    @property
    def is_measured(self) -> bool:
        """Whether there is a number."""
        return not self.reason

    @property
    def has_interval(self) -> bool:
        """Whether the ends are known and differ by more than rounding."""
        return self.is_measured and self.low < self.high and not self._is_exact

    @property
    def _is_exact(self) -> bool:
        return math.isclose(self.low, self.high, rel_tol=1e-12, abs_tol=_ROUNDING)

    def contains(self, value: float) -> bool:
        """Whether the interval contains a value."""
        return self.low <= value <= self.high

    def deviation_towards(self, value: float) -> float:
        """Standard deviation of the estimate on the side of a value, read off the interval."""
        side = self.high - self.value if value > self.value else self.value - self.low
        return side / NORMAL_QUANTILE

    def scaled(self, factor: float, unit: str = "") -> "Interval":
        """Convert to another unit, of which `factor` make one of the present unit."""
        low, high = sorted((factor * self.low, factor * self.high))
        return replace(self, value=factor * self.value, low=low, high=high, unit=unit)

    def as_dict(self) -> dict[str, Any]:
        """Value, ends of the interval and count, or the reason."""
        if self.reason:
            return {"reason": self.reason}
        return {"value": self.value, "low": self.low, "high": self.high, "count": self.count}

    @property
    def number(self) -> str:
        """The estimate with its unit, "1.20 mm"; "not measured" without one."""
        if not self.is_measured:
            return NOT_MEASURED
        nothing = not self.value or (self._is_exact and abs(self.value) <= _ROUNDING)
        return f"{'0' if nothing else self._write(self.value)} {self.unit}".rstrip()

    @property
    def ends(self) -> str:
        """The interval without a unit, "1.19 to 1.21"; "" where it was not computed.

        "exact" where it has no width, unless the number is a difference.
        """
        if not self.is_measured or math.isnan(self.low):
            return ""
        if self._is_exact and not self.signed:
            return "exact"
        low, high = self._write(self.low), self._write(self.high)
        if low == high and not self._is_exact:  # it has no visible width
            half = 0.5 * (self.high - self.low)
            return f"± {format_fixed(half, decimals_for(half, most=12))}"
        return f"{low} to {high}"

    def __str__(self) -> str:
        return f"{self.number} ({self.ends})" if self.has_interval else self.number

    def _write(self, value: float) -> str:
        if math.isinf(value):
            return "∞" if value > 0.0 else "−∞"
        return format_fixed(value, self._decimals(), signed=self.signed, grouped=True)

    def _decimals(self) -> int:
        """Decimals that show two digits of half the width, and at most seven digits of the value.

        Zeros that end all three numbers are left out.

        Without a finite width, those of three significant digits; of four where the number is exact.
        """
        half = 0.5 * (self.high - self.low)
        if not (self.has_interval and math.isfinite(half)):
            text = f"{self.value:.{4 if self._is_exact else 3}g}"
            digits, _, exponent = text.partition("e")
            return max(len(digits.partition(".")[2]) - int(exponent or 0), 0)
        most = decimals_for(self.value or half, digits=_MOST_DIGITS, most=_MOST_DECIMALS)
        decimals = min(decimals_for(half, digits=2, most=_MOST_DECIMALS), most)
        texts = [f"{number:.{decimals}f}" for number in (self.value, self.low, self.high)]
        zeros = min(len(text) - len(text.rstrip("0")) for text in texts) if decimals else 0
        return max(decimals - zeros, 0)
