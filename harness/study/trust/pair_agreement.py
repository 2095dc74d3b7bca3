"""Agreement of the two sides: equivalence in a metric, the order of pairs of arms, and rank correlations.

Both sides perform the same motions. What a motion does to the difference of two arms is therefore no error of the
comparison, and the order is judged on these motions alone. The noise of a simulated difference is read off its seeds.
That of the device is read off the scatter, unit by unit, of device minus simulation. The scatter is a little too large:
it also holds the simulation's noise, and whatever the simulation gets wrong from unit to unit. A unit is a clip, or a
performer where the plan declares performers.

Two arms agree or contradict only where both sides show a difference (see `compare.rank_correlation`), so that at most
the share `level` of the plans has a false contradiction.

Simulation and device are equivalent in a metric at the level a if the interval of the level 1 - 2a of their mean
difference lies within the margin: two one-sided tests (Schuirmann 1987) over units. Equivalence of several arms is
claimed only if each is shown, so that no correction is needed (intersection-union, Berger 1982).
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations

import numpy as np

from harness.compare import (
    MIN_UNITS,
    SIGNIFICANCE,
    decide_pairs,
    mean_interval,
    shared_clips,
    side_difference,
    tau_b,
    tau_interval,
)
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.results.findings import Equivalence, EquivalenceVerdict, PairAgreement, RankCorrelation, SideDifference

ArmErrors = Mapping[str, Mapping[str, Sequence[float | None]]]
"""Arm -> unit (a clip or a performer) -> errors: one for each capture of the device or each seed of the simulation.

None: not measured.
"""
RESAMPLES = 2000
MIN_ARMS = 3
"""Least number of arms with a rank correlation: two are always correlated by 1 or -1."""


def unit_of(clip: str, performers: Mapping[str, str]) -> str:
    """The unit of statistics of a clip: its performer where one is declared, else the clip."""
    return f"performer {performers[clip]}" if clip in performers else clip


def average_performers(errors: ArmErrors, performers: Mapping[str, str], *, paired: bool) -> ArmErrors:
    """Arm -> unit -> errors: the clips of a performer count once, with the mean over them.

    With `paired` the values of the clips belong together one by one, as those of seeds do. Else each clip has one
    value, its mean. A value that a clip lacks is None in the mean.
    """
    averaged: dict[str, dict[str, list[float | None]]] = {}
    for arm, by_clip in errors.items():
        units: dict[str, list[Sequence[float | None]]] = {}
        for clip, values in by_clip.items():
            units.setdefault(unit_of(clip, performers), []).append(values)
        averaged[arm] = {unit: _average(rows, paired=paired) for unit, rows in units.items()}
    return averaged


def _average(rows: Sequence[Sequence[float | None]], *, paired: bool) -> list[float | None]:
    if len(rows) == 1:
        return list(rows[0])
    return [_mean(row) for row in zip(*rows, strict=True)] if paired else [_mean([_mean(row) for row in rows])]


def _mean(values: Sequence[float | None]) -> float | None:
    """The mean; None where a value is missing."""
    measured = [value for value in values if value is not None]
    return sum(measured) / len(measured) if len(measured) == len(values) else None


def judge_pairs(
    device: ArmErrors, simulated: ArmErrors, level: float, pairs: Sequence[tuple[str, str]] | None = None
) -> list[PairAgreement]:
    """Judge pairs of arms, by default all, over the units on which both arms have errors on both sides.

    *Agree* and *contradict*: p after Holm is at most `level`, and the signs of the mean differences are equal or
    opposite. Anything else, and fewer than `MIN_UNITS` units, is undecided.
    """
    chosen = list(combinations(device, 2)) if pairs is None else list(pairs)
    return decide_pairs(chosen, [_compare_sides(device, simulated, pair, level) for pair in chosen], level)


def _compare_sides(
    device: ArmErrors, simulated: ArmErrors, pair: tuple[str, str], level: float
) -> tuple[int, tuple[SideDifference, SideDifference]]:
    """Number of units, and the differences of both sides."""
    found = [_differences(side, pair) for side in (device, simulated)]
    clips = sorted(set(found[0]) & set(found[1]))
    rows = [[side[clip] for clip in clips] for side in found]
    means = [np.array([row.mean() for row in side]) for side in rows]
    if len(clips) < MIN_UNITS:
        first, second = (SideDifference(float(m.mean()) if len(m) else None, None, None, None) for m in means)
        return len(clips), (first, second)
    of_device = float((means[0] - means[1]).var(ddof=1))
    of_simulation, free = of_device, len(clips) - 1
    if all(len(row) > 1 for row in rows[1]):
        of_simulation = float(np.mean([row.var(ddof=1) / len(row) for row in rows[1]]))
        free = sum(len(row) - 1 for row in rows[1])
    first = side_difference(means[0], of_device, len(clips) - 1, level)
    return len(clips), (first, side_difference(means[1], of_simulation, free, level))


def _differences(side: ArmErrors, pair: tuple[str, str]) -> dict[str, Floats]:
    """Unit -> differences of the captures or seeds in which both arms were measured; units without any are left out."""
    first, second = (side.get(arm, {}) for arm in pair)
    rows = {clip: np.array(first[clip], float) - np.array(second[clip], float) for clip in first if clip in second}
    return {clip: row[np.isfinite(row)] for clip, row in rows.items() if np.isfinite(row).any()}


def clip_means(errors: Mapping[str, Sequence[float | None]]) -> dict[str, float]:
    """Unit -> mean over the captures or seeds that were measured; units without any are left out."""
    known = {clip: [value for value in values if value is not None] for clip, values in errors.items()}
    return {clip: sum(values) / len(values) for clip, values in known.items() if values}


def correlate_ranks(device: ArmErrors, simulated: ArmErrors) -> tuple[RankCorrelation, RankCorrelation]:
    """Kendall's tau-b and the sim-to-real correlation of the arms' mean errors.

    The second is Pearson's correlation of performance in simulation and reality (SRCC, Kadian et al. 2020). The 95 %
    interval of tau is what the decided pairs of arms leave. That of the correlation has percentiles over units that are
    drawn again; resamples without a value are left out.
    """
    names = ("Kendall's tau-b", "sim-to-real correlation")
    means = [{arm: clip_means(side.get(arm, {})) for arm in device} for side in (device, simulated)]
    arms = [arm for arm in device if means[0][arm] and means[1][arm]]
    clips = shared_clips(side[arm] for side in means for arm in arms)
    if len(arms) < MIN_ARMS or len(clips) < MIN_UNITS:
        why = f"{len(arms)} arms and {len(clips)} units, of at least {MIN_ARMS} and {MIN_UNITS}"
        first, second = (RankCorrelation(name, None, None, None, why) for name in names)
        return first, second
    sides = [np.array([[side[arm][clip] for clip in clips] for arm in arms]) for side in means]
    drawn = generator(0, "rank correlation").integers(0, len(clips), (RESAMPLES, len(clips)))
    resampled = np.array([_pearson(sides[0][:, k].mean(axis=1), sides[1][:, k].mean(axis=1)) for k in drawn])
    finite = resampled[np.isfinite(resampled)]
    low, high = np.quantile(finite, (0.025, 0.975)) if len(finite) else (np.nan, np.nan)
    intervals = (
        tau_interval(judge_pairs(device, simulated, SIGNIFICANCE, list(combinations(arms, 2)))),
        (float(low), float(high)),
    )
    measures: tuple[Callable[[Floats, Floats], Floats | float], ...] = (tau_b, _pearson)
    found = []
    for name, measure, ends in zip(names, measures, intervals, strict=True):
        value = float(measure(sides[0].mean(axis=1), sides[1].mean(axis=1)))
        if np.isfinite(value):
            found.append(RankCorrelation(name, value, *ends))
        else:
            found.append(RankCorrelation(name, None, None, None, "all arms have the same error on one side"))
    return found[0], found[1]


def _pearson(x: Floats, y: Floats) -> float:
    """Pearson's correlation of (n,) values; NaN if one side is constant."""
    first, second = x - x.mean(), y - y.mean()
    scale = float(np.sqrt((first @ first) * (second @ second)))
    return float(first @ second) / scale if scale else float("nan")


def judge_equivalence(
    arm: str, metric: str, device: Mapping[str, float], simulated: Mapping[str, float], margin: float, level: float
) -> Equivalence:
    """Judge one metric of one arm; `device` and `simulated` map units to errors, and units of both sides count.

    *Equivalent*: the whole interval lies within the margin. *Beyond the margin*: it lies outside as a whole. Anything
    else, and fewer than `MIN_UNITS` units, is undecided.
    """
    units = shared_clips((device, simulated))
    if not units:
        return Equivalence(arm, metric, margin, 0, None, None, None, None, None, "cannot tell", "no unit on both sides")
    sides = [np.array([side[unit] for unit in units]) for side in (device, simulated)]
    difference = sides[1] - sides[0]
    means = float(sides[0].mean()), float(sides[1].mean()), float(difference.mean())
    if len(units) < MIN_UNITS:
        why = f"too few units: {len(units)}, of at least {MIN_UNITS}"
        return Equivalence(arm, metric, margin, len(units), *means, None, None, "cannot tell", why)
    low, high = mean_interval(difference, 1.0 - 2.0 * level)
    verdict: EquivalenceVerdict = "cannot tell"
    why = "the interval contains an end of the margin"
    if -margin <= low and high <= margin:
        verdict, why = "equivalent", "the whole interval lies within the margin"
    elif low > margin or high < -margin:
        verdict, why = "beyond the margin", "the whole interval lies beyond the margin"
    return Equivalence(arm, metric, margin, len(units), *means, low, high, verdict, why)
