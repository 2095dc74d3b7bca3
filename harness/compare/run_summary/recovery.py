"""Recovery from disturbances: errors of disturbed cells compared with those of undisturbed cells.

A scenario requests it by varying its disturbance, for example

    [disturbance]
    station = "right_hand"
    from_s = 3.0
    [vary]
    "disturbance.kind" = ["none", "one_lost", "all_lost", "one_off", "all_turned", "start_off"]

Both cells of a pair have the same motion and the same draws of noise (`core.seeds`). The measure is the mean joint
angle error over the second that begins 1 s after the last bad frame, divided by that of the undisturbed cell over the
same frames. A ratio of up to 1.5 counts as recovered. `harness run` prints it below its table, and `summary.json` lists
it.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.estimate import LOST_AFTER_S, Status
from harness.core.files import to_json_types
from harness.results import Cell

MAX_RECOVERED_RATIO = 1.5
"""Largest ratio to the undisturbed error that counts as recovered."""
SETTLING_S, WINDOW_S = 1.0, 1.0
"""Start of the evaluated window after the last bad frame, and its length [s]."""
_SMOOTHING_S = 0.25
_STATUS_TOLERANCE_S = 0.05


@dataclass(frozen=True, eq=False)
class _CellErrors:
    """Errors of one cell over time."""

    cell: Mapping[str, str]
    disturbance: Mapping[str, Any]
    time_s: Floats
    error_deg: Floats
    error_mm: Floats
    status: Ints
    reporting: Bools
    """(F,) whether at least half of the stations report."""


class RecoveryCollector:
    """Collects cells in any order and pairs disturbed cells with their undisturbed twins."""

    def __init__(self) -> None:
        self._courses: dict[str, dict[str, _CellErrors]] = {}

    def add(self, cell: Cell) -> None:
        """Add a cell, if its scenario has a disturbance."""
        if "disturbance" not in cell.defined_by:
            return
        disturbance = dict(cell.defined_by["disturbance"])
        same = {name: value for name, value in cell.defined_by.items() if name != "disturbance"}
        kind = disturbance["kind"]
        settings = {name: value for name, value in disturbance.items() if name not in ("kind", "begins_s", "ends_s")}
        names = ("method", "inputs", "split", "behaviour", "clip")
        pair = json.dumps(to_json_types({"method": cell.method, "same": same, "settings": settings}), sort_keys=True)
        seen = (cell.position_valid | cell.orientation_valid).sum(axis=1)
        self._courses.setdefault(pair, {})[kind] = _CellErrors(
            {name: str(getattr(cell, name)) for name in names},
            disturbance,
            cell.time_s,
            cell.errors["joint_angle_mean_deg"],
            cell.errors["mpjpe_mm"],
            cell.status,
            (2 * seen >= len(cell.stations)) & (seen > 0),
        )

    def rows(self) -> list[dict[str, Any]]:
        """Records for `summary.json` of every disturbed cell that has an undisturbed twin.

        A record has the cell (`method`, `inputs`, `split`, `behaviour`, `clip`), its `disturbance`, and

        - `evaluated_frames`: number of frames in the evaluated window; 0 if the take ends before
          it, and then no value is known;
        - `disturbed_deg`, `undisturbed_deg`, `disturbed_mm`, `undisturbed_mm`: mean joint angle error and mean distance
          of the joint centres in the window; `ratio` is that of the angles;
        - `during`: that ratio during the disturbance, from the first bad frame to the last;
        - `back_after_s`: time from the last bad frame until the error, smoothed over 0.25 s, stays within 1.5 times the
          undisturbed one up to the end of the window [s]; None if it never does;
        - `status_right`: share of frames, from the first bad one to the end of the window, whose status agrees with the
          readings.
        """
        found = []
        for courses in self._courses.values():
            if (plain_course := courses.get("none")) is not None:
                found += [_recovery(course, plain_course) for kind, course in courses.items() if kind != "none"]
        return found


def _recovery(course: _CellErrors, undisturbed: _CellErrors) -> dict[str, Any]:
    begin_s, end_s = float(course.disturbance["begins_s"]), float(course.disturbance["ends_s"])
    common, here, there = np.intersect1d(course.time_s, undisturbed.time_s, return_indices=True)
    bad = common[common < end_s - 1e-9]
    since_s = common - (bad[-1] if len(bad) else np.inf)
    long_enough = len(since_s) > 0 and since_s[-1] > SETTLING_S + WINDOW_S - 1e-9
    until = (since_s <= SETTLING_S + WINDOW_S + 1e-9) & long_enough
    after, during = until & (since_s > SETTLING_S + 1e-9), until & (common >= begin_s - 1e-9) & (since_s <= 0.0)
    disturbed_deg, undisturbed_deg = course.error_deg[here], undisturbed.error_deg[there]
    right = _status_is_correct(course.time_s, course.reporting, course.status)
    ours_deg, theirs_deg = _mean_over(disturbed_deg, after), _mean_over(undisturbed_deg, after)
    return {
        **course.cell,
        "disturbance": str(course.disturbance["kind"]),
        "evaluated_frames": int(np.count_nonzero(after)),
        "disturbed_deg": ours_deg,
        "undisturbed_deg": theirs_deg,
        "during": error_ratio(_mean_over(disturbed_deg, during), _mean_over(undisturbed_deg, during)),
        "disturbed_mm": _mean_over(course.error_mm[here], after),
        "undisturbed_mm": _mean_over(undisturbed.error_mm[there], after),
        "back_after_s": _back_after_s(since_s, until & (since_s > 0.0), disturbed_deg, undisturbed_deg),
        "status_right": _mean_over(right[here].astype(float), until & (common >= begin_s - 1e-9)),
        "ratio": error_ratio(ours_deg, theirs_deg),
    }


def error_ratio(error: float, undisturbed: float) -> float:
    """Ratio of an error to the undisturbed one: 1 if both are zero, NaN if one is NaN."""
    if undisturbed == 0.0:
        return 1.0 if error == 0.0 else float("nan") if np.isnan(error) else float("inf")
    return error / undisturbed


def _mean_over(values: Floats, rows: Bools) -> float:
    return float(np.mean(values[rows])) if rows.any() else float("nan")


def _back_after_s(since_s: Floats, after: Bools, disturbed_deg: Floats, undisturbed_deg: Floats) -> float | None:
    rows = np.flatnonzero(after)
    width = max(round(_SMOOTHING_S / float(np.median(np.diff(since_s[rows])))), 1) if len(rows) > 1 else 1
    starts = rows[: max(len(rows) - width + 1, 0)]
    good = [
        np.mean(disturbed_deg[i : i + width]) <= MAX_RECOVERED_RATIO * np.mean(undisturbed_deg[i : i + width])
        for i in starts
    ]
    first = len(good) - next((n for n, fine in enumerate(reversed(good)) if not fine), len(good))
    return float(since_s[starts[first]]) if first < len(good) else None


def _status_is_correct(time_s: Floats, reporting: Bools, status: Ints) -> Bools:
    """(F,) whether the status agrees with the readings; close to 0.5 s without readings both HELD and LOST do."""
    enough_s = np.where(reporting, time_s, -np.inf)
    enough_s[0] = time_s[0]
    gone_s = time_s - np.maximum.accumulate(enough_s)
    lost = (status == Status.LOST) & (gone_s > LOST_AFTER_S - _STATUS_TOLERANCE_S)
    held = (status == Status.HELD) & (gone_s < LOST_AFTER_S + _STATUS_TOLERANCE_S)
    out: Bools = np.where(reporting, status == Status.SOLVED, lost | held)
    return out


def tabulate_recovery(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Pool the recovery rows of `summary.json` over clips: one record for each method, inputs and split.

    A record has `clips`, `undisturbed_deg`, `status_right` (the lowest) and `after`. The latter maps a disturbance to
    `ratio` (of the means over clips), `worst` (ratio of a single clip), `during` (ratio during the disturbance, mean
    over clips) and `back_after_s` of the slowest clip (None: one never recovers). Clips that end too soon are left
    out; a disturbance is None if all do.
    """
    groups: dict[tuple[str, ...], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["method"], row["inputs"], row["split"]), []).append(row)
    found = []
    for (method, inputs, split), group in groups.items():
        after: dict[str, Any] = dict.fromkeys(row["disturbance"] for row in group)
        known = [row for row in group if row["evaluated_frames"]]
        for kind in dict.fromkeys(row["disturbance"] for row in known):
            those = [row for row in known if row["disturbance"] == kind]
            means = [_mean(those, name) for name in ("disturbed_deg", "undisturbed_deg")]
            slowest = [row["back_after_s"] for row in those]
            after[kind] = {
                "ratio": error_ratio(*means),
                "during": _mean(those, "during"),
                "worst": float(np.max([_number(row["ratio"]) for row in those])),
                "back_after_s": None if None in slowest else max(slowest),
            }
        pooled = {
            "clips": len({row["clip"] for row in known}),
            "undisturbed_deg": _mean(known, "undisturbed_deg") if known else None,
            "status_right": min((row["status_right"] for row in known), default=None),
        }
        found.append({"method": method, "inputs": inputs, "split": split, **pooled, "after": after})
    return found


def _mean(rows: Sequence[Mapping[str, Any]], name: str) -> float:
    return float(np.mean([_number(row[name]) for row in rows]))


def _number(value: float | None) -> float:
    """The number, NaN for the null that stands for it in JSON."""
    return float("nan") if value is None else value
