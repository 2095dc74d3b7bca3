"""The lines of a comparison: one method and one metric, over the units that were measured on both sides.

A line pools behaviours, and known and new performers. Its parts show them one by one.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from harness.compare.margins import margin_of
from harness.compare.pair_groups import PairGroup
from harness.compare.significance import SignificanceResult, Verdict, decide_verdicts
from harness.compare.units import BY_NAME, Sampling, average_units
from harness.core.arrays import Floats
from harness.score import DEFINITIONS


@dataclass(frozen=True)
class Difference:
    """One line of a comparison: one method, one metric, C clips of U units. A difference is B - A."""

    method: str
    """The method, or "a vs b" where two methods are compared."""
    group: str
    """Inputs and split as one text; these are never pooled."""
    part: str
    """The behaviour, or "known performers" or "new performers", of a part of a line; "" for a line."""
    metric: str
    unit: str
    clips: tuple[str, ...]
    """(C,) clips that were measured on both sides, sorted."""
    a: tuple[float, ...]
    """(C,) mean of A over the cells of each clip."""
    b: tuple[float, ...]
    """(C,) mean of B over the cells of each clip."""
    units: tuple[str, ...]
    """(U,) the units of the clips, sorted (see `units`)."""
    mean_a: float
    """Mean of A over units, as the others."""
    mean_b: float
    difference: float
    """Mean of b - a."""
    low: float | None
    """Lower end of its 95 % interval (see `mean_interval`); None with one unit that differs."""
    high: float | None
    p: float | None
    """Probability of a difference at least as large if A and B were equally good (see `significance.sign_flip_p`);
    None with too few units."""
    p_holm: float | None
    """`p` corrected for the number of gated lines, or of parts of a line; None with too few units."""
    margin: float
    """The largest difference without practical importance, in `unit`."""
    verdict: Verdict
    why: str
    """Reason for the verdict, in a few words."""
    gated: bool
    """Whether the line decides the outcome; other lines are for information and are tested individually."""


@dataclass(frozen=True)
class ComparedGroups:
    """What is compared of two results."""

    groups: Sequence[PairGroup]
    gated: Sequence[str]
    """Metrics of the gated lines."""
    informed: Iterable[str] = ()
    """Metrics that are shown for information."""
    sampling: Sampling = BY_NAME


def compare_groups(comparisons: Sequence[ComparedGroups]) -> list[tuple[Difference, ...]]:
    """For each comparison, compare every metric of every group that both sides measured on some clip.

    Gated lines come first; those of all comparisons are tested together. The `informed` lines are tested individually,
    and the parts of a gated line together.
    """
    gated = [[*_measured(each, each.gated)] for each in comparisons]
    results = iter(_decide([sides for lines in gated for sides in lines]))
    found = []
    for each, lines in zip(comparisons, gated, strict=True):
        differences = [_difference(sides, next(results), gated=True) for sides in lines]
        families = [[sides] for sides in _measured(each, each.informed)]
        for line in lines:
            parts = [_sides(part, line.metric, each.sampling) for part in line.group.parts]
            families.append([part for part in parts if part.clips])
        for family in families:
            differences += [_difference(*line, gated=False) for line in zip(family, _decide(family), strict=True)]
        found.append(tuple(differences))
    return found


def _measured(compared: ComparedGroups, metrics: Iterable[str]) -> Iterator["_Sides"]:
    names = tuple(metrics)
    lines = (_sides(group, metric, compared.sampling) for group in compared.groups for metric in names)
    return (sides for sides in lines if sides.clips)


def _decide(family: Sequence["_Sides"]) -> list[SignificanceResult]:
    return decide_verdicts([sides.worsening for sides in family], [sides.margin for sides in family])


@dataclass(frozen=True, eq=False)
class _Sides:
    """Means of one metric of a group over its C clips and U units."""

    group: PairGroup
    metric: str
    clips: tuple[str, ...]
    a: Floats
    """(C,)."""
    b: Floats
    units: tuple[str, ...]
    unit_a: Floats
    """(U,)."""
    unit_b: Floats

    @property
    def worsening(self) -> Floats:
        """(U,) differences with their sign chosen so that an increase is worse."""
        difference: Floats = self.unit_b - self.unit_a
        return difference if margin_of(self.metric).rise_is_worse else -difference

    @property
    def margin(self) -> float:
        return margin_of(self.metric).of(float(self.unit_a.mean()))


def _sides(group: PairGroup, metric: str, sampling: Sampling) -> _Sides:
    """Average the cells of each clip, then the clips of each unit; what either side did not measure is left out."""
    by_clip: dict[str, list[tuple[float, float]]] = {}
    for a, b in group.pairs:
        mine, theirs = a.metrics.get(metric), b.metrics.get(metric)
        if mine is not None and theirs is not None:
            by_clip.setdefault(a.clip, []).append((mine, theirs))
    clips = tuple(sorted(by_clip))
    of_clips = np.array([np.mean(by_clip[clip], axis=0) for clip in clips]).reshape(-1, 2)
    of_units = [average_units(dict(zip(clips, side, strict=True)), sampling) for side in of_clips.T]
    unit_a, unit_b = (np.array(list(side.values())) for side in of_units)
    return _Sides(group, metric, clips, of_clips[:, 0], of_clips[:, 1], tuple(of_units[0]), unit_a, unit_b)


def _difference(sides: _Sides, result: SignificanceResult, *, gated: bool) -> Difference:
    low, high = result.low, result.high
    if not margin_of(sides.metric).rise_is_worse and low is not None and high is not None:
        low, high = -high, -low
    return Difference(
        method=sides.group.method,
        group=sides.group.text,
        part=sides.group.part,
        metric=sides.metric,
        unit=DEFINITIONS[sides.metric].unit,
        clips=sides.clips,
        a=tuple(sides.a.tolist()),
        b=tuple(sides.b.tolist()),
        units=sides.units,
        mean_a=float(sides.unit_a.mean()),
        mean_b=float(sides.unit_b.mean()),
        difference=float((sides.unit_b - sides.unit_a).mean()),
        low=low,
        high=high,
        p=result.p,
        p_holm=result.p_holm if gated or sides.group.part else None,
        margin=sides.margin,
        verdict=result.verdict,
        why=result.why,
        gated=gated,
    )
