"""Share of the samples that belong to episodes of different length."""

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import Interval


def episode_share(lengths: Floats, total: int, longest: float) -> Interval:
    """Share of `total` samples in episodes of these lengths, which come independently of each other.

    The number of episodes is a Poisson count that is weighted by their lengths; the interval is that of Fay and Feuer
    1997 (Statistics in Medicine 16), which also holds for few episodes. `longest` is the length that an episode may
    have, that of the longest one of all stations. Episodes do not overlap, so that a large share scatters less.
    """
    from scipy import special

    if not total:
        return Interval.missing("There is no reading at rest.")
    added = max(float(longest), float(lengths.max(initial=0.0)), 1.0)
    counted = float(lengths.sum())
    share = counted / total
    variance = float(np.sum(lengths**2))
    apart = 1.0 - share

    def end(tail: float, mean: float, spread: float) -> float:
        """Quantile of the gamma distribution with this mean and variance."""
        return spread / mean * float(special.gammaincinv(mean**2 / spread, tail)) if mean else 0.0

    low = end(0.025, counted, variance)
    high = end(0.975, counted + added, variance + added**2)
    ends = [counted + apart * (limit - counted) for limit in (low, high)]
    return Interval(share, max(min(ends[0] / total, share), 0.0), min(max(ends[1] / total, share), 1.0), len(lengths))
