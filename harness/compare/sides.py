"""Several results, or methods of one result, that are compared with one of them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from harness.compare.comparison import Comparison, compare_with_reference
from harness.compare.side_names import check_side_names
from harness.errors import BadInput, Outcome, UnknownName
from harness.results import ResultSet, load_results

_OUTCOMES = (Outcome.REGRESSED, Outcome.INCOMPLETE, Outcome.NOT_COMPARABLE, Outcome.PASS)
"""Outcomes in the order of their importance: that of several comparisons is the first one that occurs."""


@dataclass(frozen=True)
class ComparisonSet:
    """Several results, each compared with one reference. Holm's correction covers the gated lines of all."""

    reference: str
    """Name of the reference, which is A of each comparison."""
    between_methods: bool
    """Whether sides are different methods, so that lines are named "a vs b"."""
    comparisons: tuple[Comparison, ...]
    outcome: Outcome
    why: str
    """Reason for the outcome, in one sentence."""


def compare_sides(
    sides: Sequence[tuple[str, Path | str]],
    *,
    reference: str | None = None,
    methods: Sequence[str] = (),
    metrics: Sequence[str] | None = None,
    allow: Sequence[str] | None = None,
) -> ComparisonSet:
    """Load named results and compare each with the reference, by default the first (see `compare_results`).

    `methods` are two or more of one result, one of all results, or one for each. BadInput for another number of them,
    and for a name that occurs twice among three or more; UnknownName for a reference that is no side.
    """
    one_each = "Name one or two." if len(sides) < 3 else f"Name one, or one for each of the {len(sides)} results."
    if len(sides) > 1 and len(methods) not in (0, 1, len(sides)):
        raise BadInput(f"--methods {','.join(methods)} names {len(methods)} methods.", one_each)
    loaded = [(name, _load(name, where)) for name, where in sides]
    count = max(len(sides), len(methods), 2)
    chosen = [*methods] * count if len(methods) == 1 else methods or [""] * count
    named = list(zip(loaded * (count if len(sides) == 1 else 1), chosen, strict=True))
    several = len(set(chosen)) > 1
    if len(sides) == 1 and not several:
        raise BadInput(f"{sides[0][0]} alone.", "Name another result, or two of its methods with --methods a,b.")
    names = [_side_name(name, method if several else "", len(sides) == 1) for (name, _), method in named]
    if count > 2:
        check_side_names(names)
    if reference is not None and reference not in names:
        raise UnknownName("side", reference, names)
    first = names.index(reference) if reference else 0
    order = [first, *(at for at in range(count) if at != first)]
    results, used = [named[at][0][1] for at in order], [named[at][1] for at in order]
    found = compare_with_reference(
        results[0], results[1:], methods=used if methods else None, metrics=metrics, allow=allow
    )
    if count > 2:
        found = tuple(replace(each, a=names[first], b=names[at]) for each, at in zip(found, order[1:], strict=True))
    outcome = next(outcome for outcome in _OUTCOMES if any(each.outcome is outcome for each in found))
    why = "; ".join(f"{each.b}: {each.why}" for each in found if each.outcome is outcome)
    return ComparisonSet(names[first], several, found, outcome, why)


def _load(name: str, where: Path | str) -> ResultSet:
    results = load_results(where)
    return results if name == str(where) else replace(results, title=name)


def _side_name(name: str, method: str, of_one_result: bool) -> str:
    return method if method and of_one_result else f"{method} of {name}" if method else name
