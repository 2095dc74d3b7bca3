"""The answer of a study in a file: the best set of each size that it asks about, or the smallest that suffices."""

from harness.compare import MIN_UNITS, compare_paired, count_clips, count_units
from harness.core.number_format import count_noun
from harness.report.placement.wording import (
    behaviour_names,
    count_stations,
    held_out_error,
    list_sets,
    measured_errors,
    set_error,
    set_name,
    set_noun,
)
from harness.results.findings import BestSet, PlacementFindings, StationSetResult


def study_sentences(findings: PlacementFindings) -> list[str]:
    """The best set of each asked size; without such sizes the smallest set that is not shown to be worse than any."""
    units = {unit for tried in findings.tried for unit in tried.errors}
    # Findings of earlier versions have the errors of clips, whose names tell their performers.
    counted = count_units(units) if any(unit.startswith("performer ") for unit in units) else count_clips(units)
    chosen = [f"Sets were chosen on {counted}."] if units else []
    if findings.sizes:
        return [*(sentence for size in findings.sizes for sentence in _size_sentences(findings, size)), *chosen]
    best = smallest_sufficient_set(findings)
    if best is None:
        return ["No set of stations was measured."]
    error = set_error(findings, findings.of(best.stations))
    sentences = [f"{_recommendation(findings, best)}: {set_name(best.stations)}, {error}."]
    if best.held_out is not None:
        held_out = held_out_error(findings, best)
        sentences.append(f"On {count_noun(best.held_out_clips, 'held-out unit')} the error is {held_out}.")
    if best.ties:
        sets = "Another set of this size is" if len(best.ties) == 1 else f"{len(best.ties)} other sets of this size are"
        sentences.append(f"{sets} tied with it.")
    return [*sentences, *chosen]


def _size_sentences(findings: PlacementFindings, size: int) -> list[str]:
    """The best set of a size, "Best two stations for walking: head + pelvis, 2.00 deg ...", and its ties."""
    best = next((best for best in findings.best if len(best.stations) == size), None)
    if best is None:
        return [f"No set of {count_noun(size, 'station')} was measured."]
    stations = count_stations(size) if size > 1 else "station"
    first = (
        f"Best {stations} for {behaviour_names(findings)}: {set_name(best.stations)}, {_size_error(findings, best)}."
    )
    return [first, f"{_size_ties(findings, best)}."]


def _size_error(findings: PlacementFindings, best: BestSet) -> str:
    """The error on held-out clips; where there are none, the one that favours the set."""
    if best.held_out is not None:
        return f"{held_out_error(findings, best)} on {count_noun(best.held_out_clips, 'held-out unit')}"
    return f"{set_error(findings, findings.of(best.stations))} on the clips on which it was chosen"


def _size_ties(findings: PlacementFindings, best: BestSet) -> str:
    """Which sets of the same size are tied with the best, or that the units are too few to tell."""
    noun = set_noun(len(best.stations))
    units = len(measured_errors(tried)) if (tried := findings.of(best.stations)) else 0
    if findings.power is not None and units < findings.power.least_clips and len(best.ties) == best.of - 1 > 0:
        few = f"{count_noun(units, 'unit')} cannot tell it from the other {best.of - 1:,} {noun}s"
        return f"{few} ({findings.power.least_clips} might)"
    if not best.ties:
        return f"No other {noun} is tied with it" if best.of > 1 else f"No other {noun} was tried"
    if best.of == 2:
        return f"It is tied with the only other {noun} that was tried: {list_sets(best.ties)}"
    others = f"{best.of - 1:,} other {noun}s that were tried"
    return f"It is tied with {len(best.ties):,} of the {others}: {list_sets(best.ties)}"


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
