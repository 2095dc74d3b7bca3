"""Poses at rest against surveyed points (ASTM E2919): what is left after the best rigid placement of the points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, freeze
from harness.core.number_format import NORMAL_QUANTILE, Interval
from harness.errors import BadInput
from harness.measure.uncertainty import BudgetComponent, UncertaintyBudget

FEWEST_POINTS = 4
"""Three points fix the placement, and leave one number to judge by."""
_LEAST_EXTENT_M = 0.01
"""Least extent of the points along their second axis [m]: points on one line fix no placement."""


@dataclass(frozen=True, eq=False)
class RestPlace:
    """Where a station rested."""

    station: str
    begin_s: float
    position_m: Floats
    """(3,) median position [m]."""
    deviation_m: Floats
    """(3,) standard deviation of single readings on each axis [m]."""
    count: int

    def __post_init__(self) -> None:
        freeze(self, position_m=(3,), deviation_m=(3,))


@dataclass(frozen=True, eq=False)
class SurveyComparison:
    """K rests against K surveyed points."""

    station: str
    errors_m: Floats
    """(K, 3) rest minus placed point, tracker's axes [m]."""
    rms_m: Interval
    """RMS distance, for the 6 numbers of the placement corrected [m]."""
    scale: Interval
    """Relative error of distances between rests."""
    budget: UncertaintyBudget
    """Uncertainty of one coordinate of a single reading [m]."""

    def __post_init__(self) -> None:
        freeze(self, errors_m=("K", 3))


def compare_with_survey(rests: Sequence[RestPlace], points_m: Floats, deviation_m: float = 0.0) -> SurveyComparison:
    """Compare rests, in the order of time, with points (K, 3) in the same order, known to `deviation_m` on each axis.

    BadInput for other numbers of rests and points, several stations, fewer than four points, and points on one line.
    """
    stations = sorted({one.station for one in rests})
    if len(stations) > 1:
        raise BadInput(f"{', '.join(stations)} rest.", "Give a file in which one body rests on the points.")
    if len(rests) != len(points_m):
        times = ", ".join(f"{one.begin_s:.1f} s" for one in rests[:12]) or "none"
        raise BadInput(
            f"{len(rests)} rests for {len(points_m)} surveyed points (begins: {times}).",
            "Let the body rest for 10 s or more on each point once, in the order of the file.",
        )
    if len(points_m) < FEWEST_POINTS:
        raise BadInput(f"{len(points_m)} surveyed points.", f"At least {FEWEST_POINTS} show errors.")
    ordered = sorted(rests, key=lambda one: one.begin_s)
    found_m = np.array([one.position_m for one in ordered])
    centred, expected = found_m - found_m.mean(axis=0), points_m - points_m.mean(axis=0)
    if np.linalg.svd(expected, compute_uv=False)[1] < _LEAST_EXTENT_M:
        raise BadInput("The surveyed points lie on one line.", "Survey points that span a plane or a volume.")
    turn = rotations.nearest_rotation(centred.T @ expected)
    errors_m = centred - expected @ turn.T
    freedom = 3 * len(points_m) - 6
    rms_m = math.sqrt(float(np.sum(errors_m**2)) / freedom * 3.0)
    within = math.sqrt(float(np.mean([np.mean(one.deviation_m**2) for one in ordered])))
    along = float(np.sum(centred * (expected @ turn.T)) / np.sum(expected**2))
    doubt = math.hypot(rms_m / math.sqrt(3.0), deviation_m) / math.sqrt(float(np.sum(expected**2)))
    half = NORMAL_QUANTILE * rms_m / math.sqrt(2.0 * freedom)
    components = [
        BudgetComponent("repeatability", within, "A", float(sum(one.count for one in ordered) - len(ordered))),
        BudgetComponent("change over the volume", rms_m / math.sqrt(3.0), "A", float(freedom)),
    ]
    if deviation_m:
        components.append(BudgetComponent("surveyed points", deviation_m, "B"))
    missing = Interval.missing("The placement of the points takes it out.")
    return SurveyComparison(
        stations[0],
        errors_m,
        Interval(rms_m, max(rms_m - half, 0.0), rms_m + half, len(points_m)),
        Interval.normal(
            along - 1.0, math.hypot(doubt, deviation_m / math.sqrt(float(np.sum(expected**2)))), len(points_m)
        ),
        UncertaintyBudget("coordinate", "m", tuple(components), missing),
    )
