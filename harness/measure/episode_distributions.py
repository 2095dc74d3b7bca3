"""Distributions behind episodes: share and number, the ends of a uniform distribution, and the length of vectors."""

import math
from collections.abc import Callable

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import NORMAL_QUANTILE, Interval
from harness.errors import BadInput

FEWEST_VALUES = 10
_TRIMMED = 4
"""Values at each end that may be strays, when a start is chosen."""
_CUT_OF_ENDS = 0.5 * 5.991
"""Half the 95 % quantile of chi-square with two degrees of freedom. Without measurement errors twice the log-likelihood
ratio of an end has that distribution; with large ones it has one degree of freedom, and the interval is then wider."""
FEWEST_VECTORS = 10
_STRAYS = 0.05
"""Share of lengths that may be anything up to ten times the median: episodes that were not recognised."""
_CUT_OF_LENGTH = 0.5 * 3.841
"""Half the 95 % quantile of chi-square with one degree of freedom."""


def fit_uniform(values: Floats, deviation: float, *, strays: float = 0.0) -> tuple[Interval, Interval, Interval]:
    """Lower end, upper end and mean of the uniform distribution behind (N,) values with errors of this deviation.

    `strays` is the share of values that may be anywhere between zero and twice the largest value: they move the mean,
    but not the ends.
    The ends are those of the largest likelihood, their intervals are of the profile likelihood.
    """
    from scipy import optimize, special

    count = len(values)
    if count < FEWEST_VALUES:
        missing = Interval.missing(f"There are {count} events, of at least {FEWEST_VALUES}.")
        return missing, missing, missing
    deviation = max(deviation, 1e-9 * float(np.ptp(values)), 1e-12)
    spread = float(values.std(ddof=1))
    mean = Interval.normal(float(values.mean()), spread / np.sqrt(count), count)
    width = max(float(np.ptp(values)), deviation)

    floor = strays / (2.0 * float(np.abs(values).max()))

    def cost(low: float, high: float) -> float:
        if high - low < 1e-3 * deviation:
            return float(np.inf)
        inside = special.ndtr((values - low) / deviation) - special.ndtr((values - high) / deviation)
        density = (1.0 - strays) * inside / (high - low) + floor
        return -float(np.sum(np.log(np.maximum(density, 1e-300))))

    step = width / count
    ordered = np.sort(values)
    trimmed = range(_TRIMMED if strays else 1)  # a stray at an end is a maximum of its own
    pairs = [(float(ordered[i]), float(ordered[-1 - j])) for i in trimmed for j in trimmed]
    start = np.array(min(pairs, key=lambda ends: cost(*ends))) + step * np.array([[0.0, 0.0], [-1.0, 0.0], [0.0, 1.0]])

    def cost_of_ends(ends: Floats) -> float:
        return cost(float(ends[0]), float(ends[1]))

    found = optimize.minimize(cost_of_ends, start[0], method="Nelder-Mead", options={"initial_simplex": start})
    low, high = (float(end) for end in found.x)
    allowed = cost(low, high) + _CUT_OF_ENDS

    def excess_of_low(end: float) -> float:
        return _least(lambda other: cost(end, other), high, 6.0 * deviation + step) - allowed

    def excess_of_high(end: float) -> float:
        return _least(lambda other: cost(other, end), low, 6.0 * deviation + step) - allowed

    lower, upper = (
        Interval(at, _crossing(excess, at, -step), _crossing(excess, at, step), count)
        for excess, at in ((excess_of_low, low), (excess_of_high, high))
    )
    return lower, upper, mean


def _least(cost: Callable[[float], float], near: float, reach: float) -> float:
    """The least cost near a place."""
    from scipy import optimize

    return float(optimize.minimize_scalar(cost, bounds=(near - reach, near + reach), method="bounded").fun)


def _crossing(excess: Callable[[float], float], at: float, step: float) -> float:
    """The first place in the direction of `step` where a function that is negative at `at` becomes positive."""
    from scipy import optimize

    inside, size = at, step
    for _ in range(60):
        outside = at + size
        if not excess(outside) < 0.0:
            return float(optimize.brentq(lambda v: min(excess(v), 1e6), inside, outside, xtol=1e-4 * abs(step)))
        inside, size = outside, 1.6 * size
    return inside


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
    best, allowed = float(found.x), float(found.fun) + _CUT_OF_LENGTH
    low = 0.0 if cost(0.0) <= allowed else float(optimize.brentq(lambda v: cost(v) - allowed, 0.0, best))
    high = float(optimize.brentq(lambda v: cost(v) - allowed, best, 2.0 * most)) if cost(2.0 * most) > allowed else most
    return Interval(best, low, max(high, best), len(lengths))


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
