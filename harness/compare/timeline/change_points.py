"""Change points of series: entries from which on the mean of a metric is another.

Binary segmentation (Scott and Knott 1974): the split with the largest weighted difference of means (CUSUM) is tested,
and both parts are searched again. Windows of 1, 2, 4, ... entries before and after a split find a short excursion too.

Two noise models give the p of the largest difference of all splits and windows:

- Units. The differences of units between entries are paired, and their signs are flipped, all of a unit together. This
  allows any dependence between entries, such as a change that moves each unit by chance and stays.
- Entries. Where there are too few units for that, and for times, whose noise all units of a run share: the noise of the
  means is normal and independent between entries. Its scale is robust: that of the differences of neighbours.

A change counts if its p after Holm's correction over the series is at most `CHANGE_LEVEL` and it exceeds the margin.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from harness.compare.margins import Margin
from harness.compare.paired_statistics import mean_interval
from harness.compare.significance import count_needed, holm, largest_mean_p
from harness.core.arrays import Floats
from harness.core.seeds import generator

CHANGE_LEVEL = 0.005
"""Stricter than that of a comparison: a timeline is read after every commit."""
MIN_ENTRIES = 8
"""Least number of entries whose noise can be estimated from the entries [choice]."""
_SIMULATIONS, _SIMULATED_AT_ONCE = 20_000, 500
_MAD_OF_NORMAL = 0.6744897501960817


@dataclass(frozen=True, eq=False)
class MetricSeries:
    """One metric of one method over T comparable entries and U units."""

    values: Floats
    """(T, U)."""
    margin: Margin
    entries_vary: bool = False
    """Whether all units of an entry share its noise, as times do. A single entry then shows no change."""


@dataclass(frozen=True)
class ChangePoint:
    """A change of the mean between entries `at` - 1 and `at`."""

    at: int
    difference: float
    """Mean of the entries up to the next change minus that of those since the last one."""
    low: float | None
    """Ends of its 95 % interval over units; None with one unit, and for times."""
    high: float | None
    p: float
    """After Holm's correction."""


def find_changes(series: Sequence[MetricSeries]) -> list[list[ChangePoint]]:
    """The changes of each series, in the order of the entries."""
    counted = sum(bool(np.ptp(each.values, axis=0).any()) for each in series)
    found: list[dict[int, float]] = [{} for _ in series]
    parts = [(at, 0, len(each.values)) for at, each in enumerate(series)]
    while parts:
        splits = {part: _best_split(series[part[0]], *part[1:]) for part in parts}
        tested = {part: split for part, split in splits.items() if split is not None}
        p = [_p_of_split(series[part[0]], *part[1:], counted) for part in tested]
        others = sum(bool(np.ptp(series[n].values[a:b], axis=0).any()) for n, a, b in parts if (n, a, b) not in tested)
        corrected = holm([*p, *[1.0] * others])
        parts = []
        for ((n, start, stop), split), p_holm in zip(tested.items(), corrected, strict=False):
            if p_holm <= CHANGE_LEVEL:
                found[n][split] = p_holm
                parts += [(n, start, split), (n, split, stop)]
    return [_describe(each, changes) for each, changes in zip(series, found, strict=True)]


def _describe(series: MetricSeries, changes: dict[int, float]) -> list[ChangePoint]:
    at = sorted(changes)
    ends = [0, *at, len(series.values)]
    points = []
    for before, split, after in zip(ends, at, ends[2:], strict=False):
        difference = series.values[split:after].mean(axis=0) - series.values[before:split].mean(axis=0)
        has_interval = len(difference) > 1 and not series.entries_vary
        low, high = mean_interval(difference) if has_interval else (None, None)
        points.append(ChangePoint(split, float(difference.mean()), low, high, changes[split]))
    return points


def _best_split(series: MetricSeries, start: int, stop: int) -> int | None:
    """The split with the largest weighted difference; None if that is within the margin or zero."""
    values = _searched(series, start, stop)
    if len(values) < 2:
        return None
    splits, weights, contrasts = _contrasts(values)
    means = contrasts.mean(axis=1)
    best = int(np.argmax(weights * np.abs(means)))
    split = int(splits[best])
    before = float(values[:split].mean())
    return start + split if abs(means[best]) > series.margin.of(before) else None


def _searched(series: MetricSeries, start: int, stop: int) -> Floats:
    """The values between two entries; of a series whose entries vary the running medians of the means."""
    values = series.values[start:stop]
    return _running_medians(values.mean(axis=1, keepdims=True)) if series.entries_vary else values


def _running_medians(values: Floats) -> Floats:
    """(T, N) medians of three neighbours, at an end those of the last three."""
    if len(values) < 3:
        return values
    inside = np.median(np.stack([values[:-2], values[1:-1], values[2:]]), axis=0)
    return np.concatenate([inside[:1], inside, inside[-1:]])


def _contrasts(values: Floats) -> tuple[Floats, Floats, Floats]:
    """Splits (K,), weights (K,) and (K, U) differences of means, of all windows on both sides of all splits."""
    count = len(values)
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values - values[0], axis=0)])
    widths = [2**n for n in range((count - 1).bit_length() + 1)]
    spans = {(at, max(at - width, 0), min(at + width, count)) for at in range(1, count) for width in widths}
    split, low, high = np.array(sorted(spans), dtype=int).T
    before, after = split - low, high - split
    contrasts = (sums[high] - sums[split]) / after[:, None] - (sums[split] - sums[low]) / before[:, None]
    return split, np.sqrt(before * after / (before + after)), contrasts


def _p_of_split(series: MetricSeries, start: int, stop: int, lines: int) -> float:
    values = _searched(series, start, stop)
    _, weights, contrasts = _contrasts(values)
    units = int(np.ptp(values, axis=0).astype(bool).sum())
    if not series.entries_vary and units >= count_needed(lines, CHANGE_LEVEL):
        return largest_mean_p((weights[:, None] * contrasts).T)
    if len(values) < MIN_ENTRIES:
        return 1.0
    scale = _robust_scale(series.values[start:stop].mean(axis=1)[None])[0]
    largest = float((weights * np.abs(contrasts.mean(axis=1))).max())
    if scale <= 1e-9 * largest:
        return 1.0 / (1 + _SIMULATIONS)
    extreme = np.count_nonzero(_simulated(len(values), series.entries_vary) >= largest / scale)
    return float((1 + extreme) / (1 + _SIMULATIONS))


def _robust_scale(means: Floats) -> Floats:
    """(N,) standard deviations of (N, T) series: the median size of the differences of neighbours."""
    sizes = np.abs(np.diff(means, axis=1))
    scale: Floats = np.median(sizes, axis=1) / (_MAD_OF_NORMAL * np.sqrt(2.0))
    return scale


@lru_cache(maxsize=64)
def _simulated(count: int, entries_vary: bool) -> Floats:
    """(N,) largest weighted differences, in robust standard deviations, of series of normal noise."""
    rng = generator(0, "change points", count)
    parts = []
    for _ in range(_SIMULATIONS // _SIMULATED_AT_ONCE):
        draws = rng.normal(size=(count, _SIMULATED_AT_ONCE))
        _, weights, contrasts = _contrasts(_running_medians(draws) if entries_vary else draws)
        parts.append((weights[:, None] * np.abs(contrasts)).max(axis=0) / _robust_scale(draws.T))
    return np.concatenate(parts)
