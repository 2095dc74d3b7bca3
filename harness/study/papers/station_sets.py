"""Sets of trackers against each other: which of them to wear, and what one more is worth (Kim et al. 2012, Fig. 3)."""

from collections.abc import Iterable, Mapping

import numpy as np
from scipy import stats

from harness.compare.paired_statistics import (
    CONFIDENCE_LEVEL,
    MIN_CLIPS,
    PairedDifference,
    bootstrap_interval,
    compare_paired,
)
from harness.results.expected_orders import METRIC
from harness.results.findings import BarChart, Claim, ClaimVerdict, FindingsTable, LineChart
from harness.study.papers.claims import Errors, claim_lower_error
from harness.study.papers.tables import CellRow, errors_by_clip, format_mean, mean_sd

STATION_ABBREVIATIONS = {
    "right_hand": "RH",
    "left_hand": "LH",
    "right_ankle": "RA",
    "left_ankle": "LA",
    "pelvis": "PEL",
}
"""As the paper calls them, in its order."""
_WORST_FIRST: tuple[ClaimVerdict, ...] = ("not reproduced", "cannot tell", "reproduced")
ErrorsBySet = Mapping[str, Errors]
"""Set of trackers, such as "RH+LH+PEL", -> error by clip."""


def format_station_set(stations: Iterable[str]) -> str:
    """ "RH+LH+PEL", in whatever order they are given."""
    worn = set(stations)
    return "+".join(short for station, short in STATION_ABBREVIATIONS.items() if station in worn)


def count_stations(name: str) -> int:
    """How many trackers a set has."""
    return name.count("+") + 1


def errors_by_set(rows: Iterable[CellRow], metric: str = METRIC) -> dict[str, dict[str, float]]:
    """Rows that differ in the clip and the trackers worn alone."""
    found: dict[str, list[CellRow]] = {}
    for row in rows:
        found.setdefault(format_station_set(row["stations"]), []).append(row)
    return {name: errors_by_clip(each, metric) for name, each in found.items()}


def claim_best_of_size(behaviour: str, suited: str, sets: ErrorsBySet, why: str = "") -> Claim:
    """That no other set of as many trackers serves better: held against the one among them that errs least.

    `why` is what is known where that is not so.
    """
    text = f"{behaviour}: of all sets of {count_stations(suited)} trackers {suited} errs least"
    others = {
        name: errors
        for name, errors in sets.items()
        if count_stations(name) == count_stations(suited) and name != suited
    }
    rival = min(others, key=lambda name: _mean_error(others[name]), default="")
    claim = f"{text} (against the best other, {rival})" if rival else text
    return claim_lower_error(claim, sets.get(suited, {}), others.get(rival, {}), published="called suitable", why=why)


def claim_better_than_average(behaviour: str, suited: str, sets: ErrorsBySet, why: str = "") -> Claim:
    """The same held against what the other sets of as many come to on average."""
    others = {
        name: errors
        for name, errors in sets.items()
        if count_stations(name) == count_stations(suited) and name != suited
    }
    average = average_by_size(others).get(count_stations(suited), {})
    text = f"{behaviour}: {suited} errs less than the other sets of {count_stations(suited)} trackers on average"
    return claim_lower_error(text, sets.get(suited, {}), average, published="called suitable", why=why)


def claim_error_decreases(behaviour: str, sets: ErrorsBySet) -> Claim:
    """That the error, averaged over all sets of so many trackers, falls with each tracker more.

    Every step has to; the difference is that of the worst one.
    """
    text = f"{behaviour}: the error falls with every tracker more, averaged over the sets of as many"
    counts = average_by_size(sets)
    falls = {f"{n} to {n + 1}": compare_paired(counts[n], counts[n + 1]) for n in counts if n + 1 in counts}
    if not falls or any(fall.mean is None for fall in falls.values()):
        return Claim(text, "order", "not measured", "not run", "no clip on which all sets were measured", unit="deg")
    verdicts = {fall.verdict for fall in falls.values()}
    verdict = next(word for word in _WORST_FIRST if word in verdicts)
    step, least = min(falls.items(), key=lambda each: (_WORST_FIRST.index(each[1].verdict), each[1].mean))
    ours = ", ".join(f"{_mean_error(errors):.2f}" for errors in counts.values())
    return Claim(
        text=text,
        published="order",
        ours=f"{ours} deg with {', '.join(map(str, counts))}",
        verdict=verdict,
        why="" if verdict == "reproduced" else f"from {step} trackers: {least.why}",
        clips=len(least.clips),
        difference=least.mean,
        low=least.low,
        high=least.high,
        unit="deg",
    )


def claim_harder(text: str, hard: Errors, easy: Errors, why_not: str = "") -> Claim:
    """That other clips are harder: Welch's interval of the difference of means, since nothing pairs them."""
    if not hard or not easy:
        return Claim(text, "order", "not measured", "not run", "one of the two has no clips", unit="deg")
    ours, fewest = f"{_mean_error(hard):.2f} against {_mean_error(easy):.2f} deg", min(len(hard), len(easy))
    difference = _mean_error(hard) - _mean_error(easy)
    if fewest < MIN_CLIPS:
        why = f"too few clips: {fewest}, of at least {MIN_CLIPS}"
        return Claim(text, "order", ours, "cannot tell", why, fewest, difference, unit="deg")
    welch = stats.ttest_ind(list(hard.values()), list(easy.values()), equal_var=False).confidence_interval(
        CONFIDENCE_LEVEL
    )
    low, high = float(welch.low), float(welch.high)
    judged = PairedDifference(tuple(hard), difference, low, high)
    why = "" if judged.verdict == "reproduced" else "; ".join(filter(None, (judged.why, why_not)))
    return Claim(text, "order", ours, judged.verdict, why, fewest, difference, low, high, "deg")


def average_by_size(sets: ErrorsBySet) -> dict[int, dict[str, float]]:
    """Number of trackers -> clip -> error averaged over the sets of as many, of clips on which all were measured."""
    found: dict[int, dict[str, float]] = {}
    for count in sorted({count_stations(name) for name in sets}):
        alike = [errors for name, errors in sets.items() if count_stations(name) == count]
        shared = set.intersection(*(set(errors) for errors in alike))
        found[count] = {clip: float(np.mean([e[clip] for e in alike])) for clip in alike[0] if clip in shared}
    return found


def ranked_bars(title: str, sets: ErrorsBySet, caption: str) -> BarChart:
    """A bar for each set, the best first, with the 95 % interval of its mean where there are clips enough."""
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
    """Behaviour -> sets, as error against the number of trackers."""
    counts = {name: average_by_size(sets) for name, sets in behaviours.items()}
    every = sorted({n for each in counts.values() for n in each})
    series = {name: tuple(mean_sd(each.get(n, {}))[0] for n in every) for name, each in counts.items()}
    return LineChart(title, "trackers worn", "mean joint-angle error [deg]", tuple(map(float, every)), series, caption)


def set_table(title: str, angles: ErrorsBySet, positions: ErrorsBySet, whole: str) -> FindingsTable:
    """Every set with both its errors, and how many times that of the `whole` set it errs."""
    base = _mean_error(angles.get(whole, {}))
    rows = [
        (name, format_mean(errors), format_mean(positions.get(name, {}), 0), _ratio_text(_mean_error(errors) / base))
        for name, errors in sorted(angles.items(), key=lambda each: (count_stations(each[0]), _mean_error(each[1])))
    ]
    return FindingsTable(title, ("trackers", "joint angles [deg]", "joint centres [mm]", "times all five"), tuple(rows))


def _ratio_text(ratio: float) -> str:
    return f"{ratio:.2f}" if np.isfinite(ratio) else "not measured"


def _mean_error(errors: Errors) -> float:
    """NaN of none."""
    return float(np.mean(list(errors.values()))) if errors else float("nan")
