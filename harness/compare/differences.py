"""The lines of a comparison: one method and one metric, over the clips that were measured on both sides."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from harness.compare.margins import margin_of
from harness.compare.matching import CellPair
from harness.compare.significance import SignificanceResult, Verdict, decide_verdicts
from harness.core.arrays import Floats
from harness.score.metrics import DEFINITIONS


@dataclass(frozen=True)
class Difference:
    """One line of a comparison: one method, one metric, C clips. A difference is B - A."""

    method: str
    """The method, or "a vs b" where two methods are compared."""
    group: str
    """Inputs, split and whether the performer was known, as one text; these are never pooled."""
    metric: str
    unit: str
    clips: tuple[str, ...]
    """(C,) clips that were measured on both sides, sorted."""
    a: tuple[float, ...]
    """(C,) mean of A over the cells of each clip."""
    b: tuple[float, ...]
    """(C,) mean of B over the cells of each clip."""
    mean_a: float
    mean_b: float
    difference: float
    """Mean of b - a."""
    low: float | None
    """Lower end of its 95 % interval (see `mean_interval`); None with one clip that differs."""
    high: float | None
    p: float | None
    """Probability of a difference at least as large if A and B were equally good (see `significance.sign_flip_p`);
    None with too few clips."""
    p_holm: float | None
    """`p` corrected for the number of gated lines; None with too few clips and where the line is not gated."""
    margin: float
    """The largest difference without practical importance, in `unit`."""
    verdict: Verdict
    why: str
    """Reason for the verdict, in a few words."""
    gated: bool
    """Whether the line decides the outcome; other lines are for information and are tested individually."""


@dataclass(frozen=True)
class PairGroup:
    """Pairs of cells that are pooled."""

    method: str
    text: str
    """Inputs, split and performer, which all pairs share."""
    pairs: tuple[CellPair, ...]

    @property
    def title(self) -> str:
        return f"{self.method} ({self.text})"


def group_pairs(pairs: Iterable[CellPair]) -> list[PairGroup]:
    """Group pairs by method, inputs, split and performer, in the order of the pairs."""
    groups: dict[tuple[str, str], list[CellPair]] = {}
    for a, b in pairs:
        method = a.method if a.method == b.method else f"{a.method} vs {b.method}"
        split = b.split if a.split == "none" else a.split
        text = ", ".join(filter(None, (a.inputs, split, a.performer)))
        groups.setdefault((method, text), []).append((a, b))
    return [PairGroup(*name, tuple(members)) for name, members in groups.items()]


def compare_groups(
    groups: Sequence[PairGroup], gated: Sequence[str], informed: Iterable[str] = ()
) -> tuple[Difference, ...]:
    """Compare every metric of every group that both sides measured on some clip.

    Gated lines come first and are tested together; the lines in `informed` are tested individually.
    """
    first = [sides for group in groups for metric in gated if (sides := _clip_means(group, metric)).clips]
    others = [sides for group in groups for metric in informed if (sides := _clip_means(group, metric)).clips]
    gated_results = decide_verdicts([sides.worsening for sides in first], [sides.margin for sides in first])
    other_results = [decide_verdicts([sides.worsening], [sides.margin])[0] for sides in others]
    lines = zip((*first, *others), (*gated_results, *other_results), strict=True)
    return tuple(_difference(sides, result, at < len(first)) for at, (sides, result) in enumerate(lines))


@dataclass(frozen=True, eq=False)
class _ClipMeans:
    """Clip means of one metric of a group."""

    group: PairGroup
    metric: str
    clips: tuple[str, ...]
    a: Floats
    b: Floats

    @property
    def worsening(self) -> Floats:
        """(C,) differences with their sign chosen so that an increase is worse."""
        return self.b - self.a if margin_of(self.metric).rise_is_worse else self.a - self.b

    @property
    def margin(self) -> float:
        return margin_of(self.metric).of(float(self.a.mean()))


def _clip_means(group: PairGroup, metric: str) -> _ClipMeans:
    """Average the cells of each clip; cells that either side did not measure are left out."""
    by_clip: dict[str, list[tuple[float, float]]] = {}
    for a, b in group.pairs:
        mine, theirs = a.metrics.get(metric), b.metrics.get(metric)
        if mine is not None and theirs is not None:
            by_clip.setdefault(a.clip, []).append((mine, theirs))
    clips = tuple(sorted(by_clip))
    means = np.array([np.mean(by_clip[clip], axis=0) for clip in clips]).reshape(-1, 2)
    return _ClipMeans(group, metric, clips, means[:, 0], means[:, 1])


def _difference(sides: _ClipMeans, result: SignificanceResult, gated: bool) -> Difference:
    low, high = result.low, result.high
    if not margin_of(sides.metric).rise_is_worse and low is not None and high is not None:
        low, high = -high, -low
    return Difference(
        method=sides.group.method,
        group=sides.group.text,
        metric=sides.metric,
        unit=DEFINITIONS[sides.metric].unit,
        clips=sides.clips,
        a=tuple(sides.a.tolist()),
        b=tuple(sides.b.tolist()),
        mean_a=float(sides.a.mean()),
        mean_b=float(sides.b.mean()),
        difference=float((sides.b - sides.a).mean()),
        low=low,
        high=high,
        p=result.p,
        p_holm=result.p_holm if gated else None,
        margin=sides.margin,
        verdict=result.verdict,
        why=result.why,
        gated=gated,
    )
