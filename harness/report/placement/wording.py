"""A placement study in words: what to wear in one sentence, sets by short names, figures with decimals enough."""

import math
from collections.abc import Sequence

from harness.compare.paired_statistics import MIN_CLIPS, compare_paired
from harness.report.paper.verdicts import MINUS
from harness.results.placement_findings import (
    BestSet,
    MarginalContribution,
    PlacementFindings,
    PlacementSearch,
    StationNames,
    StationPlacement,
    StationSetResult,
)

_SIDES = ("left_", "right_")
_IRREGULAR = {"foot": "feet", "calf": "calves", "humerus": "humeri", "femur": "femora", "tibia": "tibiae"}
_MOST_DECIMALS = 4
TIE_NOTE = (
    "A tie is not surely worse than the first by sign flips over clips, counting all comparisons (Holm 1979); an "
    "interval is of one pair alone, so that it may leave zero out and still be a tie."
)
"""What tables and pictures mean by a tie."""
_WORTH_LABELS = {"ablate": "left out of", "add": "added to", "exhaustive": "with it against without it, over all sets"}


def set_name(stations: StationNames) -> str:
    """ "both ankles + pelvis": pairs first, then the others, in the order of the set."""
    left, right = ({n.removeprefix(side) for n in stations if n.startswith(side)} for side in _SIDES)
    parts = []
    for name in stations:
        bare = name.removeprefix(_SIDES[0]).removeprefix(_SIDES[1])
        if bare not in left & right:
            parts.append(plain_name(name))
        elif name.startswith(_SIDES[0]):
            parts.append(f"both {_plural(plain_name(bare))}")
    return " + ".join(sorted(parts, key=lambda part: not part.startswith("both "))) or "none"


def original_candidates(findings: PlacementFindings) -> list[StationPlacement]:
    """The candidates that the study names, without those that it moved."""
    return [place for place in findings.candidates if not place.moved_from]


def worth_label(findings: PlacementFindings, worth: MarginalContribution) -> str:
    """In which way a candidate's worth was found: "left out of all 5"."""
    whole = len(worth.base) == len(original_candidates(findings))
    base = "" if not worth.base else f"all {len(worth.base)}" if whole else set_name(worth.base)
    return f"{_WORTH_LABELS[worth.mode]} {base}".strip()


def plain_name(name: str) -> str:
    return name.replace("_", " ")


def _plural(name: str) -> str:
    *before, last = name.split(" ")
    return " ".join([*before, _IRREGULAR.get(last, f"{last}s")])


def sentence(findings: PlacementFindings) -> str:
    """What to wear: the fewest stations that nothing shows to be worse than the best set of any size."""
    chosen = smallest_sufficient_set(findings)
    if chosen is None:
        return "No set of stations was measured."
    tried = findings.of(chosen.stations)
    ties = _ties(chosen)
    held = format_held_out(findings, chosen)
    elsewhere = f", and {held} on {chosen.held_out_clips} clips on which nothing was chosen" if held else ""
    return (
        f"{_opening(findings, chosen)}: {set_name(chosen.stations)}, {format_error(findings, tried)}{elsewhere}{ties}."
    )


def _opening(findings: PlacementFindings, chosen: BestSet) -> str:
    """How many, and how that was found."""
    count = len(chosen.stations)
    most = max(len(best.stations) for best in findings.best)
    noun = f"{count} tracker{'s'[: count != 1]}"
    clips = max((len(measured_errors(tried)) for tried in findings.tried), default=0)
    if clips < MIN_CLIPS:
        return f"The least error came with {noun}, on too few clips ({clips}) to tell it from others"
    if count == most:
        return f"Of 1 to {most} trackers {count} err least" if count > 1 else "One tracker"
    return f"{noun[0].upper() + noun[1:]} {'serve' if count != 1 else 'serves'} as well as up to {most}"


def _ties(best: BestSet) -> str:
    if not best.ties:
        return ""
    others = "another set" if len(best.ties) == 1 else f"{len(best.ties)} other sets"
    return f"; nothing tells it from {others} of as many"


def smallest_sufficient_set(findings: PlacementFindings) -> BestSet | None:
    """The smallest set among the best of each size that nothing shows to be worse than the best of them all."""
    found = [
        (best, tried) for best in findings.best if (tried := findings.of(best.stations)) and tried.mean is not None
    ]
    if not found:
        return None
    sign = 1.0 if findings.better == "lower" else -1.0
    best, top = min(found, key=lambda each: sign * (each[1].mean or 0.0))
    smaller = (each for each in found if len(each[0].stations) < len(best.stations))
    return next((other for other, tried in smaller if not _is_worse(tried, top, sign)), best)


def _is_worse(tried: StationSetResult, top: StationSetResult, sign: float) -> bool:
    """Whether its paired interval lies on the bad side of `top` as a whole; with too few clips it counts as worse."""
    behind = compare_paired(tried.errors, top.errors)
    if behind.low is None or behind.high is None:
        return True
    return min(sign * behind.low, sign * behind.high) > 0.0


def measured_errors(tried: StationSetResult) -> dict[str, float]:
    """Clip -> error, of clips on which there is one."""
    return {clip: value for clip, value in tried.errors.items() if value is not None}


def format_error(findings: PlacementFindings, tried: StationSetResult | None) -> str:
    """ "1.90 deg (1.78 to 2.02)"."""
    if tried is None or tried.mean is None:
        return "not measured"
    return format_mean(findings, tried.mean, tried.low, tried.high)


def format_held_out(findings: PlacementFindings, best: BestSet) -> str:
    """Its error on the clips that were held out, "" where there are none."""
    if best.held_out is None:
        return ""
    return format_mean(findings, best.held_out, best.held_out_low, best.held_out_high)


def format_mean(findings: PlacementFindings, mean: float, low: float | None, high: float | None) -> str:
    """ "1.90 deg (1.78 to 2.02)"."""
    text = f"{format_value(mean)} {findings.unit}".rstrip()
    return f"{text} ({format_value(low)} to {format_value(high)})" if low is not None else text


def search_gain_sentence(search: PlacementSearch, unit: str) -> str:
    """What a search is worth where nothing was chosen, "" where that was not judged."""
    if search.held_out is None:
        return ""
    gain = format_difference(search.held_out, search.held_out_low, search.held_out_high)
    return f"On {search.held_out_clips} clips on which nothing was chosen the last set saves {gain} {unit}".rstrip()


def format_difference(mean: float | None, low: float | None, high: float | None) -> str:
    """ "+0.30 (0.21 to 0.38)", with as many decimals as the smallest of the three needs."""
    if mean is None:
        return "not measured"
    decimals = decimals_needed(mean, low, high)
    within = "" if low is None else f" ({format_signed(low, decimals)} to {format_signed(high, decimals)})"
    return f"{format_signed(mean, decimals)}{within}"


def format_signed(value: float | None, decimals: int = 2) -> str:
    if value is None:
        return "not measured"
    text = f"{value:+.{decimals}f}"
    return (text if text.strip("+-0.") else text.lstrip("+-")).replace("-", MINUS)


def format_value(value: float | None, decimals: int = 2) -> str:
    """Two decimals, more for what would read 0.00, none for large ones."""
    if value is None:
        return "not measured"
    decimals = 0 if abs(value) >= 1000.0 else 1 if abs(value) >= 100.0 else max(decimals, decimals_needed(value))
    return f"{value:,.{decimals}f}".replace("-", MINUS)


def decimals_needed(*values: float | None) -> int:
    """Decimals, 2 at least, so that none that is not zero reads 0.00."""
    finest = min((abs(v) for v in values if v), default=1.0)
    return min(max(math.ceil(-math.log10(finest)), 2), _MOST_DECIMALS)


def format_percent(value: float | None) -> str:
    """In per cent, "" of none."""
    return "" if value is None else f"{100.0 * value:.0f} %"


def format_rank_range(rank_low: int, rank_high: int) -> str:
    return str(rank_low) if rank_low == rank_high else f"{rank_low} to {rank_high}"


def list_sets(sets: Sequence[StationNames], most: int = 3) -> str:
    """A few sets by name, and how many more."""
    names = [set_name(stations) for stations in sets[:most]]
    return "; ".join([*names, *([f"{len(sets) - most} more"] if len(sets) > most else [])])
