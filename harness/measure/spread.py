"""Spread of the pose of a station at rest, everything included: noise, drift, excursions and echoes."""

from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import Interval
from harness.measure.static_series import StaticSeries

_BLOCK_S = 10.0
"""Length of the blocks whose sums give the interval [s]: ten correlation times of the drift, two excursions."""
_FEWEST_BLOCKS = 4


def rest_spread(series: Sequence[StaticSeries], name: str) -> Interval:
    """Root mean square of the distance (`position_m`) or angle (`rotation_rad`) from the resting pose.

    The interval is that of the mean square over blocks of ten seconds, by Student's t.
    """
    from scipy import special

    sums: list[tuple[float, int]] = []
    for one in series:
        squared: Floats = np.sum(getattr(one, name) ** 2, axis=1)
        size = round(_BLOCK_S * one.rate_hz)
        for begin in range(0, len(one) - size + 1, size):
            known = squared[begin : begin + size][one.valid[begin : begin + size]]
            sums.append((float(known.sum()), len(known)))
    if len(sums) < _FEWEST_BLOCKS:
        return Interval.missing(f"{_FEWEST_BLOCKS * _BLOCK_S:g} s of rest are needed.")
    above, below = np.array(sums).T
    ratio = float(above.sum() / below.sum())
    count = len(above)
    deviation = float(np.sqrt(count / (count - 1) * np.sum((above - ratio * below) ** 2)) / below.sum())
    half = float(special.stdtrit(count - 1, 0.975)) * deviation
    low, middle, high = np.sqrt(np.maximum([ratio - half, ratio, ratio + half], 0.0)).tolist()
    return Interval(middle, low, high, int(below.sum()))
