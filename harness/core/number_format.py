"""How tables, charts and sentences write numbers: decimals by unit, a true minus sign, no negative zero."""

import math

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
