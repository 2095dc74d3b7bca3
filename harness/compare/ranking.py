"""Ranking of methods on the same clips, with the statistics of `compare_runs` over units.

The method with the lowest mean is compared with each other one, as `harness compare RUN --methods OTHER,LOWEST` does.
The lines of all these pairs are tested together: the ranked metric and the gated ones but for times, which are not
gated between methods. Holm's correction therefore covers at least the lines of each of those comparisons, and a ranking
never says *better* where they cannot tell.

Methods with different lags are never ranked together: one that waits for later frames solves another task.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.compare.margins import GATED_METRICS, TIME_METRICS, margin_of
from harness.compare.paired_statistics import MIN_UNITS, mean_interval
from harness.compare.significance import SIGNIFICANCE, SignificanceResult, decide_verdicts, sign_flip_p
from harness.compare.units import BY_NAME, Sampling, average_units
from harness.core.arrays import Floats

ClipValues = Mapping[str, Mapping[str, float]]
"""Metric -> clip -> mean value over the cells of the clip."""


@dataclass(frozen=True)
class MethodRanking:
    """Methods with the lowest mean first, and whether the first one is better than each other one."""

    metric: str
    clips: tuple[str, ...]
    """(C,) clips on which all methods were measured, sorted."""
    units: tuple[str, ...]
    """(U,) their units, sorted (see `units`)."""
    values: Mapping[str, Floats]
    """Method -> (U,) values, the lowest mean first."""
    results: Mapping[str, SignificanceResult]
    """Other method -> verdict on the first one against it, over the units on which both were measured."""
    differences: Mapping[str, float]
    """Other method -> its mean minus that of the first one, over the units on which both were measured."""
    simultaneous: Mapping[str, tuple[float, float]]
    """Other method -> 95 % interval of that difference, corrected by Bonferroni for all lines that are tested together.

    An interval of one comparison may exclude zero beside a verdict that is corrected for many."""

    @property
    def lowest(self) -> str:
        """The method with the lowest mean."""
        return next(iter(self.values))

    @property
    def means(self) -> dict[str, float]:
        """Method -> mean over the units, the lowest first."""
        return {name: float(values.mean()) for name, values in self.values.items()}

    @property
    def best(self) -> str | None:
        """The method that is *better* than every other one; None when there is none."""
        return self.lowest if self.results and not self.others("same", "cannot tell", "worse") else None

    def others(self, *verdicts: str) -> list[str]:
        """Names of the other methods that have one of these verdicts."""
        return [name for name, result in self.results.items() if result.verdict in verdicts]


def split_by_lag(values: Mapping[str, ClipValues], lags: Mapping[str, int]) -> dict[int, dict[str, ClipValues]]:
    """Lag [frames] -> its methods, the causal ones first; a method without an entry in `lags` is causal.

    Each part is ranked alone.
    """
    parts: dict[int, dict[str, ClipValues]] = {}
    for frames in sorted({lags.get(name, 0) for name in values}):
        parts[frames] = {name: of for name, of in values.items() if lags.get(name, 0) == frames}
    return parts


def rank_methods(values: Mapping[str, ClipValues], metric: str, sampling: Sampling = BY_NAME) -> MethodRanking | None:
    """Rank methods by a metric with a margin, of which lower values are better; None when they share no clip.

    Methods without a value of the metric are left out. `sampling` says what is a unit.
    """
    measured = {name: by_metric for name, by_metric in values.items() if by_metric.get(metric)}
    clips = shared_clips(by_metric[metric] for by_metric in measured.values())
    if not clips:
        return None
    by_unit = {
        name: average_units({clip: of[metric][clip] for clip in clips}, sampling) for name, of in measured.items()
    }
    columns = {name: np.array(list(of_unit.values())) for name, of_unit in by_unit.items()}
    units = tuple(next(iter(by_unit.values())))
    lowest, *others = sorted(columns, key=lambda name: float(columns[name].mean()))
    metrics = dict.fromkeys((metric, *(each for each in GATED_METRICS if each not in TIME_METRICS)))
    pairs = [(name, each) for each in metrics for name in others]
    lines = [_paired(measured[name], measured[lowest], each, sampling) for name, each in pairs]
    kept = [(line, margin) for line, margin in lines if len(line)]
    results = decide_verdicts([line for line, _ in kept], [margin for _, margin in kept], range(len(others)))
    lines_tested = sum(len(line) >= MIN_UNITS and bool(np.any(line)) for line, _ in kept)
    intervals = {
        name: mean_interval(-line, 1.0 - SIGNIFICANCE / max(lines_tested, 1))
        for name, (line, _) in zip(others, kept, strict=False)
        if len(line) >= MIN_UNITS
    }
    ordered = {name: columns[name] for name in (lowest, *others)}
    differences = {name: -float(line.mean()) for name, (line, _) in zip(others, kept, strict=False)}
    verdicts = dict(zip(others, results, strict=True))
    return MethodRanking(metric, clips, units, ordered, verdicts, differences, intervals)


def find_best(values: Mapping[str, ClipValues], metric: str, sampling: Sampling = BY_NAME) -> str | None:
    """The method that is better than every other one by this metric, as `MethodRanking.best`; None when there is none.

    It computes intervals only where no single p already excludes this.
    """
    measured = {name: of[metric] for name, of in values.items() if of.get(metric)}
    clips = shared_clips(measured.values())
    by_unit = {name: average_units({clip: of[clip] for clip in clips}, sampling) for name, of in measured.items()}
    if len(measured) < 2 or len(next(iter(by_unit.values()))) < MIN_UNITS:
        return None
    lowest = min(measured, key=lambda name: np.mean(list(by_unit[name].values())))
    for name in measured:
        line, _ = _paired(values[name], values[lowest], metric, sampling)
        if name != lowest and sign_flip_p(line) > SIGNIFICANCE:
            return None
    ranking = rank_methods(values, metric, sampling)
    return ranking.best if ranking else None


def shared_clips(values: Iterable[Mapping[str, float]]) -> tuple[str, ...]:
    """The clips that all have a value for, sorted."""
    sets = [set(by_clip) for by_clip in values]
    return tuple(sorted(set.intersection(*sets))) if sets else ()


def _paired(a: ClipValues, b: ClipValues, metric: str, sampling: Sampling) -> tuple[Floats, float]:
    """Differences b - a over the units that both have, an increase being worse, and the margin for a reference a."""
    clips: Sequence[str] = shared_clips((a.get(metric, {}), b.get(metric, {})))
    before, after = (
        np.array(list(average_units({clip: side[metric][clip] for clip in clips}, sampling).values()))
        for side in (a, b)
    )
    margin = margin_of(metric)
    difference: Floats = after - before if margin.rise_is_worse else before - after
    return difference, margin.of(float(before.mean())) if clips else 0.0
