"""Times of samples, which need no even rate: their period, and a grid on which each has a place of its own."""

from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Floats

LOST_STEP = 1.8
"""Steps of more medians than this passed over a sample, and do not count in the period [choice]."""
OWN_PLACES = 0.99
"""Least share of the samples that have a place of their own on a grid."""
MOST_PLACES = 8
"""Most places of a grid for each period."""


def mean_period_s(times_s: Sequence[Floats]) -> float:
    """Mean step between the times of each series (N,) [s], without steps over lost samples; NaN times are left out.

    The steps of an uneven source, and of times that are printed to 10 ms, scatter about it; their median is rounded.
    """
    step_s = np.concatenate([np.diff(np.unique(one[np.isfinite(one)])) for one in times_s])
    return float(step_s[step_s < LOST_STEP * np.median(step_s)].mean()) if len(step_s) else np.nan


def own_places_s(times_s: Sequence[Floats], period_s: float) -> float:
    """The longest step of a grid, a period or a part of one, on which nearly every sample has its own place [s]."""
    for places in range(1, MOST_PLACES):
        if _own_share(times_s, period_s / places) >= OWN_PLACES:
            return period_s / places
    return period_s / MOST_PLACES


def _own_share(times_s: Sequence[Floats], step_s: float) -> float:
    """Share of the times that do not share their place on a grid, which begins with the first of each series."""
    own, total = 0, 0
    for one in times_s:
        known = np.unique(one[np.isfinite(one)])
        own += len(np.unique(np.rint((known - known[0]) / step_s))) if len(known) else 0
        total += len(known)
    return own / max(total, 1)


def describe_sampling(name: str, time_s: Floats, counted: str = "") -> str:
    """A sentence on the rising times (N,) of a source [s]: period, range of its steps, and time without samples.

    `counted` says how samples were counted where the source has no times, which then show nothing.
    """
    if len(time_s) < 2:
        return f"{name}: {len(time_s)} pose."
    if counted:
        return f"{name}: {len(time_s):,} poses without times, {counted}."
    step_s, period_s = np.diff(time_s), mean_period_s([time_s])
    low, high = np.quantile(step_s, [0.05, 0.95]).tolist()
    evenness = "evenly" if own_places_s([time_s], period_s) == period_s else "unevenly"
    lost_s = float(np.sum(step_s[step_s >= LOST_STEP * np.median(step_s)] - period_s))
    lost = f", without {lost_s:.1f} of {time_s[-1] - time_s[0]:.1f} s" if lost_s > 0.0 else ""
    return (
        f"{name}: {len(time_s):,} poses, {evenness}, every {1e3 * period_s:.1f} ms in the mean "
        f"(90 % of the steps: {1e3 * low:.0f} to {1e3 * high:.0f} ms){lost}."
    )
