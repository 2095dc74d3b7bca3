"""Readings of stations on uniform grids of time, over what a capture and its reference have in common."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.errors import NotComparable
from harness.measure.angular_speed import TimeOffset
from harness.measure.pose_series import MeasuredPoses, TruthSpline
from harness.measure.sampling import own_places_s


@dataclass(frozen=True, eq=False)
class StationGrid:
    """Readings of one station on a uniform grid of N places."""

    period_s: float
    measured_s: Floats
    """(N,) device time [s]; the grid's own time where no record came."""
    position_m: Floats
    """(N, 3); zero where not known."""
    turn: Floats
    """(N, 4) `tracker_from_station`; identity where not known."""
    known: Bools
    """(N,) whether there is a reading, and the reference at its time."""


def make_grids(
    stations: Mapping[str, MeasuredPoses],
    splines: Mapping[str, TruthSpline],
    period_s: float,
    coarse: TimeOffset,
    least_matched: float,
) -> tuple[dict[str, StationGrid], float, float, float]:
    """Grids of all stations, the share of matched records, the overlap [s] and its middle [s]."""
    begins, ends = [], []
    for name, station in stations.items():
        at_s = station.measured_s[np.isfinite(station.measured_s)] - coarse.offset_s
        begins += [float(at_s.min()), float(splines[name].time_s[0])]
        ends += [float(at_s.max()), float(splines[name].time_s[-1])]
    begin_s, end_s = max(begins), min(ends)
    step_s = own_places_s([station.measured_s[station.valid] for station in stations.values()], period_s)
    grids = {
        name: _make_grid(station, splines[name], step_s, coarse.offset_s, begin_s, end_s)
        for name, station in stations.items()
    }
    due = len(grids) * max((end_s - begin_s) / period_s, 1.0)
    matched = min(sum(int(grid.known.sum()) for grid in grids.values()) / due, 1.0)
    if matched < least_matched:
        raise NotComparable(
            f"{100.0 * matched:.1f} % of the records due in the overlap have a pose and a reference.",
            f"At least {100.0 * least_matched:g} % must match; look for gaps in both recordings, or accept fewer "
            "(--least-matched 0.6).",
        )
    return grids, matched, end_s - begin_s, 0.5 * (begin_s + end_s)


def _make_grid(
    station: MeasuredPoses, spline: TruthSpline, period_s: float, offset_s: float, begin_s: float, end_s: float
) -> StationGrid:
    margin_s = 2.0 * period_s  # the refined offset must not leave the reference
    at_s = station.measured_s - offset_s
    known = station.valid & np.isfinite(at_s) & (at_s >= begin_s + margin_s) & (at_s <= end_s - margin_s)
    known &= np.isfinite(station.position_m).all(axis=1) & np.isfinite(station.tracker_from_station).all(axis=1)
    rows = np.flatnonzero(known)
    rows = rows[spline.covers(at_s[rows] - margin_s) & spline.covers(at_s[rows] + margin_s)]
    count = int((end_s - begin_s) / period_s) + 2
    place = np.clip(np.round((at_s[rows] - begin_s) / period_s).astype(np.int64), 0, count - 1)
    measured_s = begin_s + offset_s + period_s * np.arange(count, dtype=np.float64)
    position_m, turn = np.zeros((count, 3)), np.tile(rotations.IDENTITY, (count, 1))
    filled = np.zeros(count, bool)
    measured_s[place], position_m[place], filled[place] = station.measured_s[rows], station.position_m[rows], True
    turn[place] = station.tracker_from_station[rows]
    return StationGrid(period_s, measured_s, position_m, turn, filled)
