"""Comparison of two results on the cells that they share. A is the reference; differences are B - A."""

from collections.abc import Iterable, Sequence
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
from harness.compare.differences import ComparedGroups, Difference, compare_groups
from harness.compare.margins import GATED_METRICS, INFORMATIVE_METRICS, TIME_METRICS, margin_of
from harness.compare.matching import (
    RELAXABLE_KEYS,
    CellPairing,
    format_cell_name,
    format_value,
    inputs_that_differ,
    pair_cells,
)
from harness.compare.pair_groups import group_pairs
from harness.compare.significance import Verdict
from harness.compare.units import Sampling
from harness.core.files import to_json_types
from harness.core.split import training_note
from harness.errors import Outcome
from harness.results import Manifest, ResultSet, flatten, load_results

__all__ = ["EVERYTHING", "Comparison", "Difference", "Verdict", "compare_results", "compare_runs"]

VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


@dataclass(frozen=True)
class Comparison:
    """Differences between B and the reference A, and the outcome."""

    a: str
    """Title of the reference."""
    b: str
    differences: tuple[Difference, ...]
    """Gated lines first, by method; empty where inputs differ."""
    matched: int
    """Number of cell pairs."""
    only_a: tuple[str, ...]
    """Names of cells that have no partner in B."""
    only_b: tuple[str, ...]
    inputs_that_differ: tuple[str, ...]
    """Inputs that differ and were not allowed to, such as "tracker.rate_hz: 40 against 60"."""
    allowed: tuple[str, ...]
    """Differing inputs and other faults that were allowed."""
    circumstances: tuple[tuple[str, str, str], ...]
    """Name, value in A and value in B of each circumstance that differs: the subject of the comparison."""
    outcome: Outcome
    why: str
    """Reason for the outcome, in one sentence."""
    coverage: tuple[str, ...] = ()
    """Groups in which the sides cover different shares of the frames, or less than 95 %."""
    failed: tuple[str, ...] = ()
    """Planned cells that failed on either side, such as "A: ik on walking_p1_01"."""
    training_notes: tuple[str, ...] = ()
    """Compared methods whose training data is unknown or from outside, such as "B: mine:Mine: trained on AMASS"."""


def compare_results(
    a: ResultSet,
    b: ResultSet,
    *,
    methods: tuple[str, str] | None = None,
    metrics: Sequence[str] | None = None,
    allow: Sequence[str] | None = None,
) -> Comparison:
    """Pair the cells, check that they are comparable, and test every gated metric of every group.

    `methods` compares the first of them in A with the second in B. `metrics` are by default `GATED_METRICS`, without
    times where different methods are compared: a slower method is another choice, not a regression. `allow` may hold

    - names of inputs that may differ, with all inputs inside them;
    - names of `RELAXABLE_KEYS` in which the cells of a pair may differ;
    - "coverage", "cells" (unpaired cells) or `EVERYTHING`.

    The outcome is the first of these that applies: NOT_COMPARABLE when no cells pair or inputs differ; REGRESSED when a
    gated line is worse; INCOMPLETE when planned cells failed; NOT_COMPARABLE when coverage differs, cells are unpaired
    or a gated line is undecided; PASS. Times are gated only where both sides were measured on the same processor.
    UnknownName for metrics, methods and allowances that do not exist; BadInput for duplicate cells.
    """
    return compare_with_reference(a, [b], methods=methods, metrics=metrics, allow=allow)[0]


def compare_with_reference(
    reference: ResultSet,
    others: Sequence[ResultSet],
    *,
    methods: Sequence[str] | None = None,
    metrics: Sequence[str] | None = None,
    allow: Sequence[str] | None = None,
) -> tuple[Comparison, ...]:
    """Compare each of several results with one reference, as `compare_results` does.

    Holm's correction covers the gated lines of all comparisons. `methods` are the method of the reference and those of
    the others.
    """
    for metric in metrics or ():
        margin_of(metric)
    pairs = [
        _PairedResults(reference, other, (methods[0], method) if methods and method else None, metrics, allow or ())
        for other, method in zip(others, methods[1:] if methods else [""] * len(others), strict=True)
    ]
    check_allowance(allow or (), (reference, *others), {name for pair in pairs for name in pair.differing})
    lines = compare_groups([pair.compared for pair in pairs])
    return tuple(pair.conclude(differences) for pair, differences in zip(pairs, lines, strict=True))


class _PairedResults:
    """The paired cells of B and the reference A, and what prevents their comparison."""

    def __init__(
        self,
        a: ResultSet,
        b: ResultSet,
        methods: tuple[str, str] | None,
        metrics: Sequence[str] | None,
        allow: Sequence[str],
    ) -> None:
        self.a, self.b, self.methods, self.allow = a, b, methods, allow
        between_methods = methods is not None and len({name.partition("[")[0] for name in methods}) > 1
        if metrics is None:
            metrics = [metric for metric in GATED_METRICS if not (between_methods and metric in TIME_METRICS)]
        metrics = tuple(dict.fromkeys(metrics))
        self.matched = pair_cells(a, b, methods, [name for name in allow if name in RELAXABLE_KEYS])
        self.differing = inputs_that_differ(self.matched.pairs, metrics)
        self.refused = self._summary(allowed=False)
        groups = [] if self.refused else group_pairs(self.matched.pairs)
        gated = _gated_metrics(metrics, a.manifest, b.manifest)
        informed = [metric for metric in (*metrics, *GATED_METRICS, *INFORMATIVE_METRICS) if metric not in gated]
        self.compared = ComparedGroups(groups, gated, dict.fromkeys(informed), merge_sampling(a.manifest, b.manifest))
        self.faults = {"coverage": find_coverage_faults(groups, metrics), "cells": find_unpaired_cells(self.matched)}

    def _summary(self, *, allowed: bool) -> tuple[str, ...]:
        chosen = {name: text for name, text in self.differing.items() if is_allowed(self.allow, name) == allowed}
        return summarise_differences(chosen)

    def conclude(self, differences: tuple[Difference, ...]) -> Comparison:
        """The comparison with these lines."""
        a, b, matched, methods = self.a, self.b, self.matched, self.methods
        faults = [text for name, texts in self.faults.items() for text in texts if not is_allowed(self.allow, name)]
        faults_allowed = [text for texts in self.faults.values() for text in texts if text not in faults]
        failed = list_failed_cells("A", a, methods and methods[0]) + list_failed_cells("B", b, methods and methods[1])
        outcome, why = _outcome(matched, self.refused, differences, failed, faults)
        titles = a.title, b.title
        if methods and a.title == b.title and methods[0] != methods[1]:
            titles = f"{methods[0]} of {a.title}", f"{methods[1]} of {b.title}"
        return Comparison(
            a=titles[0],
            b=titles[1],
            differences=differences,
            matched=len(matched.pairs),
            only_a=tuple(map(format_cell_name, matched.only_a)),
            only_b=tuple(map(format_cell_name, matched.only_b)),
            inputs_that_differ=self.refused,
            allowed=(*self._summary(allowed=True), *faults_allowed),
            circumstances=_circumstances(a.manifest, b.manifest),
            outcome=outcome,
            why=why,
            coverage=tuple(self.faults["coverage"]),
            failed=failed,
            training_notes=(
                *_training_notes("A", a.manifest, [one.method for one, _ in matched.pairs]),
                *_training_notes("B", b.manifest, [other.method for _, other in matched.pairs]),
            ),
        )


def compare_runs(
    a: Path | str,
    b: Path | str | None = None,
    *,
    methods: tuple[str, str] | None = None,
    metrics: Sequence[str] | None = None,
    allow: Sequence[str] | None = None,
) -> Comparison:
    """Load two results and compare them, A as the reference; without B, two methods of A (see `compare_results`).

    Each side is the folder of a run or sweep, the folder of a baseline, or the name of a baseline.
    """
    reference = load_results(a)
    other = reference if b is None else load_results(b)
    return compare_results(reference, other, methods=methods, metrics=metrics, allow=allow)


def merge_sampling(a: Manifest, b: Manifest) -> Sampling:
    """The performers that either side knows, or by name where neither stored any; clips are units if both say so."""
    sides = [side.performers for side in (a, b) if side.performers is not None]
    known = {clip: who for side in sides for clip, who in side.items()} if sides else None
    return Sampling(known, "clip" if a.unit == b.unit == "clip" else "performer")


def _gated_metrics(metrics: Sequence[str], a: Manifest, b: Manifest) -> tuple[str, ...]:
    """All metrics where both sides ran on the same processor, else without times: these differ between processors."""
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
    by_verdict = {kind: [line for line in gated if line.verdict == kind] for kind in VERDICTS}
    if not matched.pairs and not failed:
        return Outcome.NOT_COMPARABLE, f"no cell of A has a partner in B ({matched.why_none})"
    if refused:
        return Outcome.NOT_COMPARABLE, f"inputs differ: {join_first(refused)}"
    if by_verdict["worse"]:
        names = [f"{line.method} {line.metric}" for line in by_verdict["worse"]]
        return Outcome.REGRESSED, f"{len(names)} of {len(gated)} gated lines are worse: {join_first(names)}"
    if failed:
        return Outcome.INCOMPLETE, f"planned cells are missing: {join_first(failed)}"
    if not gated:
        return Outcome.NOT_COMPARABLE, join_first(faults) or "no gated metric was measured on both sides"
    if faults:
        return Outcome.NOT_COMPARABLE, join_first(faults)
    if by_verdict["cannot tell"]:
        line, count = by_verdict["cannot tell"][0], len(by_verdict["cannot tell"])
        text = f"{count} of {len(gated)} gated lines are undecided, such as {line.method} {line.metric}: {line.why}"
        return Outcome.NOT_COMPARABLE, text
    return (
        Outcome.PASS,
        f"of {len(gated)} gated lines {len(by_verdict['same'])} are the same, {len(by_verdict['better'])} better",
    )


def _training_notes(side: str, manifest: Manifest, methods: Iterable[str]) -> list[str]:
    notes = {name: training_note(manifest.training_data.get(name)) for name in methods}
    return [f"{side}: {name}: {note}" for name, note in notes.items() if note]


def _circumstances(a: Manifest, b: Manifest) -> tuple[tuple[str, str, str], ...]:
    mine, theirs = (flatten(to_json_types(side.circumstances)) for side in (a, b))
    names = {**mine, **theirs}
    if not (a.training_data and b.training_data):  # a version that did not store it
        names = {name: None for name in names if not name.startswith("training_data")}
    return tuple(
        (n, format_value(mine.get(n)), format_value(theirs.get(n))) for n in names if mine.get(n) != theirs.get(n)
    )
