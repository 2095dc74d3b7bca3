"""Paired differences over units: the mean, its 95 % interval, and the verdict on a claim.

A unit is what statistics count: a performer by default (see `units`). Another study would sample other units. Frames of
a clip and clips of a performer are not independent.

The interval is the wider of two at each end: Student's t, which holds for normal and heavy-tailed differences, and the
studentized bootstrap (Efron 1982, "bootstrap-t"), which holds for skewed ones and where few units differ. `harness
bench gate` prints how often it contains the mean of the population, for eight kinds of differences.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import special

from harness.compare.units import Sampling, average_units
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.results.findings import Verdict

MIN_UNITS = 6
"""Least number of units that can show a difference: with five, sign flips give a p of 2/32 or more."""
CONFIDENCE_LEVEL = 0.95
LEAST_DEVIATION = 0.2
"""Least standard deviation of a resample, as a share of that of all values. Where few units differ, some resamples have
none of them, and their t statistic has no limit [choice]."""
_RESAMPLES, _DRAWN_AT_ONCE, _MAX_CACHED = 2000, 250, 64


@dataclass(frozen=True)
class PairedDifference:
    """Differences a - b over the units on which both were measured."""

    units: tuple[str, ...]
    mean: float | None
    """Mean difference; None without units."""
    low: float | None = None
    """Lower end of the 95 % interval; None with fewer than `MIN_UNITS` units."""
    high: float | None = None
    """Upper end."""

    @property
    def verdict(self) -> Verdict:
        """Verdict on the claim that a is greater than b."""
        if not self.units:
            return "not run"
        if self.low is None or self.high is None or self.low <= 0.0 <= self.high:
            return "cannot tell"
        return "reproduced" if self.low > 0.0 else "not reproduced"

    @property
    def why(self) -> str:
        """Reason for the verdict; "" where it is "reproduced"."""
        if not self.units:
            return "no unit was measured on both sides"
        if self.low is None:
            return f"too few units: {len(self.units)}, of at least {MIN_UNITS}"
        return {"cannot tell": "the interval contains zero", "not reproduced": "the difference has the other sign"}.get(
            self.verdict, ""
        )


def compare_paired(
    a: Mapping[str, float | None], b: Mapping[str, float | None], sampling: Sampling | None = None
) -> PairedDifference:
    """Compare errors by unit; a unit that either side lacks (or has None for) is left out.

    With `sampling` the errors are by clip, and the differences of the clips of a unit are averaged.

    All units must be of one kind: never put known and new performers, or two splits, into one mapping. BadInput for a
    number that is not finite.
    """
    units = tuple(sorted(unit for unit in a if a[unit] is not None and b.get(unit) is not None))
    difference = np.array([a[unit] for unit in units], float) - np.array([b[unit] for unit in units], float)
    if sampling is not None:
        averaged = average_units(dict(zip(units, difference.tolist(), strict=True)), sampling)
        units, difference = tuple(averaged), np.array(list(averaged.values()))
    if not np.isfinite(difference).all():
        wrong = units[int(np.flatnonzero(~np.isfinite(difference))[0])]
        raise BadInput(f"The errors on {wrong} are not finite.", "Use None for what was not measured.")
    if not units:
        return PairedDifference((), None)
    mean = float(difference.mean())
    if len(units) < MIN_UNITS:
        return PairedDifference(units, mean)
    return PairedDifference(units, mean, *mean_interval(difference))


def mean_interval(values: Floats, level: float = CONFIDENCE_LEVEL) -> tuple[float, float]:
    """Interval of the mean of the population of (n,) independent values, n >= 2; deterministic, in any order.

    Fewer than `MIN_UNITS` values have too few resamples. They get Student's t interval, which is exact for normal
    values.
    """
    mean, count = float(values.mean()), len(values)
    if float(np.ptp(values)) <= 1e-9 * float(np.abs(values).max()):  # all equal: nothing to resample
        return mean, mean
    deviation = float(values.std(ddof=1))
    high = float(special.stdtrit(count - 1, 0.5 + 0.5 * level))
    low = -high
    if count >= MIN_UNITS:
        studentized = _studentized_means(np.sort((values - mean) / deviation))
        ends = np.quantile(studentized, (0.5 - 0.5 * level, 0.5 + 0.5 * level))
        low, high = min(low, float(ends[0])), max(high, float(ends[1]))
    error = deviation / np.sqrt(count)
    return mean - high * error, mean - low * error


def _studentized_means(values: Floats) -> Floats:
    """(R,) t statistics of resamples of (n,) sorted values of mean 0 and standard deviation 1."""
    count = len(values)
    grid = np.round(values * 2.0**20) / 2.0**20  # sums of these and of their squares are exact in any order
    parts = []
    for times in _resamples(count):
        mean = times @ grid / count
        variance = np.maximum(times @ grid**2 - count * mean**2, 0.0) / (count - 1)
        parts.append(np.sqrt(count) * mean / np.sqrt(np.maximum(variance, LEAST_DEVIATION**2)))
    return np.concatenate(parts)


def _resamples(count: int) -> Iterable[Floats]:
    """How often each of `count` values is in each resample, as arrays (R, count).

    The resamples and their mirror images are equally many, so that the interval of -x is the mirror image of that of x.
    """
    return (_cached_resamples(count),) if count <= _MAX_CACHED else _draw_resamples(count)


@lru_cache(maxsize=32)
def _cached_resamples(count: int) -> Floats:
    return np.concatenate(list(_draw_resamples(count)))


def _draw_resamples(count: int) -> Iterator[Floats]:
    rng = generator(0, "studentized bootstrap", count)
    for _ in range(_RESAMPLES // _DRAWN_AT_ONCE):
        times = rng.multinomial(count, np.full(count, 1.0 / count), _DRAWN_AT_ONCE).astype(float)
        yield np.concatenate([times, times[:, ::-1]])


def round_to_grid(values: Floats) -> Floats:
    """Round (n,) values, not all zero, to 2^-40 of the largest.

    Sums of the rounded values are exact in any order, so that sums which are equal on paper are equal here.
    """
    grid = 2.0 ** (np.ceil(np.log2(np.abs(values).max())) - 40)
    rounded: Floats = grid * np.round(values / grid)
    return rounded
