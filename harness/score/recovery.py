"""How soon an error is itself again after a disturbance: cells that were disturbed against those that were not.

A scenario asks for it by varying its disturbance, for example

    [disturbance]
    station = "right_hand"
    from_s = 3.0
    [vary]
    "disturbance.kind" = ["none", "one_lost", "all_lost", "one_off", "all_turned", "start_off"]

Both cells of a pair see the same motion and the same draws of noise (`core.seeds`). The measure is the mean error of
joint angles over the second that begins 1 s after the last bad frame, divided by that of the undisturbed cell over
the same frames; up to 1.5 counts as recovered. `harness run` prints it below its table, `summary.json` lists it.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.estimate import Status
from harness.score.cell import Cell
from harness.score.files import plain

AT_MOST = 1.5
"""Times the undisturbed error."""
AFTER_S, OVER_S = 1.0, 1.0
"""The error is taken from so long after the last bad frame, over so long [s]."""
LOST_AFTER_S = 0.5
"""Under half of the stations for longer than this is LOST, before that HELD [s]."""
_SMOOTHED_S = 0.25
_CLOSE_S = 0.05


@dataclass(frozen=True)
class Recovery:
    """One disturbed cell beside its undisturbed one."""

    method: str
    inputs: str
    protocol: str
    behaviour: str
    clip: str
    disturbance: str
    disturbed_deg: float
    """Mean joint angle error of the frames that are judged."""
    undisturbed_deg: float
    during: float
    """Times the undisturbed error while it lasted, from the first bad frame to the last."""
    disturbed_mm: float
    """Mean distance of the joint centres in the same frames."""
    undisturbed_mm: float
    back_after_s: float | None
    """From the last bad frame until the error, smoothed over 0.25 s, is at most 1.5 times the undisturbed one and stays
    so to the end of what is judged; None if it never is."""
    status_right: float
    """Share of frames, from the first bad one to the last judged one, whose status is what the readings call for."""

    @property
    def ratio(self) -> float:
        return self.disturbed_deg / self.undisturbed_deg


@dataclass(frozen=True, eq=False)
class _Course:
    """What is kept of a cell."""

    cell: Mapping[str, str]
    disturbance: Mapping[str, Any]
    time_s: Floats
    error_deg: Floats
    error_mm: Floats
    status: Ints
    reporting: Bools
    """(F,) at least half of the stations."""


class Recoveries:
    """Add cells in any order, then ask for the pairs among them."""

    def __init__(self) -> None:
        self._courses: dict[str, dict[str, _Course]] = {}

    def add(self, cell: Cell) -> None:
        """Keep it if its scenario knows disturbances."""
        if "disturbance" not in cell.defined_by:
            return
        disturbance = dict(cell.defined_by["disturbance"])
        same = {name: value for name, value in cell.defined_by.items() if name != "disturbance"}
        kind = disturbance["kind"]
        settings = {name: value for name, value in disturbance.items() if name not in ("kind", "begins_s", "ends_s")}
        names = ("method", "inputs", "protocol", "behaviour", "clip")
        pair = json.dumps(plain({"method": cell.method, "same": same, "settings": settings}), sort_keys=True)
        seen = (cell.position_valid | cell.orientation_valid).sum(axis=1)
        self._courses.setdefault(pair, {})[kind] = _Course(
            {name: str(getattr(cell, name)) for name in names},
            disturbance,
            cell.time_s,
            cell.errors["joint_angle_mean_deg"],
            cell.errors["mpjpe_mm"],
            cell.status,
            (2 * seen >= len(cell.stations)) & (seen > 0),
        )

    def pairs(self) -> list[Recovery]:
        """Every disturbed cell whose undisturbed twin is there and whose frames reach far enough."""
        found = []
        for courses in self._courses.values():
            if (plain_course := courses.get("none")) is not None:
                compared = (_compared(course, plain_course) for kind, course in courses.items() if kind != "none")
                found += [recovery for recovery in compared if recovery is not None]
        return found

    def rows(self) -> list[dict[str, Any]]:
        """For `summary.json`: the pairs, each with its ratio."""
        return [{**asdict(recovery), "ratio": recovery.ratio} for recovery in self.pairs()]


def _compared(course: _Course, undisturbed: _Course) -> Recovery | None:
    begin_s, end_s = float(course.disturbance["begins_s"]), float(course.disturbance["ends_s"])
    common, here, there = np.intersect1d(course.time_s, undisturbed.time_s, return_indices=True)
    bad = common[common < end_s - 1e-9]
    if not len(bad):
        return None
    since_s = common - bad[-1]
    judged = (since_s > AFTER_S) & (since_s <= AFTER_S + OVER_S + 1e-9)
    if since_s[-1] < AFTER_S + OVER_S - 1e-9:
        return None
    disturbed_deg, undisturbed_deg = course.error_deg[here], undisturbed.error_deg[there]
    during = (common >= begin_s - 1e-9) & (since_s <= 0.0)
    within = (common >= begin_s - 1e-9) & (since_s <= AFTER_S + OVER_S)
    right = _right(course.time_s, course.reporting, course.status)
    return Recovery(
        **course.cell,
        disturbance=str(course.disturbance["kind"]),
        disturbed_deg=float(np.mean(disturbed_deg[judged])),
        undisturbed_deg=float(np.mean(undisturbed_deg[judged])),
        during=float(np.mean(disturbed_deg[during]) / np.mean(undisturbed_deg[during])),
        disturbed_mm=float(np.mean(course.error_mm[here][judged])),
        undisturbed_mm=float(np.mean(undisturbed.error_mm[there][judged])),
        back_after_s=_back_after_s(since_s, disturbed_deg, undisturbed_deg),
        status_right=float(np.mean(right[here][within])),
    )


def _back_after_s(since_s: Floats, disturbed_deg: Floats, undisturbed_deg: Floats) -> float | None:
    after = np.flatnonzero((since_s > 0.0) & (since_s <= AFTER_S + OVER_S + 1e-9))
    width = max(round(_SMOOTHED_S / float(np.median(np.diff(since_s)))), 1)
    starts = after[: len(after) - width + 1]
    means = np.array([[x[i : i + width].mean() for i in starts] for x in (disturbed_deg, undisturbed_deg)])
    worse = np.flatnonzero(means[0] > AT_MOST * means[1])
    first = int(worse[-1]) + 1 if len(worse) else 0
    return float(since_s[starts[first]]) if first < len(starts) else None


def _right(time_s: Floats, reporting: Bools, status: Ints) -> Bools:
    """(F,) whether the status is what the readings call for; close to 0.5 s both HELD and LOST are."""
    enough_s = np.where(reporting, time_s, -np.inf)
    enough_s[0] = time_s[0]
    gone_s = time_s - np.maximum.accumulate(enough_s)
    lost = (status == Status.LOST) & (gone_s > LOST_AFTER_S - _CLOSE_S)
    held = (status == Status.HELD) & (gone_s < LOST_AFTER_S + _CLOSE_S)
    out: Bools = np.where(reporting, status == Status.SOLVED, lost | held)
    return out


def table(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Of `summary.json`'s rows: one for each method, inputs and protocol, clips pooled.

    Each has `clips`, `undisturbed_deg`, `status_right` (the least) and, under `after`, disturbance -> `ratio` of the
    means over clips, `worst` ratio of a single clip, how many times as large the error is `during` it (mean over
    clips), `back_after_s` of the slowest clip (None: one never was).
    """
    groups: dict[tuple[str, ...], list[Mapping[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["method"], row["inputs"], row["protocol"]), []).append(row)
    found = []
    for (method, inputs, protocol), group in groups.items():
        after = {}
        for kind in dict.fromkeys(row["disturbance"] for row in group):
            those = [row for row in group if row["disturbance"] == kind]
            means = [_mean(those, name) for name in ("disturbed_deg", "undisturbed_deg")]
            slowest = [row["back_after_s"] for row in those]
            after[kind] = {
                "ratio": means[0] / means[1],
                "during": _mean(those, "during"),
                "worst": float(np.max([_number(row["ratio"]) for row in those])),
                "back_after_s": None if None in slowest else max(slowest),
            }
        found.append(
            {
                "method": method,
                "inputs": inputs,
                "protocol": protocol,
                "clips": len({row["clip"] for row in group}),
                "undisturbed_deg": _mean(group, "undisturbed_deg"),
                "status_right": min(row["status_right"] for row in group),
                "after": after,
            }
        )
    return found


def _mean(rows: Sequence[Mapping[str, Any]], name: str) -> float:
    return float(np.mean([_number(row[name]) for row in rows]))


def _number(value: float | None) -> float:
    """JSON has no NaN: what was not finite comes back as null."""
    return float("nan") if value is None else value
