"""A placement study in words: the recommended stations in one sentence, names of sets, and formats of numbers."""

from collections.abc import Sequence

from harness.compare import MIN_UNITS, compare_paired, count_clips, count_units
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
    StatisticalPower,
)
from harness.results.findings.advice import PlacementAdvice, SetError

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


def placement_sentence(findings: PlacementFindings) -> str:
    """The answer: of a question what is advised, of a study in a file the best set of each size that it asks about.

    Without such sizes it is the smallest set that is not significantly worse than the best set of any size.
    """
    if findings.advice is not None:
        return " ".join(filter(None, (_disagreement(findings), _advice_sentence(findings, findings.advice))))
    units = {unit for tried in findings.tried for unit in tried.errors}
    # Findings of earlier versions have the errors of clips, whose names tell their performers.
    counted = count_units(units) if any(unit.startswith("performer ") for unit in units) else count_clips(units)
    chosen = [f"Sets were chosen on {counted}."] if units else []
    if findings.sizes:
        return " ".join([*(_size_sentence(findings, size) for size in findings.sizes), *chosen])
    best = smallest_sufficient_set(findings)
    if best is None:
        return "No set of stations was measured."
    error = set_error(findings, findings.of(best.stations))
    sentences = [f"{_recommendation(findings, best)}: {set_name(best.stations)}, {error}."]
    if best.held_out is not None:
        held_out = held_out_error(findings, best)
        sentences.append(f"On {count_noun(best.held_out_clips, 'held-out unit')} the error is {held_out}.")
    if best.ties:
        sets = "Another set of this size is" if len(best.ties) == 1 else f"{len(best.ties)} other sets of this size are"
        sentences.append(f"{sets} tied with it.")
    return " ".join([*sentences, *chosen])


def headline_sentence(findings: PlacementFindings) -> str:
    """The first sentence of a page: where methods disagree on the advice it is that, else the whole answer."""
    return _disagreement(findings) or placement_sentence(findings)


def _advice_sentence(findings: PlacementFindings, advice: PlacementAdvice) -> str:
    """What to wear, what cannot be told from it, and its error: "Wear two stations for walking: head + pelvis, ..."."""
    best, size = advice.best, len(advice.best.stations)
    added = tuple(name for name in best.stations if name not in findings.base)
    behaviours = " and ".join(map(plain_name, findings.behaviours))
    if findings.base:
        told = f"add {set_name(added)} to {set_name(findings.base)}" if added else f"{set_name(best.stations)} suffices"
        told = f"For {behaviours}, {told}"
    else:
        told = f"Wear {_count_stations(size)} for {behaviours}: {set_name(best.stations)}"
    cost = f" at a cost of {best.cost:g}" if best.cost is not None else ""
    error = Interval.of(best.error, best.low, best.high, findings.unit)
    known = f"{findings.split} " if findings.split else ""
    units = f" on {best.units} held-out {known}{_unit_noun(findings, best.units)}" if best.units else ""
    search = f"a {findings.effort} search" if findings.effort else _clips_used(findings)
    return f"{told}{_ties_in_words(advice)}{cost}; {error}{units} ({search})."


def _ties_in_words(advice: PlacementAdvice) -> str:
    """The sets that cannot be told from the advised one: ", or head + torso, which cannot be told from it"."""
    if not advice.ties:
        return ""
    noun = _SET_NOUNS.get(len(advice.best.stations), "set")
    if len(advice.ties) == 1:
        return f", or {set_name(advice.ties[0])}, which cannot be told from it"
    return f", or one of {len(advice.ties):,} {noun}s of {advice.of:,} that cannot be told from it"


def _unit_noun(findings: PlacementFindings, count: int) -> str:
    """What the units of a question are, such as "performers"."""
    units = {unit for tried in findings.tried for unit in tried.errors}
    noun = "performer" if units and all(unit.startswith("performer ") for unit in units) else "unit"
    return noun if count == 1 else f"{noun}s"


def _clips_used(findings: PlacementFindings) -> str:
    """On how many units the search ended, where a number of clips was asked for."""
    units = max((one.units for one in findings.rounds), default=0)
    return f"chosen on {units} {_unit_noun(findings, units)}"


def _disagreement(findings: PlacementFindings) -> str:
    """What the second method says against the advised set; "" if nothing."""
    second, advice = findings.second, findings.advice
    if second is None or advice is None:
        return ""
    choice = next((one for one in second.choices if one.chosen == advice.best.stations), None)
    if choice is None or not choice.worse:
        return ""
    more = Interval.of(choice.difference, choice.low, choice.high, findings.unit)
    first = " and ".join(findings.methods)
    advised = f"Methods disagree: with the set that {first} advises, {second.method} errs {more} more"
    return f"{advised} than with {set_name(choice.best)}."


def size_sentences(findings: PlacementFindings) -> list[str]:
    """One line for each size (with costs: each cost) beside the advised one: is it better, and with which error."""
    if findings.advice is None:
        return []
    rows = [(f"A cost of {one.cost:g} is", one) for one in findings.front]
    if not rows:
        errors = (
            SetError(best.stations, best.held_out, best.held_out_low, best.held_out_high, best.held_out_clips)
            for best in findings.best
        )
        rows = [(f"{_count_stations(len(one.stations)).capitalize()} {_be(one.stations)}", one) for one in errors]
    lines = []
    for words, one in rows:
        if one.stations != findings.advice.best.stations:
            error = Interval.of(one.error, one.low, one.high, findings.unit)
            lines.append(f"{words} {_size_verdict(findings, one.stations)}: {set_name(one.stations)}, {error}.")
    missing = sorted(set(findings.sizes) - {len(best.stations) for best in findings.best})
    return [*lines, *(f"No set of {count_noun(size, 'station')} was measured." for size in missing)]


def _be(stations: StationNames) -> str:
    return "is" if len(stations) == 1 else "are"


def _size_verdict(findings: PlacementFindings, stations: StationNames) -> str:
    """Whether a set of another size than the advised one is worse or only not better."""
    advised = findings.advice.best.stations if findings.advice else ()
    for step in findings.size_steps:
        if step.smaller == stations and step.verdict == "better":
            return "worse"
        if (step.smaller, step.larger) == (advised, stations):
            return "worse" if step.verdict == "worse" else "not better"
    return "not better"


def _count_stations(size: int) -> str:
    """ "one station", "three stations"."""
    number = _NUMBERS[size] if size < len(_NUMBERS) else str(size)
    return f"{number} station" if size == 1 else f"{number} stations"


def _size_sentence(findings: PlacementFindings, size: int) -> str:
    """The best set of a size: "Best three stations for walking: head + pelvis + left hand, 2.00 deg ..."."""
    best = next((best for best in findings.best if len(best.stations) == size), None)
    if best is None:
        return f"No set of {count_noun(size, 'station')} was measured."
    behaviours = " and ".join(map(plain_name, findings.behaviours))
    number = _NUMBERS[size] if size < len(_NUMBERS) else str(size)
    stations = f"{number} stations" if size > 1 else "station"
    return (
        f"Best {stations} for {behaviours}: {set_name(best.stations)}, {_size_error(findings, best)}; "
        f"{_size_ties(findings, best)}."
    )


def _size_error(findings: PlacementFindings, best: BestSet) -> str:
    """The error on held-out clips; where there are none, the one that favours the set."""
    if best.held_out is not None:
        return f"{held_out_error(findings, best)} on {count_noun(best.held_out_clips, 'held-out unit')}"
    return f"{set_error(findings, findings.of(best.stations))} on the clips on which it was chosen"


def _size_ties(findings: PlacementFindings, best: BestSet) -> str:
    """Which sets of the same size are tied with the best, or that the units are too few to tell."""
    noun = _SET_NOUNS.get(len(best.stations), "set")
    units = len(measured_errors(tried)) if (tried := findings.of(best.stations)) else 0
    if findings.power is not None and units < findings.power.least_clips and len(best.ties) == best.of - 1 > 0:
        few = f"{count_noun(units, 'unit')} cannot tell it from the other {best.of - 1:,} {noun}s"
        return f"{few} ({findings.power.least_clips} might)"
    if not best.ties:
        return f"no other {noun} is tied with it" if best.of > 1 else f"no other {noun} was tried"
    if best.of == 2:
        return f"tied with the only other {noun} that was tried: {list_sets(best.ties)}"
    others = f"{best.of - 1:,} other {noun}s that were tried"
    return f"tied with {len(best.ties):,} of the {others}: {list_sets(best.ties)}"


def power_sentences(power: StatisticalPower) -> list[str]:
    """What the units of a study can show, and how long more of them take."""
    units, sets = count_noun(power.clips, "unit"), count_noun(power.sets, "set")
    took = f" The study takes {format_duration(power.duration_s)}." if power.duration_s is not None else ""
    if power.sets < 2:
        return [f"One set is measured on {units}: nothing is compared.{took}"]
    if power.clips < power.least_clips:
        more = f" ({format_duration(power.least_duration_s)})" if power.least_duration_s is not None else ""
        first = f"{units} cannot show any difference between {sets}, {power.least_clips} might{more}.{took}"
    elif power.shown is None:
        first = f"{units} can show a difference between {sets}; how large it must be is unknown.{took}"
    else:
        first = (
            f"{units} can show a difference of {Interval(power.shown, unit=power.unit)} between two of {sets} "
            f"(power 80 %, p corrected for {power.sets - 1:,} comparisons).{took}"
        )
    if power.needed_clips is None or power.wanted is None or power.needed_clips <= power.clips:
        return [first]
    more = f", about {format_duration(power.needed_duration_s)}" if power.needed_duration_s is not None else ""
    measured = "The spread is that of these" if power.cell_s is None else "Spread and time are those of the first"
    second = (
        f"A difference of {Interval(power.wanted, unit=power.unit)}, a tenth of the error, would need about "
        f"{power.needed_clips:,} units{more}. {measured} {power.pilot_sets} sets."
    )
    return [first, second]


def format_duration(seconds: float | None) -> str:
    """A rough duration: "40 s", "7 min", "3.5 h", "12 days"."""
    if seconds is None:
        return NOT_MEASURED
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    if seconds < 5400.0:
        return f"{seconds / 60.0:.0f} min"
    return f"{seconds / 3600.0:.1f} h" if seconds < 172800.0 else f"{seconds / 86400.0:,.0f} days"


def _recommendation(findings: PlacementFindings, best: BestSet) -> str:
    """How many stations are recommended, and on what grounds."""
    count = len(best.stations)
    most = max(len(other.stations) for other in findings.best)
    noun = count_noun(count, "station")
    units = max((len(measured_errors(tried)) for tried in findings.tried), default=0)
    if units < MIN_UNITS:
        few = f"at least {MIN_UNITS} units are needed to compare sets, instead of {units}"
        return f"The lowest error was measured with {noun}, but {few}"
    if count == most:
        return f"Of 1 to {most} stations, {count} have the lowest error" if count > 1 else "One station"
    return f"{noun} {'is' if count == 1 else 'are'} as good as up to {most}"


def smallest_sufficient_set(findings: PlacementFindings) -> BestSet | None:
    """The smallest of the best sets of each size that is not significantly worse than the best of all sizes."""
    measured = [
        (best, tried) for best in findings.best if (tried := findings.of(best.stations)) and tried.mean is not None
    ]
    if not measured:
        return None
    sign = 1.0 if findings.better == "lower" else -1.0
    best, top = min(measured, key=lambda pair: sign * (pair[1].mean or 0.0))
    smaller = (pair for pair in measured if len(pair[0].stations) < len(best.stations))
    return next((other for other, tried in smaller if not _is_worse(tried, top, sign)), best)


def _is_worse(tried: StationSetResult, top: StationSetResult, sign: float) -> bool:
    """Whether the whole paired interval is on the worse side of `top`; with too few units a set counts as worse."""
    difference = compare_paired(tried.errors, top.errors)
    if difference.low is None or difference.high is None:
        return True
    return min(sign * difference.low, sign * difference.high) > 0.0


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
