"""Length of a recording that shows a rate with a wanted precision."""

import math

from harness.core.number_format import NORMAL_QUANTILE
from harness.errors import BadInput


def events_for_precision(precision: float) -> int:
    """Number of events whose count has a 95 % interval of this relative half width, such as 0.2 for 20 %.

    The count of a Poisson process has a relative standard deviation of 1 / sqrt(count). BadInput unless the precision
    is between 0 and 1.
    """
    if not 0.0 < precision < 1.0:
        raise BadInput(f"A precision of {precision:g}.", "Give a share between 0 and 1, such as 0.2 for 20 %.")
    return math.ceil((NORMAL_QUANTILE / precision) ** 2)


def recording_minutes(precision: float, events_per_min: float, stations: int) -> float:
    """Minutes after which all stations together have had enough events; BadInput for a rate that is not positive."""
    if not events_per_min > 0.0 or stations < 1:
        found = f"{events_per_min:g} events a minute at {stations} stations."
        raise BadInput(found, "Give a rate above zero and at least one station.")
    return events_for_precision(precision) / (events_per_min * stations)
