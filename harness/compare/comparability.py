"""Reasons why results are not comparable: differing inputs or coverage, unpaired cells; and what may be allowed."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby

from harness.compare.matching import RELAXABLE_KEYS, CellPairing, format_cell_name
from harness.compare.pair_groups import PairGroup
from harness.core.files import to_json_types
from harness.errors import UnknownName
from harness.results import ResultSet, flatten

EVERYTHING = "everything"
"""Allows differing inputs, any coverage and unpaired cells; the pairing of cells does not change."""
FAULT_KINDS = ("coverage", "cells")
COVERAGE_FLOOR = 0.95
"""Least share of frames on either side (choice): a method that loses the hardest frames would score better."""
_MAX_NAMED = 4
"""Up to this many differing inputs of one group are listed individually."""


def check_allowance(allowance: Sequence[str], sides: Iterable[ResultSet], differing: Iterable[str]) -> None:
    """UnknownName for an allowance that names neither an input nor a kind of fault."""
    names = {
        *differing,
        *(name for side in sides for cell in side.cells[:1] for name in flatten(to_json_types(cell.defined_by))),
    }
    prefixes = {".".join(name.split(".")[:depth]) for name in names for depth in range(1, name.count(".") + 2)}
    for name in allowance:
        if name not in prefixes | {*RELAXABLE_KEYS, *FAULT_KINDS, EVERYTHING}:
            tops = sorted({name.partition(".")[0] for name in names})
            raise UnknownName("input to allow", name, (EVERYTHING, *FAULT_KINDS, *RELAXABLE_KEYS, *tops))


def is_allowed(allowance: Sequence[str], name: str) -> bool:
    """Whether this input, or a group that contains it, may differ."""
    return any(allowed in (EVERYTHING, name) or name.startswith(f"{allowed}.") for allowed in allowance)


def summarise_differences(differing: Mapping[str, str]) -> tuple[str, ...]:
    """Texts of the differing inputs; many of one group, such as hashes of examples, are reduced to the first."""
    texts = []
    for top, names in groupby(differing, key=lambda name: name.partition(".")[0]):
        members = list(names)
        if len(members) > _MAX_NAMED:
            texts.append(f"{differing[members[0]]} (and {len(members) - 1} more of {top})")
        else:
            texts += [differing[name] for name in members]
    return tuple(texts)


def find_coverage_faults(groups: Iterable[PairGroup], metrics: Sequence[str]) -> list[str]:
    """Describe groups in which the sides cover different shares of the frames, or less than `COVERAGE_FLOOR`.

    Likewise groups in which the line dropped too many records.
    """
    texts = []
    for group in groups:
        if lost := max(cell.line_loss for pair in group.pairs for cell in pair):
            texts.append(f"{group.title}: the line dropped up to {lost:.0%} of the records")
        matched, expected = (
            [sum(pair[side].metrics[name] or 0 for pair in group.pairs) for side in (0, 1)]
            for name in ("frames_matched", "frames_expected")
        )
        shares = [m / e if e else 0.0 for m, e in zip(matched, expected, strict=True)]
        if shares[0] != shares[1] or min(shares) < COVERAGE_FLOOR:
            counts = [f"{m:g} of {e:g} frames in {side}" for m, e, side in zip(matched, expected, "AB", strict=True)]
            texts.append(
                f"{group.title} covers {counts[0]}, {counts[1]}; both must cover the same {COVERAGE_FLOOR:.0%} or more"
            )
        for metric in metrics:
            unmatched = sum((a.metrics.get(metric) is None) != (b.metrics.get(metric) is None) for a, b in group.pairs)
            if unmatched:
                texts.append(
                    f"{group.title}: {metric} was measured on one side only in {unmatched} of {len(group.pairs)} cells"
                )
    return texts


def find_unpaired_cells(matched: CellPairing) -> list[str]:
    """Describe the unpaired cells, one line for each side."""
    sides = (("A", matched.only_a), ("B", matched.only_b))
    return [
        f"{_count_text(len(cells))} only in {side}: {join_first([*map(format_cell_name, cells)])}"
        for side, cells in sides
        if cells
    ]


def list_failed_cells(side: str, results: ResultSet, method: str | None) -> tuple[str, ...]:
    """Names of failed and unfinished cells of one side; of one method where only that is compared."""
    names = [name for name in results.failed if method is None or f": {method} on " in f": {name}"]
    unfinished = results.planned - len(results.cells) - len(results.failed)
    return (
        *(f"{side}: {name}" for name in names),
        *([f"{side}: {_count_text(unfinished)} not finished"] if unfinished > 0 else []),
    )


def _count_text(count: int) -> str:
    return "1 cell is" if count == 1 else f"{count} cells are"


def join_first(texts: Sequence[str]) -> str:
    """Join the first three texts and state how many more there are."""
    return "; ".join(texts[:3]) + (f"; and {len(texts) - 3} more" if len(texts) > 3 else "")
