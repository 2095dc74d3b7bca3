"""Slope of a line through values whose errors are correlated and have outliers, with an interval."""

import math

import numpy as np

from harness.core.arrays import Floats
from harness.core.seeds import generator

_DRAWS = 300
_LEAST_BLOCK = 4


def robust_slope(at: Floats, values: Floats) -> tuple[float, float, float]:
    """Slope of values (N,) over rising places (N,), and the ends of its 95 % interval.

    The slope is the median over all pairs (Theil and Sen). Its interval is the wider one of two. One is Sen's, for
    independent errors. The other comes from residuals drawn in blocks, for errors that are correlated over several
    values (Kunsch 1989, Ann. Stat. 17), widened for the few blocks.
    """
    from scipy import special, stats

    slope, _, low, high = (float(one) for one in stats.theilslopes(values, at, 0.95))
    count = len(values)
    length = max(round(2.0 * math.sqrt(count)), _LEAST_BLOCK)
    blocks = count / length
    if blocks < 2.0:
        return slope, low, high
    first, second = np.triu_indices(count, 1)
    apart = at[second] - at[first]
    residual = values - slope * at
    rng = generator(0, "slope")
    begins = rng.integers(0, count - length + 1, size=(_DRAWS, math.ceil(blocks)))
    drawn = residual[(begins[:, :, None] + np.arange(length)).reshape(_DRAWS, -1)[:, :count]]
    slopes = np.array([np.median((one[second] - one[first]) / apart) for one in drawn])
    scatter = float(np.std(slopes)) * math.sqrt(blocks / (blocks - 1.0))
    half = scatter * float(special.stdtrit(max(blocks - 2.0, 1.0), 0.975))
    return slope, min(low, slope - half), max(high, slope + half)
