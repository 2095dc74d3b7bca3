"""Common length of vectors in the plane that were measured with a normal error."""

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import Interval

FEWEST_VECTORS = 10
_STRAYS = 0.05
"""Share of lengths that may be anything up to ten times the median: episodes that were not recognised."""
_CUT = 0.5 * 3.841
"""Half the 95 % quantile of chi-square with one degree of freedom."""


def fit_length(lengths: Floats, deviation: float) -> Interval:
    """The length behind (N,) measured lengths of plane vectors, each axis with an error of this deviation.

    A measured length has the distribution of Rice 1945. The interval is that of the likelihood ratio.
    """
    from scipy import optimize, special

    if len(lengths) < FEWEST_VECTORS:
        return Interval.missing(f"There are {len(lengths)} undisturbed coastings, of at least {FEWEST_VECTORS}.")
    floor = _STRAYS / (10.0 * float(np.median(lengths)))

    def cost(length: float) -> float:
        argument = lengths * length / deviation**2
        density = lengths / deviation**2 * np.exp(-0.5 * ((lengths - length) / deviation) ** 2) * special.i0e(argument)
        return -float(np.sum(np.log((1.0 - _STRAYS) * density + floor)))

    most = 3.0 * float(np.median(lengths)) + 3.0 * deviation
    places = np.linspace(0.0, most, 200)
    near = float(places[np.argmin([cost(place) for place in places.tolist()])])
    step = float(places[1])
    found = optimize.minimize_scalar(cost, bounds=(max(near - step, 0.0), near + step), method="bounded")
    best, allowed = float(found.x), float(found.fun) + _CUT
    low = 0.0 if cost(0.0) <= allowed else float(optimize.brentq(lambda v: cost(v) - allowed, 0.0, best))
    high = float(optimize.brentq(lambda v: cost(v) - allowed, best, 2.0 * most)) if cost(2.0 * most) > allowed else most
    return Interval(best, low, max(high, best), len(lengths))
