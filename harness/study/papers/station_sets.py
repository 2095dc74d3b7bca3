"""Comparison of sets of stations: the best of each size, and the gain of one more (Kim et al. 2012, Fig. 3)."""

from collections.abc import Iterable, Mapping

import numpy as np
from scipy import stats

from harness.compare.claims import Errors, claim_lower_error
from harness.compare.paired_statistics import (
    CONFIDENCE_LEVEL,
    MIN_CLIPS,
    PairedDifference,
    bootstrap_interval,
    compare_paired,
)
from harness.results.expected_orders import METRIC
from harness.results.findings import BarChart, Claim, ClaimVerdict, FindingsTable, LineChart
from harness.study.papers.tables import CellRow, errors_by_clip, format_mean, mean_sd

STATION_ABBREVIATIONS = {
    "right_hand": "RH",
    "left_hand": "LH",
    "right_ankle": "RA",
    "left_ankle": "LA",
    "pelvis": "PEL",
}
"""Station -> abbreviation, as in the paper and in its order."""
_WORST_FIRST: tuple[ClaimVerdict, ...] = ("not reproduced", "cannot tell", "reproduced")
ErrorsBySet = Mapping[str, Errors]
"""Set of stations, such as "RH+LH+PEL" -> error by clip."""


def format_station_set(stations: Iterable[str]) -> str:
    """Format a set as in "RH+LH+PEL", in the order of `STATION_ABBREVIATIONS`."""
    selected = set(stations)
    return "+".join(short for station, short in STATION_ABBREVIATIONS.items() if station in selected)


def count_stations(name: str) -> int:
    """Number of stations of a set, from its name."""
    return name.count("+") + 1


def errors_by_set(rows: Iterable[CellRow], metric: str = METRIC) -> dict[str, dict[str, float]]:
    """Set -> clip -> error, of rows that differ only in clip and stations."""
    by_set: dict[str, list[CellRow]] = {}
    for row in rows:
        by_set.setdefault(format_station_set(row["stations"]), []).append(row)
    return {name: errors_by_clip(each, metric) for name, each in by_set.items()}


def claim_best_of_size(behaviour: str, suitable: str, sets: ErrorsBySet, why: str = "") -> Claim:
    """Claim that no other set of the same size errs less, tested against the best of the others.

    `why` explains a claim that is not reproduced.
    """
    text = f"{behaviour}: of all sets of {count_stations(suitable)} stations, {suitable} errs least"
    others = {
        name: errors
        for name, errors in sets.items()
        if count_stations(name) == count_stations(suitable) and name != suitable
    }
    rival = min(others, key=lambda name: _mean_error(others[name]), default="")
    claim = f"{text} (against the best other, {rival})" if rival else text
    return claim_lower_error(claim, sets.get(suitable, {}), others.get(rival, {}), published="called suitable", why=why)


def claim_better_than_average(behaviour: str, suitable: str, sets: ErrorsBySet, why: str = "") -> Claim:
    """Claim that a set errs less than the average of the other sets of the same size."""
    others = {
        name: errors
        for name, errors in sets.items()
        if count_stations(name) == count_stations(suitable) and name != suitable
    }
    average = average_by_size(others).get(count_stations(suitable), {})
    text = f"{behaviour}: {suitable} errs less than the other sets of {count_stations(suitable)} stations on average"
    return claim_lower_error(text, sets.get(suitable, {}), average, published="called suitable", why=why)


def claim_error_decreases(behaviour: str, sets: ErrorsBySet) -> Claim:
    """Claim that the error, averaged over all sets of a size, decreases with each further station.

    Every step must decrease; the reported difference is that of the worst step.
    """
    text = f"{behaviour}: the error, averaged over the sets of a size, decreases with each further station"
    counts = average_by_size(sets)
    decreases = {f"{n} to {n + 1}": compare_paired(counts[n], counts[n + 1]) for n in counts if n + 1 in counts}
    if not decreases or any(fall.mean is None for fall in decreases.values()):
        return Claim(text, "order", "not measured", "not run", "no clip has results for all sets", unit="deg")
    verdicts = {fall.verdict for fall in decreases.values()}
    verdict = next(word for word in _WORST_FIRST if word in verdicts)
    step, least = min(decreases.items(), key=lambda each: (_WORST_FIRST.index(each[1].verdict), each[1].mean))
    ours = ", ".join(f"{_mean_error(errors):.2f}" for errors in counts.values())
    return Claim(
        text=text,
        published="order",
        ours=f"{ours} deg with {', '.join(map(str, counts))}",
        verdict=verdict,
        why="" if verdict == "reproduced" else f"from {step} stations: {least.why}",
        clips=len(least.clips),
        difference=least.mean,
        low=least.low,
        high=least.high,
        unit="deg",
    )


def claim_harder(text: str, hard: Errors, easy: Errors, why_not: str = "") -> Claim:
    """Claim that some clips are harder than others, tested by Welch's interval, since the clips are not paired."""
    if not hard or not easy:
        return Claim(text, "order", "not measured", "not run", "one side has no clips", unit="deg")
    ours, fewest = f"{_mean_error(hard):.2f} against {_mean_error(easy):.2f} deg", min(len(hard), len(easy))
    difference = _mean_error(hard) - _mean_error(easy)
    if fewest < MIN_CLIPS:
        why = f"too few clips: {fewest}, of at least {MIN_CLIPS}"
        return Claim(text, "order", ours, "cannot tell", why, fewest, difference, unit="deg")
    welch = stats.ttest_ind(list(hard.values()), list(easy.values()), equal_var=False).confidence_interval(
        CONFIDENCE_LEVEL
    )
    low, high = float(welch.low), float(welch.high)
    result = PairedDifference(tuple(hard), difference, low, high)
    why = "" if result.verdict == "reproduced" else "; ".join(filter(None, (result.why, why_not)))
    return Claim(text, "order", ours, result.verdict, why, fewest, difference, low, high, "deg")


def average_by_size(sets: ErrorsBySet) -> dict[int, dict[str, float]]:
    """Size -> clip -> error averaged over the sets of that size, for clips on which all of them were measured."""
    averages: dict[int, dict[str, float]] = {}
    for count in sorted({count_stations(name) for name in sets}):
        same_size = [errors for name, errors in sets.items() if count_stations(name) == count]
        shared = set.intersection(*(set(errors) for errors in same_size))
        averages[count] = {
            clip: float(np.mean([e[clip] for e in same_size])) for clip in same_size[0] if clip in shared
        }
    return averages


def ranked_bars(title: str, sets: ErrorsBySet, caption: str) -> BarChart:
    """A bar for each set, the best first, with the 95 % interval of its mean where there are enough clips."""
    order = sorted((name for name in sets if sets[name]), key=lambda name: _mean_error(sets[name]))
    enough = [np.array(list(sets[name].values())) if len(sets[name]) >= MIN_CLIPS else None for name in order]
    ends = [(None, None) if values is None else bootstrap_interval(values) for values in enough]
    return BarChart(
        title,
        "deg",
        tuple(order),
        {"kernel_cca": tuple(_mean_error(sets[name]) for name in order)},
        low={"kernel_cca": tuple(low for low, _ in ends)},
        high={"kernel_cca": tuple(high for _, high in ends)},
        horizontal=True,
        caption=caption,
    )


def station_count_lines(title: str, behaviours: Mapping[str, ErrorsBySet], caption: str) -> LineChart:
    """Line chart of the error against the number of stations, for each behaviour."""
    counts = {name: average_by_size(sets) for name, sets in behaviours.items()}
    sizes = sorted({n for each in counts.values() for n in each})
    series = {name: tuple(mean_sd(each.get(n, {}))[0] for n in sizes) for name, each in counts.items()}
    return LineChart(title, "stations", "mean joint-angle error [deg]", tuple(map(float, sizes)), series, caption)


def set_table(title: str, angles: ErrorsBySet, positions: ErrorsBySet, reference: str) -> FindingsTable:
    """Table of all sets with both errors, and the ratio of the angle error to that of the `reference` set."""
    base = _mean_error(angles.get(reference, {}))
    rows = [
        (name, format_mean(errors), format_mean(positions.get(name, {}), 0), _ratio_text(_mean_error(errors) / base))
        for name, errors in sorted(angles.items(), key=lambda each: (count_stations(each[0]), _mean_error(each[1])))
    ]
    return FindingsTable(title, ("stations", "joint angles [deg]", "joint centres [mm]", "times all five"), tuple(rows))


def _ratio_text(ratio: float) -> str:
    return f"{ratio:.2f}" if np.isfinite(ratio) else "not measured"


def _mean_error(errors: Errors) -> float:
    """Mean over clips; NaN without clips."""
    return float(np.mean(list(errors.values()))) if errors else float("nan")
