"""Two sides compared metric by metric on the cells that they share: A is the reference, a difference is B - A."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

from harness.compare.comparability import (
    EVERYTHING,
    check_allowance,
    find_coverage_faults,
    find_unpaired_cells,
    is_allowed,
    join_first,
    list_failed_cells,
    summarise_differences,
)
from harness.compare.differences import Difference, compare_groups, group_pairs
from harness.compare.margins import GATED_METRICS, INFORMATIVE_METRICS, TIME_METRICS, margin_of
from harness.compare.matching import (
    RELAXABLE_KEYS,
    CellPairing,
    format_cell_name,
    format_value,
    inputs_that_differ,
    pair_cells,
)
from harness.compare.significance import Verdict
from harness.core.files import to_json_types
from harness.errors import Outcome
from harness.results.manifest import Manifest, flatten
from harness.results.reader import ResultSet, load_results

__all__ = ["EVERYTHING", "Comparison", "Difference", "Verdict", "compare_results", "compare_runs"]

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


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


def compare_results(
    a: ResultSet,
    b: ResultSet,
    *,
    methods: tuple[str, str] | None = None,
    metrics: Sequence[str] = GATED_METRICS,
    allow: Sequence[str] | None = None,
) -> Comparison:
    """Pair the cells, refuse what is not comparable, judge every gated metric of every group.

    `methods` compares the one of A with the other of B. `allow` names inputs that may differ (those inside them too),
    names of `RELAXABLE_KEYS` that cells need not agree in, "coverage", "cells" (without a partner), or `EVERYTHING`.
    The outcome: NOT_COMPARABLE when nothing matched or inputs differ; REGRESSED when a gated line is worse; INCOMPLETE
    when planned cells failed; NOT_COMPARABLE when sides cover different things or a gated line cannot be told; PASS.
    Times are gated where both sides were measured on the same processor, else they are for information.
    UnknownName for metrics, methods and allowances that do not exist; BadInput for cells that are there twice.
    """
    metrics = tuple(dict.fromkeys(metrics))
    for metric in metrics:
        margin_of(metric)
    allowance = tuple(allow or ())
    matched = pair_cells(a, b, methods, [name for name in allowance if name in RELAXABLE_KEYS])
    differing = inputs_that_differ(matched.pairs, metrics)
    check_allowance(allowance, a, b, differing)
    refused = summarise_differences({name: text for name, text in differing.items() if not is_allowed(allowance, name)})
    allowed = summarise_differences({name: text for name, text in differing.items() if is_allowed(allowance, name)})
    found = [] if refused else group_pairs(matched.pairs)
    gated = _gated_metrics(metrics, a.manifest, b.manifest)
    informed = [metric for metric in (*metrics, *INFORMATIVE_METRICS) if metric not in gated]
    differences = compare_groups(found, gated, dict.fromkeys(informed))
    faults = {"coverage": find_coverage_faults(found, metrics), "cells": find_unpaired_cells(matched)}
    kept = [text for name, texts in faults.items() for text in texts if not is_allowed(allowance, name)]
    missing = list_failed_cells("A", a, methods and methods[0]) + list_failed_cells("B", b, methods and methods[1])
    outcome, why = _outcome(matched, refused, differences, missing, kept)
    return Comparison(
        a=a.title,
        b=b.title,
        differences=differences,
        matched=len(matched.pairs),
        only_a=tuple(map(format_cell_name, matched.only_a)),
        only_b=tuple(map(format_cell_name, matched.only_b)),
        inputs_that_differ=refused,
        allowed=(*allowed, *(text for texts in faults.values() for text in texts if text not in kept)),
        circumstances=_circumstances(a.manifest, b.manifest),
        outcome=outcome,
        why=why,
        coverage=tuple(faults["coverage"]),
        failed=missing,
    )


def compare_runs(
    a: Path | str,
    b: Path | str | None = None,
    *,
    methods: tuple[str, str] | None = None,
    metrics: Sequence[str] = GATED_METRICS,
    allow: Sequence[str] | None = None,
) -> Comparison:
    """Load two results and compare them, A as the reference; without B, two methods of A (see `compare_results`).

    Each side is the folder of a run or sweep, the folder of a baseline, or the name of a baseline.
    """
    reference = load_results(a)
    other = reference if b is None else load_results(b)
    return compare_results(reference, other, methods=methods, metrics=metrics, allow=allow)


def _gated_metrics(metrics: Sequence[str], a: Manifest, b: Manifest) -> tuple[str, ...]:
    """All of them on one processor; on two those that are no times, for what a step costs beside other work differs."""
    same = a.circumstances.get("processor") == b.circumstances.get("processor")
    return tuple(metric for metric in metrics if same or metric not in TIME_METRICS)


def _outcome(
    matched: CellPairing,
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
        return Outcome.NOT_COMPARABLE, f"inputs differ: {join_first(refused)}"
    if by["worse"]:
        names = [f"{line.method} {line.metric}" for line in by["worse"]]
        return Outcome.REGRESSED, f"{len(names)} of {len(gated)} gated lines are worse: {join_first(names)}"
    if failed:
        return Outcome.INCOMPLETE, f"planned cells are missing: {join_first(failed)}"
    if not gated:
        return Outcome.NOT_COMPARABLE, "nothing was measured on both sides that could be gated"
    if faults:
        return Outcome.NOT_COMPARABLE, join_first(faults)
    if by["cannot tell"]:
        line, lines_ = by["cannot tell"][0], len(by["cannot tell"])
        text = f"{lines_} of {len(gated)} gated lines cannot be told, such as {line.method} {line.metric}: {line.why}"
        return Outcome.NOT_COMPARABLE, text
    return Outcome.PASS, f"of {len(gated)} gated lines {len(by['same'])} are the same, {len(by['better'])} better"


def _circumstances(a: Manifest, b: Manifest) -> tuple[tuple[str, str, str], ...]:
    mine, theirs = (flatten(to_json_types(side.circumstances)) for side in (a, b))
    names = {**mine, **theirs}
    return tuple(
        (n, format_value(mine.get(n)), format_value(theirs.get(n))) for n in names if mine.get(n) != theirs.get(n)
    )
