"""The lines of a comparison: one method, one metric, over the clips on which both sides were measured."""

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
    """One method, one metric, C clips: a line of the comparison; a difference is B - A."""

    method: str
    """Or "a vs b" where two methods are compared."""
    group: str
    """What is never pooled: inputs, split and whether the performer was known, as one text."""
    metric: str
    unit: str
    clips: tuple[str, ...]
    """(C,) on which both sides were measured, sorted."""
    a: tuple[float, ...]
    """(C,) mean over the cells of each clip."""
    b: tuple[float, ...]
    """(C,) likewise."""
    mean_a: float
    mean_b: float
    difference: float
    """Mean of b - a."""
    low: float | None
    """End of its 95 % interval (see `paired.interval`); None with too few clips."""
    high: float | None
    p: float | None
    """Of a difference as large if A and B were equally good (see `significance.sign_flip_p`); None likewise."""
    p_holm: float | None
    """As it counts among all gated lines; None likewise, and where the line is not gated."""
    margin: float
    """The largest difference without practical importance, in `unit`."""
    verdict: Verdict
    why: str
    """Of the verdict, in a few words."""
    gated: bool
    """Whether the outcome rests on it; other lines are for information, each judged by itself."""


@dataclass(frozen=True)
class PairGroup:
    """Pairs of cells that are pooled."""

    method: str
    text: str
    """What they share besides: inputs, split, performer."""
    pairs: tuple[CellPair, ...]

    @property
    def title(self) -> str:
        return f"{self.method} ({self.text})"


def group_pairs(pairs: Iterable[CellPair]) -> list[PairGroup]:
    """By method, inputs, split and performer, in the order of the pairs."""
    found: dict[tuple[str, str], list[CellPair]] = {}
    for a, b in pairs:
        method = a.method if a.method == b.method else f"{a.method} vs {b.method}"
        split = b.split if a.split == "none" else a.split
        text = ", ".join(filter(None, (a.inputs, split, a.performer)))
        found.setdefault((method, text), []).append((a, b))
    return [PairGroup(*name, tuple(of_it)) for name, of_it in found.items()]


def compare_groups(
    found: Sequence[PairGroup], gated: Sequence[str], informed: Iterable[str] = ()
) -> tuple[Difference, ...]:
    """Every metric of every group that was measured on some clip on both sides: gated lines first, judged together."""
    first = [sides for group in found for metric in gated if (sides := _clip_means(group, metric)).clips]
    others = [sides for group in found for metric in informed if (sides := _clip_means(group, metric)).clips]
    judged = decide_verdicts([sides.worsening for sides in first], [sides.margin for sides in first])
    alone = [decide_verdicts([sides.worsening], [sides.margin])[0] for sides in others]
    both = zip((*first, *others), (*judged, *alone), strict=True)
    return tuple(_difference(sides, told, at < len(first)) for at, (sides, told) in enumerate(both))


@dataclass(frozen=True, eq=False)
class _ClipMeans:
    """What a group measured of one metric, as clip means."""

    group: PairGroup
    metric: str
    clips: tuple[str, ...]
    a: Floats
    b: Floats

    @property
    def worsening(self) -> Floats:
        """(C,) the differences, turned so that a rise is worse."""
        return self.b - self.a if margin_of(self.metric).rise_is_worse else self.a - self.b

    @property
    def margin(self) -> float:
        return margin_of(self.metric).of(float(self.a.mean()))


def _clip_means(group: PairGroup, metric: str) -> _ClipMeans:
    """Cells that either side did not measure do not count; those of a clip are averaged."""
    by_clip: dict[str, list[tuple[float, float]]] = {}
    for a, b in group.pairs:
        mine, theirs = a.metrics.get(metric), b.metrics.get(metric)
        if mine is not None and theirs is not None:
            by_clip.setdefault(a.clip, []).append((mine, theirs))
    clips = tuple(sorted(by_clip))
    means = np.array([np.mean(by_clip[clip], axis=0) for clip in clips]).reshape(-1, 2)
    return _ClipMeans(group, metric, clips, means[:, 0], means[:, 1])


def _difference(sides: _ClipMeans, told: SignificanceResult, gated: bool) -> Difference:
    low, high = told.low, told.high
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
        p=told.p,
        p_holm=told.p_holm if gated else None,
        margin=sides.margin,
        verdict=told.verdict,
        why=told.why,
        gated=gated,
    )
