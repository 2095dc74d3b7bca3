"""Words of a placement study: names of sets, formats of numbers, and what a search and two conditions say."""

from collections.abc import Sequence

from harness.core.number_format import NOT_MEASURED, Interval, count_noun
from harness.report.kit.text import list_first
from harness.results.findings import (
    BestSet,
    CandidatePlace,
    MarginalContribution,
    PlacementFindings,
    PlacementSearch,
    RankAgreement,
    StationNames,
    StationSetResult,
)

_NUMBERS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")
_SET_NOUNS = {1: "place", 2: "pair", 3: "triple"}
"""What sets of so many stations are called."""
_SIDES = ("left_", "right_")
_IRREGULAR = {"foot": "feet", "calf": "calves", "humerus": "humeri", "femur": "femora", "tibia": "tibiae"}
TIE_NOTE = (
    "A tied set is not significantly worse than the first one: sign-flip test over units, corrected for all "
    "comparisons (Holm 1979). Intervals are not corrected, so that the interval of a tied set may exclude zero."
)
"""What tables and charts mean by a tie."""
_WORTH_LABELS = {"ablate": "left out of", "add": "added to", "exhaustive": "sets with it against sets without it"}


def set_name(stations: StationNames) -> str:
    """The name of a set, "both ankles + pelvis": pairs first, then the others, in the order of the set."""
    left, right = ({n.removeprefix(side) for n in stations if n.startswith(side)} for side in _SIDES)
    parts = []
    for name in stations:
        without_side = name.removeprefix(_SIDES[0]).removeprefix(_SIDES[1])
        if without_side not in left & right:
            parts.append(plain_name(name))
        elif name.startswith(_SIDES[0]):
            parts.append(f"both {_plural(plain_name(without_side))}")
    return " + ".join(sorted(parts, key=lambda part: not part.startswith("both "))) or "none"


def original_candidates(findings: PlacementFindings) -> list[CandidatePlace]:
    """The candidates that the study names, without the positions that it derived by moving them."""
    return [place for place in findings.candidates if not place.moved_from]


def contribution_label(findings: PlacementFindings, contribution: MarginalContribution) -> str:
    """How the contribution of a candidate was measured: "left out of all 5"."""
    is_full = len(contribution.base) == len(original_candidates(findings))
    base = "" if not contribution.base else f"all {len(contribution.base)}" if is_full else set_name(contribution.base)
    return f"{_WORTH_LABELS[contribution.mode]} {base}".strip()


def plain_name(name: str) -> str:
    """A name with blanks instead of underscores."""
    return name.replace("_", " ")


def _plural(name: str) -> str:
    *before, last = name.split(" ")
    return " ".join([*before, _IRREGULAR.get(last, f"{last}s")])


def set_noun(size: int) -> str:
    """What a set of so many stations is called: "pair"."""
    return _SET_NOUNS.get(size, "set")


def count_stations(size: int) -> str:
    """ "one station", "three stations"."""
    number = _NUMBERS[size] if size < len(_NUMBERS) else str(size)
    return f"{number} station" if size == 1 else f"{number} stations"


def behaviour_names(findings: PlacementFindings) -> str:
    """The behaviours in words, at most two by name: "walking and boxing", "3 behaviours"."""
    names = findings.behaviours
    return " and ".join(map(plain_name, names)) if len(names) < 3 else count_noun(len(names), "behaviour")


def measured_errors(tried: StationSetResult) -> dict[str, float]:
    """Unit -> error, for the units on which it was measured."""
    return {unit: value for unit, value in tried.errors.items() if value is not None}


def set_error(findings: PlacementFindings, tried: StationSetResult | None) -> Interval:
    """The mean error of a set with its interval."""
    if tried is None:
        return Interval.missing(NOT_MEASURED)
    return Interval.of(tried.mean, tried.low, tried.high, findings.unit)


def held_out_error(findings: PlacementFindings, best: BestSet) -> Interval:
    """The error of a set on held-out clips."""
    return Interval.of(best.held_out, best.held_out_low, best.held_out_high, findings.unit)


def search_gain_sentence(search: PlacementSearch, unit: str) -> str:
    """How much a search improves the error on held-out clips; "" where that was not measured."""
    if search.held_out is None:
        return ""
    gain = Interval.of(search.held_out, search.held_out_low, search.held_out_high, unit, signed=True)
    return f"On {count_noun(search.held_out_clips, 'held-out unit')} the last set lowers the error by {gain}"


def ranks_by_condition(findings: PlacementFindings, most: int) -> list[tuple[StationNames, list[int | None]]]:
    """The first sets by the study's own condition, and the rank of each under every condition.

    Only sets that were measured under a condition have a rank there. Sets with equal means share the better rank.
    """
    sign = 1.0 if findings.better == "lower" else -1.0
    columns = []
    for condition in findings.conditions:
        costs = [None if mean is None else sign * mean for mean in condition.means]
        measured = [cost for cost in costs if cost is not None]
        columns.append([None if cost is None else 1 + sum(other < cost for other in measured) for cost in costs])
    rows = [(names, [column[at] for column in columns]) for at, names in enumerate(findings.compared)]
    return sorted(rows, key=lambda row: (row[1][0] is None, row[1][0]))[:most] if columns else []


def changes_sentence(findings: PlacementFindings, pair: RankAgreement) -> str:
    """How many pairs of sets change their order between two conditions, and the first of them."""
    pairs = pair.sets * (pair.sets - 1) // 2
    if not pair.changes:
        return f"no pair of {pairs:,} changes its order"
    first = pair.changed[0]
    before, after = (Interval(difference, signed=True).number for difference in first.differences)
    tested = first.significant is not None
    shown = f", {pair.significant_changes:,} significantly" if tested else " (too few units or too many sets to test)"
    verb = "changes its" if pair.changes == 1 else "change their"
    example = f"{set_name(first.first)} against {set_name(first.second)}, {before} to {after} {findings.unit}".rstrip()
    return f"{pair.changes:,} of {pairs:,} pairs {verb} order{shown}: first {example}"


def format_rank_range(rank_low: int, rank_high: int) -> str:
    """The ranks that are compatible with the intervals: "3", or "2 to 5"."""
    return str(rank_low) if rank_low == rank_high else f"{rank_low} to {rank_high}"


def list_sets(sets: Sequence[StationNames], most: int = 3) -> str:
    """The names of the first sets, and the number of the others."""
    return list_first([set_name(stations) for stations in sets], most, separator="; ")
