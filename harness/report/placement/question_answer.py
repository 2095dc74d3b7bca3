"""The answer to a question: what to wear, what a second method says of it, and a line about each other size.

Where the methods disagree on the advised set, a set that is good under both is named first, if there is one.
"""

from harness.core.number_format import Interval, count_noun
from harness.report.placement.wording import behaviour_names, count_stations, set_name, set_noun
from harness.results.findings import PlacementFindings, StationNames
from harness.results.findings.advice import PlacementAdvice, SecondChoice, SetError


def disputed_choice(findings: PlacementFindings) -> SecondChoice | None:
    """What the second method says of the advised set, if that is significantly worse under it; else None."""
    advised = findings.advice.best.stations if findings.advice else ()
    choices = findings.second.choices if findings.second else ()
    return next((choice for choice in choices if choice.worse and choice.chosen == advised), None)


def advice_sentences(findings: PlacementFindings, advice: PlacementAdvice) -> list[str]:
    """The answer in full: what to wear, what the second method says against it, and the error."""
    choice, best = disputed_choice(findings), advice.best
    if choice is None:
        cost = f", at a cost of {best.cost:g}" if best.cost is not None else ""
        wear = f"{_wear(findings, best.stations)}{_ties(advice)}{cost}"
        return [f"{wear} ({_search(findings)}).", f"It errs {_error(findings, best)}."]
    first, second = _methods(findings)
    chosen, better = set_name(choice.chosen), set_name(choice.best)
    more = f"{second} errs {_difference(findings, choice)} more"
    if choice.shared is None:
        return [
            f"{_none_is_good(choice)} under both methods for {behaviour_names(findings)}: {first} prefers {chosen}, "
            f"{second} {better} ({_search(findings)}).",
            f"With {chosen}, {more} than with {better}.",
            f"Under {first}, the error of {chosen} is {_error(findings, best)}.",
        ]
    than = "it" if choice.shared.stations == choice.best else better
    return [
        f"{_wear(findings, choice.shared.stations)}, good under both methods ({_search(findings)}).",
        f"They disagree on the best: with {chosen}, which {first} prefers, {more} than with {than}.",
        f"Under {first}, the error of {set_name(choice.shared.stations)} is {_error(findings, choice.shared)}, that of "
        f"{chosen} {_number(findings, best)}.",
    ]


def short_answers(findings: PlacementFindings, advice: PlacementAdvice) -> list[str]:
    """The answer in few words for a headline, the longest form first."""
    choice, best, search = disputed_choice(findings), advice.best, f" ({_search(findings)})"
    if choice is None:
        wear, name = _wear(findings, best.stations), set_name(best.stations)
        tied = f", tied with {len(advice.ties):,} of {advice.of - 1:,} {_nouns(best.stations)}" if advice.ties else ""
        return [f"{wear}{tied}{search}.", f"Wear {name}{tied}{search}.", f"Wear {name}{search}."]
    first, second = _methods(findings)
    worse = _difference(findings, choice)
    if choice.shared is None:
        sets = f"{first} prefers {set_name(choice.chosen)}, {second} {set_name(choice.best)}"
        none, rough = _none_is_good(choice), str(worse).partition(" (")[0]
        return [
            f"{none} under both methods: {sets}, by {worse}{search}.",
            f"{none} under both methods: {sets}, by {worse}.",
            f"{none} under both: {sets}, by {worse}.",
            f"{none} under both: {sets}, by {rough}.",
            f"{none} under both methods, which differ by {worse}{search}.",
        ]
    wear, name = _wear(findings, choice.shared.stations), set_name(choice.shared.stations)
    apart = f"They disagree: {second} errs {worse} more with {first}'s best."
    return [
        f"{wear}, good under both methods{search}. {apart}",
        f"{wear}, good under both methods. {apart}",
        f"Wear {name}, good under both methods{search}. {apart}",
        f"Wear {name}, good under both methods. {apart}",
        f"Wear {name}, good under both methods{search}. Their best sets differ by {worse}.",
        f"Wear {name}, good under both methods. Their best sets differ by {worse}.",
        f"A set of {count_stations(len(choice.chosen))} is good under both methods. Their best sets differ by {worse}.",
    ]


def _wear(findings: PlacementFindings, stations: StationNames) -> str:
    """What to wear: "Wear two stations for walking: head + pelvis", "For walking, add pelvis to head"."""
    behaviours, added = behaviour_names(findings), tuple(name for name in stations if name not in findings.base)
    if not findings.base:
        return f"Wear {count_stations(len(stations))} for {behaviours}: {set_name(stations)}"
    told = f"add {set_name(added)} to {set_name(findings.base)}" if added else f"{set_name(stations)} suffices"
    return f"For {behaviours}, {told}"


def _ties(advice: PlacementAdvice) -> str:
    """The sets that cannot be told from the advised one: ", or head + torso, which cannot be told from it"."""
    if not advice.ties:
        return ""
    if len(advice.ties) == 1:
        return f", or {set_name(advice.ties[0])}, which cannot be told from it"
    return (
        f", or one of {len(advice.ties):,} {_nouns(advice.best.stations)} of {advice.of:,} that cannot be told from it"
    )


def _none_is_good(choice: SecondChoice) -> str:
    return f"None of {choice.of} {_nouns(choice.chosen)} is good"


def _nouns(stations: StationNames) -> str:
    return f"{set_noun(len(stations))}s"


def _methods(findings: PlacementFindings) -> tuple[str, str]:
    """The method whose error counts, and the second one."""
    return " and ".join(findings.methods), findings.second.method if findings.second else ""


def _difference(findings: PlacementFindings, choice: SecondChoice) -> Interval:
    return Interval.of(choice.difference, choice.low, choice.high, findings.unit)


def _number(findings: PlacementFindings, of: SetError) -> Interval:
    return Interval.of(of.error, of.low, of.high, findings.unit)


def _error(findings: PlacementFindings, of: SetError) -> str:
    """The error of a set, and on how many performers it was measured."""
    known = f"{findings.split} " if findings.split else ""
    units = f" on {of.units} held-out {known}{_unit_noun(findings, of.units)}" if of.units else ""
    return f"{_number(findings, of)}{units}"


def _unit_noun(findings: PlacementFindings, count: int) -> str:
    """What the units of a question are, such as "performers"."""
    units = {unit for tried in findings.tried for unit in tried.errors}
    noun = "performer" if units and all(unit.startswith("performer ") for unit in units) else "unit"
    return noun if count == 1 else f"{noun}s"


def _search(findings: PlacementFindings) -> str:
    """The search by its effort; where a number of clips was asked for, the units on which it ended."""
    if findings.effort:
        return f"a {findings.effort} search"
    units = max((one.units for one in findings.rounds), default=0)
    return f"chosen on {units} {_unit_noun(findings, units)}"


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
        rows = [(f"{count_stations(len(one.stations)).capitalize()} {_be(one.stations)}", one) for one in errors]
    lines = []
    for words, one in rows:
        if one.stations != findings.advice.best.stations:
            verdict, error = _size_verdict(findings, one.stations), _number(findings, one)
            lines.append(f"{words} {verdict}: {set_name(one.stations)}, {error}.")
    missing = sorted(set(findings.sizes) - {len(best.stations) for best in findings.best})
    return [*lines, *(f"No set of {count_noun(size, 'station')} was measured." for size in missing)]


def _be(stations: StationNames) -> str:
    return "is" if len(stations) == 1 else "are"


def _size_verdict(findings: PlacementFindings, stations: StationNames) -> str:
    """Whether a set of another size is worse than the advised one, or cannot be told from it."""
    advised = findings.advice.best.stations if findings.advice else ()
    for step in findings.size_steps:
        if (step.smaller, step.larger) == (stations, advised):
            return "worse" if step.verdict == "better" else "not shown to be worse"
        if (step.smaller, step.larger) == (advised, stations):
            return "worse" if step.verdict == "worse" else "not better"
    return "not better"
