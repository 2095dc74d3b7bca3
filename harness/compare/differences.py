"""The lines of a comparison: one method and one metric, over the units that were measured on both sides.

A line pools behaviours, and known and new performers. Its parts show them one by one.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.compare.margins import margin_of
from harness.compare.matching import CellPair
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
class PairGroup:
    """Pairs of cells that are pooled."""

    method: str
    text: str
    """Inputs and split, which all pairs share."""
    pairs: tuple[CellPair, ...]
    part: str = ""

    @property
    def title(self) -> str:
        return f"{self.method} ({self.text})"

    @property
    def parts(self) -> "list[PairGroup]":
        """The pairs of each behaviour and of known and new performers; of neither where all pairs have the same."""
        behaviours, performers = dict[str, list[CellPair]](), dict[str, list[CellPair]]()
        for a, b in self.pairs:
            behaviours.setdefault(a.behaviour, []).append((a, b))
            performers.setdefault(f"{a.performer or b.performer} performers", []).append((a, b))
        return [
            replace(self, pairs=tuple(pairs), part=name)
            for by_name in (behaviours, performers)
            for name, pairs in by_name.items()
            if len(by_name) > 1
        ]


def group_pairs(pairs: Iterable[CellPair]) -> list[PairGroup]:
    """Group pairs by method, inputs and split, in the order of the pairs."""
    groups: dict[tuple[str, str], list[CellPair]] = {}
    for a, b in pairs:
        method = a.method if a.method == b.method else f"{a.method} vs {b.method}"
        split = b.split if a.split == "none" else a.split
        text = ", ".join(filter(None, (a.inputs, split)))
        groups.setdefault((method, text), []).append((a, b))
    return [PairGroup(*name, tuple(members)) for name, members in groups.items()]


def compare_groups(
    groups: Sequence[PairGroup],
    gated: Sequence[str],
    informed: Iterable[str] = (),
    sampling: Sampling = BY_NAME,
) -> tuple[Difference, ...]:
    """Compare every metric of every group that both sides measured on some clip.

    Gated lines come first and are tested together. The lines in `informed` are tested individually, and the parts of a
    gated line together.
    """
    first = [sides for group in groups for metric in gated if (sides := _sides(group, metric, sampling)).clips]
    others = [sides for group in groups for metric in informed if (sides := _sides(group, metric, sampling)).clips]
    families = [first, *([sides] for sides in others)]
    for sides in first:
        parts = [_sides(part, sides.metric, sampling) for part in sides.group.parts]
        families.append([part for part in parts if part.clips])
    lines = []
    for number, family in enumerate(families):
        results = decide_verdicts([sides.worsening for sides in family], [sides.margin for sides in family])
        lines += [_difference(*line, gated=number == 0) for line in zip(family, results, strict=True)]
    return tuple(lines)


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
