"""Two sides compared metric by metric on the cells that they share: A is the reference, a difference is B - A."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import get_args

from harness.errors import Outcome, UnknownName
from harness.score.differences import Difference, Group, groups, lines
from harness.score.files import plain
from harness.score.judged import Judged
from harness.score.manifest import Manifest, flat
from harness.score.margins import GATED, INFORMED, margin_of
from harness.score.matching import LOOSENED, Matched, inputs_that_differ, match, named, short
from harness.score.significance import Verdict

__all__ = ["EVERYTHING", "Comparison", "Difference", "Verdict", "compare"]

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
EVERYTHING = "everything"
"""Allows any input to differ, any coverage and cells without a partner; cells pair as ever."""
COVERAGE_FLOOR = 0.95
"""Of the frames on either side (choice): a method may lose the hardest, and score the better for it."""
_FAULTS = ("coverage", "cells")
_MOST_OF_ONE = 4
"""So many differing inputs inside one are named each."""


@dataclass(frozen=True)
class Comparison:
    """What B is beside A, and whether that can be said at all."""

    a: str
    """Title of the reference."""
    b: str
    differences: tuple[Difference, ...]
    """Gated lines first, method by method; none where inputs differ."""
    matched: int
    """Pairs of cells."""
    only_a: tuple[str, ...]
    """Names of cells without a partner."""
    only_b: tuple[str, ...]
    inputs_that_differ: tuple[str, ...]
    """Such as "tracker.rate_hz: 40 against 60", but for those that were allowed."""
    allowed: tuple[str, ...]
    """Those that were, and other faults that were let pass."""
    circumstances: tuple[tuple[str, str, str], ...]
    """Name, A's and B's value, of those that differ: what the comparison is about."""
    outcome: Outcome
    why: str
    """Of the outcome, in one sentence."""
    coverage: tuple[str, ...] = ()
    """Where the sides measured different shares of what was planned, or less than 95 % of it."""
    failed: tuple[str, ...] = ()
    """Planned cells that failed on either side, such as "A: ik on walking_p1_01"."""


def compare(
    a: Judged,
    b: Judged,
    *,
    methods: tuple[str, str] | None = None,
    metrics: Sequence[str] = GATED,
    allow: Sequence[str] | None = None,
) -> Comparison:
    """Pair the cells, refuse what is not comparable, judge every gated metric of every group.

    `methods` compares the one of A with the other of B. `allow` names inputs that may differ (those inside them too),
    names of `LOOSENED` that cells need not agree in, "coverage", "cells" (without a partner), or `EVERYTHING`.
    The outcome: NOT_COMPARABLE when nothing matched or inputs differ; REGRESSED when a gated line is worse; INCOMPLETE
    when planned cells failed; NOT_COMPARABLE when sides cover different things or a gated line cannot be told; PASS.
    UnknownName for metrics, methods and allowances that do not exist; BadInput for cells that are there twice.
    """
    for metric in metrics:
        margin_of(metric)
    allowance = tuple(allow or ())
    matched = match(a, b, methods, [name for name in allowance if name in LOOSENED])
    differing = inputs_that_differ(matched.pairs, metrics)
    _check(allowance, a, b, differing)
    refused = _together({name: text for name, text in differing.items() if not _allows(allowance, name)})
    allowed = _together({name: text for name, text in differing.items() if _allows(allowance, name)})
    found = [] if refused else groups(matched.pairs)
    informed = [metric for metric in INFORMED if metric not in metrics]
    differences = lines(found, metrics, informed)
    coverage, alone = _coverage(found, metrics), _alone(matched)
    faults = {"coverage": coverage, "cells": alone}
    kept = [text for name, texts in faults.items() for text in texts if not _allows(allowance, name)]
    failed = _failed("A", a, methods and methods[0]) + _failed("B", b, methods and methods[1])
    outcome, why = _outcome(matched, refused, differences, failed, kept)
    return Comparison(
        a=a.title,
        b=b.title,
        differences=differences,
        matched=len(matched.pairs),
        only_a=tuple(map(named, matched.only_a)),
        only_b=tuple(map(named, matched.only_b)),
        inputs_that_differ=refused,
        allowed=(*allowed, *(text for texts in faults.values() for text in texts if text not in kept)),
        circumstances=_circumstances(a.manifest, b.manifest),
        outcome=outcome,
        why=why,
        coverage=tuple(coverage),
        failed=failed,
    )


def _outcome(
    matched: Matched,
    refused: Sequence[str],
    differences: Sequence[Difference],
    failed: Sequence[str],
    faults: Sequence[str],
) -> tuple[Outcome, str]:
    gated = [line for line in differences if line.gated]
    by = {kind: [line for line in gated if line.verdict == kind] for kind in VERDICTS}
    if not matched.pairs and not failed:
        return Outcome.NOT_COMPARABLE, f"no cell of A has a partner in B ({matched.why_none})"
    if refused:
        return Outcome.NOT_COMPARABLE, f"inputs differ: {_some(refused)}"
    if by["worse"]:
        names = [f"{line.method} {line.metric}" for line in by["worse"]]
        return Outcome.REGRESSED, f"{len(names)} of {len(gated)} gated lines are worse: {_some(names)}"
    if failed:
        return Outcome.INCOMPLETE, f"planned cells are missing: {_some(failed)}"
    if not gated:
        return Outcome.NOT_COMPARABLE, "nothing was measured on both sides"
    if faults:
        return Outcome.NOT_COMPARABLE, _some(faults)
    if by["cannot tell"]:
        line, lines_ = by["cannot tell"][0], len(by["cannot tell"])
        text = f"{lines_} of {len(gated)} gated lines cannot be told, such as {line.method} {line.metric}: {line.why}"
        return Outcome.NOT_COMPARABLE, text
    return Outcome.PASS, f"of {len(gated)} gated lines {len(by['same'])} are the same, {len(by['better'])} better"


def _check(allowance: Sequence[str], a: Judged, b: Judged, differing: Iterable[str]) -> None:
    """UnknownName for an allowance that is no input and no fault."""
    names = {*differing, *(name for side in (a, b) for cell in side.cells[:1] for name in flat(plain(cell.defined_by)))}
    whole = {".".join(name.split(".")[:depth]) for name in names for depth in range(1, name.count(".") + 2)}
    for name in allowance:
        if name not in whole | {*LOOSENED, *_FAULTS, EVERYTHING}:
            tops = sorted({name.partition(".")[0] for name in names})
            raise UnknownName("input to allow", name, (EVERYTHING, *_FAULTS, *LOOSENED, *tops))


def _allows(allowance: Sequence[str], name: str) -> bool:
    return any(allowed in (EVERYTHING, name) or name.startswith(f"{allowed}.") for allowed in allowance)


def _together(differing: Mapping[str, str]) -> tuple[str, ...]:
    """The texts; of more than a few inside one input, such as digests of examples, the first."""
    texts = []
    for top, names in groupby(differing, key=lambda name: name.partition(".")[0]):
        inside = list(names)
        if len(inside) > _MOST_OF_ONE:
            texts.append(f"{differing[inside[0]]} (and {len(inside) - 1} more of {top})")
        else:
            texts += [differing[name] for name in inside]
    return tuple(texts)


def _coverage(found: Iterable[Group], metrics: Sequence[str]) -> list[str]:
    """Where the sides did not measure the same share, or too little of it."""
    texts = []
    for group in found:
        matched, expected = (
            [sum(pair[side].metrics[name] or 0 for pair in group.pairs) for side in (0, 1)]
            for name in ("frames_matched", "frames_expected")
        )
        shares = [m / e if e else 0.0 for m, e in zip(matched, expected, strict=True)]
        if shares[0] != shares[1] or min(shares) < COVERAGE_FLOOR:
            counts = [f"{m:g} of {e:g} frames in {side}" for m, e, side in zip(matched, expected, "AB", strict=True)]
            texts.append(
                f"{group.title} covers {counts[0]}, {counts[1]}; it must be the same, and {COVERAGE_FLOOR:.0%}"
            )
        for metric in metrics:
            lacking = sum((a.metrics.get(metric) is None) != (b.metrics.get(metric) is None) for a, b in group.pairs)
            if lacking:
                texts.append(f"{group.title}: {metric} on one side alone in {lacking} of {len(group.pairs)} cells")
    return texts


def _alone(matched: Matched) -> list[str]:
    """Cells without a partner, a line for each side."""
    sides = (("A", matched.only_a), ("B", matched.only_b))
    return [f"{len(cells)} cells are only in {side}: {_some([*map(named, cells)])}" for side, cells in sides if cells]


def _failed(side: str, judged: Judged, method: str | None) -> tuple[str, ...]:
    """Of one method, where only that is compared."""
    names = [name for name in judged.failed if method is None or f": {method} on " in f": {name}"]
    unfinished = judged.planned - len(judged.cells) - len(judged.failed)
    return (
        *(f"{side}: {name}" for name in names),
        *([f"{side}: {unfinished} cells that are not finished"] if unfinished > 0 else []),
    )


def _circumstances(a: Manifest, b: Manifest) -> tuple[tuple[str, str, str], ...]:
    mine, theirs = (flat(plain(side.circumstances)) for side in (a, b))
    names = {**mine, **theirs}
    return tuple((n, short(mine.get(n)), short(theirs.get(n))) for n in names if mine.get(n) != theirs.get(n))


def _some(texts: Sequence[str]) -> str:
    return "; ".join(texts[:3]) + (f"; and {len(texts) - 3} more" if len(texts) > 3 else "")
