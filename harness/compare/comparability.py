"""What stands in the way of a comparison: inputs and coverage that differ, cells without a partner; what is allowed."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby

from harness.compare.differences import PairGroup
from harness.compare.matching import RELAXABLE_KEYS, CellPairing, format_cell_name
from harness.core.files import to_json_types
from harness.errors import UnknownName
from harness.results.manifest import flatten
from harness.results.reader import ResultSet

EVERYTHING = "everything"
"""Allows any input to differ, any coverage and cells without a partner; cells pair as ever."""
FAULT_KINDS = ("coverage", "cells")
COVERAGE_FLOOR = 0.95
"""Of the frames on either side (choice): a method may lose the hardest, and score the better for it."""
_MAX_NAMED = 4
"""So many differing inputs inside one are named each."""


def check_allowance(allowance: Sequence[str], a: ResultSet, b: ResultSet, differing: Iterable[str]) -> None:
    """UnknownName for an allowance that is no input and no fault."""
    names = {
        *differing,
        *(name for side in (a, b) for cell in side.cells[:1] for name in flatten(to_json_types(cell.defined_by))),
    }
    whole = {".".join(name.split(".")[:depth]) for name in names for depth in range(1, name.count(".") + 2)}
    for name in allowance:
        if name not in whole | {*RELAXABLE_KEYS, *FAULT_KINDS, EVERYTHING}:
            tops = sorted({name.partition(".")[0] for name in names})
            raise UnknownName("input to allow", name, (EVERYTHING, *FAULT_KINDS, *RELAXABLE_KEYS, *tops))


def is_allowed(allowance: Sequence[str], name: str) -> bool:
    """Whether this input, or what it is inside of, may differ."""
    return any(allowed in (EVERYTHING, name) or name.startswith(f"{allowed}.") for allowed in allowance)


def summarise_differences(differing: Mapping[str, str]) -> tuple[str, ...]:
    """The texts; of more than a few inside one input, such as digests of examples, the first."""
    texts = []
    for top, names in groupby(differing, key=lambda name: name.partition(".")[0]):
        inside = list(names)
        if len(inside) > _MAX_NAMED:
            texts.append(f"{differing[inside[0]]} (and {len(inside) - 1} more of {top})")
        else:
            texts += [differing[name] for name in inside]
    return tuple(texts)


def find_coverage_faults(found: Iterable[PairGroup], metrics: Sequence[str]) -> list[str]:
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


def find_unpaired_cells(matched: CellPairing) -> list[str]:
    """Cells without a partner, a line for each side."""
    sides = (("A", matched.only_a), ("B", matched.only_b))
    return [
        f"{_count_text(len(cells))} only in {side}: {join_first([*map(format_cell_name, cells)])}"
        for side, cells in sides
        if cells
    ]


def list_failed_cells(side: str, judged: ResultSet, method: str | None) -> tuple[str, ...]:
    """Of one method, where only that is compared."""
    names = [name for name in judged.failed if method is None or f": {method} on " in f": {name}"]
    unfinished = judged.planned - len(judged.cells) - len(judged.failed)
    return (
        *(f"{side}: {name}" for name in names),
        *([f"{side}: {_count_text(unfinished)} not finished"] if unfinished > 0 else []),
    )


def _count_text(count: int) -> str:
    return "1 cell is" if count == 1 else f"{count} cells are"


def join_first(texts: Sequence[str]) -> str:
    """The first three, and how many more."""
    return "; ".join(texts[:3]) + (f"; and {len(texts) - 3} more" if len(texts) > 3 else "")
