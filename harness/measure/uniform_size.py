"""Ends of a uniform distribution from values that were measured with a normal error."""

from collections.abc import Callable

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import Interval

FEWEST_VALUES = 10
_TRIMMED = 4
"""Values at each end that may be strays, when a start is chosen."""
_CUT = 0.5 * 5.991
"""Half the 95 % quantile of chi-square with two degrees of freedom. Without measurement errors twice the log-likelihood
ratio of an end has that distribution; with large ones it has one degree of freedom, and the interval is then wider."""


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
    allowed = cost(low, high) + _CUT

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
