"""Kim et al. 2012, Fig. 3: the best set of stations of each size, the gain of one more, and the most movable limbs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy import stats

from harness.compare import CONFIDENCE_LEVEL, MIN_UNITS, PairedDifference, mean_interval
from harness.core.split import ClipPart, allowed_frames
from harness.experiment.scenarios import open_scenario_motion
from harness.results import PRIMARY_METRIC
from harness.results.findings import BarChart, BenchmarkStatement, FindingsTable, LineChart, StatementKind
from harness.study.papers.claims import Errors, claim_all, claim_decreasing, claim_lower_error, claim_noninferior
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.tables import SummaryRow, errors_by_unit, format_mean, mean_sd, number_of_units

STATION_ABBREVIATIONS = {
    "right_hand": "RH",
    "left_hand": "LH",
    "right_ankle": "RA",
    "left_ankle": "LA",
    "pelvis": "PEL",
}
"""Station -> abbreviation, as in the paper and in its order."""
_WITH_MORE = (4, 5)
"""Sizes of the sets that a suitable set of three is compared with."""
ErrorsBySet = Mapping[str, Errors]
"""Set of stations, such as "RH+LH+PEL" -> error by unit."""
LIMBS: Mapping[str, tuple[str, ...]] = {
    "right_hand": ("rhumerus", "rradius", "rwrist", "rhand"),
    "left_hand": ("lhumerus", "lradius", "lwrist", "lhand"),
    "right_ankle": ("rfemur", "rtibia"),
    "left_ankle": ("lfemur", "ltibia"),
    "pelvis": (),
}
"""Station -> bones from shoulder or hip to the one that carries it; the pelvis is the root and has no hinge."""
_QUANTILES = (0.025, 0.975)


def format_station_set(stations: Iterable[str]) -> str:
    """Format a set as in "RH+LH+PEL", in the order of `STATION_ABBREVIATIONS`."""
    selected = set(stations)
    return "+".join(short for station, short in STATION_ABBREVIATIONS.items() if station in selected)


def count_stations(name: str) -> int:
    """Number of stations of a set, from its name."""
    return name.count("+") + 1


def errors_by_set(rows: Iterable[SummaryRow], metric: str = PRIMARY_METRIC) -> dict[str, dict[str, float]]:
    """Set -> unit -> error, of rows that differ only in clip and stations."""
    by_set: dict[str, list[SummaryRow]] = {}
    for row in rows:
        by_set.setdefault(format_station_set(row["stations"]), []).append(row)
    return {name: errors_by_unit(each, metric) for name, each in by_set.items()}


def claim_best_of_size(behaviour: str, suitable: str, sets: ErrorsBySet, why: str = "") -> BenchmarkStatement:
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


def claim_better_than_average(behaviour: str, suitable: str, sets: ErrorsBySet, why: str = "") -> BenchmarkStatement:
    """Claim that a set errs less than the average of the other sets of the same size."""
    others = {
        name: errors
        for name, errors in sets.items()
        if count_stations(name) == count_stations(suitable) and name != suitable
    }
    average = average_by_size(others).get(count_stations(suitable), {})
    text = f"{behaviour}: {suitable} errs less than the other sets of {count_stations(suitable)} stations on average"
    return claim_lower_error(text, sets.get(suitable, {}), average, published="called suitable", why=why)


def claim_suitable(
    behaviour: str, suitable: str, sets: ErrorsBySet, kind: StatementKind = "printed"
) -> BenchmarkStatement:
    """Claim that a set is suitable compared with larger ones: its error is not inferior to that of the best of these.

    It must hold against the best set of four and against all five, within the margin of joint angles. The best set is
    chosen on the tested clips, which makes the claim harder to reproduce.
    """
    text = (
        f"{behaviour}: {suitable} is not inferior to the best set of four stations and to all five, within the margin"
    )
    best = {count: _best_of_size(sets, count) for count in _WITH_MORE}
    parts = {
        f"against {best[count] or f'the best of {count}'}": claim_noninferior(
            text, sets.get(suitable, {}), sets.get(best[count], {}), published="called suitable", kind=kind
        )
        for count in _WITH_MORE
    }
    return claim_all(text, parts)


def _best_of_size(sets: ErrorsBySet, count: int) -> str:
    """The set of this size with the least mean error; "" if none was measured."""
    measured = [name for name in sets if count_stations(name) == count and sets[name]]
    return min(measured, key=lambda name: _mean_error(sets[name]), default="")


def claim_most_movable(behaviour: str, ranges_deg: Mapping[str, float], sets: ErrorsBySet) -> BenchmarkStatement:
    """Claim that the most movable joints should be tracked.

    `ranges_deg` is abbreviation -> range of motion of its limb in the database. The two stations with the largest are
    tested: sets of two and of three that have both against those of the same size that have neither, averaged over the
    sets of a size and over both sizes.
    """
    pair = sorted(sorted(ranges_deg, key=lambda name: -ranges_deg[name])[:2], key=list(ranges_deg).index)
    shown = ", ".join(f"{name} {degrees:.0f}" for name, degrees in ranges_deg.items())
    text = f"{behaviour}: sets with {' and '.join(pair)}, the most movable, err less than sets of their size without"
    both: list[dict[str, float]] = []
    neither: list[dict[str, float]] = []
    for size in (2, 3):
        for side, count in ((both, 2), (neither, 0)):
            chosen = {
                name: errors
                for name, errors in sets.items()
                if count_stations(name) == size and len(set(pair) & set(name.split("+"))) == count
            }
            side.append(average_by_size(chosen).get(size, {}))
    claim = claim_lower_error(text, _average(both), _average(neither), published="stated")
    return replace(claim, measured=f"{claim.measured}; ranges {shown} deg" if ranges_deg else claim.measured)


def _average(sides: Sequence[Errors]) -> dict[str, float]:
    """Unit -> mean over several errors, for units that all of them have."""
    shared = set.intersection(*map(set, sides))
    return {unit: float(np.mean([errors[unit] for errors in sides])) for unit in sorted(shared)}


def claim_error_decreases(behaviour: str, sets: ErrorsBySet) -> BenchmarkStatement:
    """Claim that the error, averaged over all sets of a size, decreases with each further station.

    Every step must decrease; the reported difference is that of the worst step.
    """
    text = f"{behaviour}: the error, averaged over the sets of a size, decreases with each further station"
    return claim_decreasing(text, {f"{n}": errors for n, errors in average_by_size(sets).items()}, "stations")


def claim_harder(text: str, hard: Errors, easy: Errors, why_not: str = "") -> BenchmarkStatement:
    """Claim that some motion is harder than other motion, by Welch's interval, since the clips are not paired."""
    if not hard or not easy:
        return BenchmarkStatement(text, "order", "not measured", "not run", "one side has no units", unit="deg")
    ours, fewest = f"{_mean_error(hard):.2f} against {_mean_error(easy):.2f} deg", min(len(hard), len(easy))
    difference = _mean_error(hard) - _mean_error(easy)
    if fewest < MIN_UNITS:
        why = f"too few units: {fewest}, of at least {MIN_UNITS}"
        return BenchmarkStatement(text, "order", ours, "cannot tell", why, fewest, difference, unit="deg")
    welch = stats.ttest_ind(list(hard.values()), list(easy.values()), equal_var=False)
    interval = welch.confidence_interval(CONFIDENCE_LEVEL)
    low, high = float(interval.low), float(interval.high)
    result = PairedDifference(tuple(hard), difference, low, high)
    why = "" if result.verdict == "reproduced" else "; ".join(filter(None, (result.why, why_not)))
    p = float(welch.pvalue) if np.isfinite(welch.pvalue) else None  # NaN where no error differs from another
    return BenchmarkStatement(text, "order", ours, result.verdict, why, fewest, difference, low, high, "deg", p=p)


def average_by_size(sets: ErrorsBySet) -> dict[int, dict[str, float]]:
    """Size -> unit -> error averaged over the sets of that size, for units on which all of them were measured."""
    averages: dict[int, dict[str, float]] = {}
    for count in sorted({count_stations(name) for name in sets}):
        same_size = [errors for name, errors in sets.items() if count_stations(name) == count]
        shared = set.intersection(*(set(errors) for errors in same_size))
        averages[count] = {
            unit: float(np.mean([e[unit] for e in same_size])) for unit in same_size[0] if unit in shared
        }
    return averages


def ranked_bars(title: str, sets: ErrorsBySet, caption: str) -> BarChart:
    """A bar for each set, the best first, with the 95 % interval of its mean where there are enough units."""
    order = sorted((name for name in sets if sets[name]), key=lambda name: _mean_error(sets[name]))
    enough = [np.array(list(sets[name].values())) if len(sets[name]) >= MIN_UNITS else None for name in order]
    ends = [(None, None) if values is None else mean_interval(values) for values in enough]
    return BarChart(
        title,
        "deg",
        tuple(order),
        {"kernel_cca": tuple(_mean_error(sets[name]) for name in order)},
        low={"kernel_cca": tuple(low for low, _ in ends)},
        high={"kernel_cca": tuple(high for _, high in ends)},
        horizontal=True,
        caption=f"{caption} {number_of_units(sets.values())}",
    )


def station_count_lines(title: str, behaviours: Mapping[str, ErrorsBySet], caption: str) -> LineChart:
    """Line chart of the error against the number of stations, for each behaviour."""
    counts = {name: average_by_size(sets) for name, sets in behaviours.items()}
    sizes = sorted({n for each in counts.values() for n in each})
    series = {name: tuple(mean_sd(each.get(n, {}))[0] for n in sizes) for name, each in counts.items()}
    shown = f"{caption} {number_of_units(errors for each in counts.values() for errors in each.values())}"
    return LineChart(title, "stations", "mean joint-angle error [deg]", tuple(map(float, sizes)), series, shown)


def set_table(title: str, angles: ErrorsBySet, positions: ErrorsBySet, reference: str) -> FindingsTable:
    """Table of all sets: mean and RMS of joint angles, joint centres, and the ratio of the angle error to that of the
    `reference` set.
    """
    base = _mean_error(angles.get(reference, {}))
    rows = [
        (
            name,
            format_mean(errors),
            format_mean(positions.get(name, {}), 0),
            _ratio_text(_mean_error(errors) / base),
        )
        for name, errors in sorted(angles.items(), key=lambda each: (count_stations(each[0]), _mean_error(each[1])))
    ]
    return FindingsTable(title, ("stations", "joint angles [deg]", "joint centres [mm]", "times all five"), tuple(rows))


def _ratio_text(ratio: float) -> str:
    return f"{ratio:.2f}" if np.isfinite(ratio) else "not measured"


def _mean_error(errors: Errors) -> float:
    """Mean over units; NaN without units."""
    return float(np.mean(list(errors.values()))) if errors else float("nan")


def measure_ranges(study: PaperStudy, run: str) -> dict[str, float]:
    """Station -> range of motion of its limb in the run's examples [deg].

    The range of a limb is that of its most movable hinge: the width of the central 95 % of its angles over all frames
    that may be learnt from, so those of tested blocks do not count. A station without hinges has 0.
    """
    motion = study.runs[run].motion
    source = open_scenario_motion(motion, study.library, study.seed)
    withheld = [ClipPart.parse(text) for text in (*motion.withheld, *motion.test)]
    angles: dict[str, list[np.ndarray]] = {}
    for name in motion.examples:
        clip = source.load(name)
        runs = allowed_frames(withheld, name, len(clip), clip.rate_hz)
        for column, hinge in enumerate(clip.skeleton.dof_names):
            angles.setdefault(hinge, []).extend(clip.angles_rad[run.start : run.stop, column] for run in runs)
    widths_deg = {
        hinge: float(np.rad2deg(np.ptp(np.quantile(np.concatenate(values), _QUANTILES))))
        for hinge, values in angles.items()
    }
    return {
        station: max((width for hinge, width in widths_deg.items() if hinge.partition(".")[0] in bones), default=0.0)
        for station, bones in LIMBS.items()
    }
