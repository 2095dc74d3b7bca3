"""Calibrations of a run: their errors against the truth, and how much they increase each method's error."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.compare import PairedDifference, Sampling, average_units, compare_paired
from harness.core.number_format import NOT_MEASURED, Interval, format_fixed
from harness.report.kit.page import DataTable
from harness.results import setting_text, varied_text

_ERRORS = (
    ("mounts [mm]", "mount_mm", 1),
    ("mounts [deg]", "mount_deg", 2),
    ("bone lengths [mm]", "length_mm", 1),
    ("room heading [deg]", "room_heading_deg", 2),
    ("room origin [mm]", "room_origin_mm", 0),
)
"""Title, error (see `Cell.calibration_errors`) and decimals."""
_CAPTION = (
    "errors against the truth. Mounts: root mean square over stations; bone lengths: root mean square over bones; "
    "room: its heading about the vertical and its origin. known: the truth is used. none: the equation has none. Mean "
    "over clips (worst clip). Nothing is aligned, so position errors contain the room's error: 17 mm for each degree "
    "of heading and metre of distance from where the performer stood model. mpjpe_pa_mm does not contain it."
)
_EXACT = "exact"
_COST_METRICS = (("joint angle [deg]", "joint_angle_mean_deg", 2), ("mpjpe_pa [mm]", "mpjpe_pa_mm", 1))
"""Title, metric and decimals; positions are Procrustes-aligned, which leaves out the error of the room."""
_COST_CAPTION = (
    "error with exact calibration, then for each other calibration the mean increase over units and its paired 95 % "
    "interval (docs/studies.md)."
)


def calibration_tables(summary: Mapping[str, Any]) -> list[DataTable]:
    """The errors of each kind of calibration, and what they cost; no rows where every calibration was exact."""
    cells = summary.get("cells", [])
    return [calibration_errors(cells), calibration_cost(cells, Sampling.of_summary(summary))]


def calibration_errors(cells: Sequence[Mapping[str, Any]]) -> DataTable:
    """A row for each kind of calibration; none when every calibration was exact."""
    sessions: dict[tuple[str, str], dict[str, Mapping[str, float]]] = {}
    for cell in cells if any(cell["calibration_errors"] for cell in cells) else ():
        key = str(cell["calibration"]), setting_text(cell)  # methods and inputs share a session
        sessions.setdefault(key, {})[str(cell["clip"])] = cell["calibration_errors"]
    several = len({varied for _, varied in sessions}) > len({kind for kind, _ in sessions})
    rows = [
        [
            kind,
            varied if several else "",
            str(len(by_clip)),
            *(_format_error(kind, name, decimals, list(by_clip.values())) for _, name, decimals in _ERRORS),
        ]
        for (kind, varied), by_clip in sessions.items()
    ]
    head = ["calibration", "varied", "clips", *(title for title, *_ in _ERRORS)]
    return DataTable(head, rows, "Calibration:", _CAPTION, label="calibration", caption_printed=True)


def calibration_cost(cells: Sequence[Mapping[str, Any]], sampling: Sampling) -> DataTable:
    """A row for each method and metric; none unless both exact and other calibrations were measured."""
    groups: dict[tuple[str, ...], dict[str, list[Mapping[str, Any]]]] = {}
    for cell in cells:
        others = {key: value for key, value in cell["varied"].items() if key != "calibration"}
        setting = (cell["behaviour"], cell["performer"], cell["inputs"], varied_text(others), cell["method"])
        by_kind = groups.setdefault(tuple(map(str, setting)), {})
        by_kind.setdefault(str(cell["calibration"]), []).append(cell)
    kinds = list(dict.fromkeys(kind for group in groups.values() for kind in group))
    rest = [kind for kind in kinds if kind != _EXACT]
    shown = [i for i in range(5) if i in (0, 4) or len({setting[i] for setting in groups}) > 1]
    titles = ("behaviour", "performer", "inputs", "varied", "method")
    rows = []
    for names, group in groups.items() if _EXACT in kinds and rest else ():
        for title, metric, decimals in _COST_METRICS:
            by_clip = {kind: {str(cell["clip"]): cell[metric] for cell in group.get(kind, [])} for kind in group}
            exact = by_clip.get(_EXACT, {})
            errors = average_units({clip: error for clip, error in exact.items() if error is not None}, sampling)
            mean = format_fixed(float(np.mean(list(errors.values()))) if errors else None, decimals)
            costs = [_format_cost(compare_paired(by_clip.get(kind, {}), exact, sampling)) for kind in rest]
            rows.append([*(names[i] for i in shown), title, mean, *costs])
    head = [*(titles[i] for i in shown), "error", _EXACT, *rest]
    return DataTable(head, rows, "Cost of calibration:", _COST_CAPTION, "calibration cost", caption_printed=True)


def _format_error(kind: str, name: str, decimals: int, sessions: Sequence[Mapping[str, float]]) -> str:
    values = [errors[name] for errors in sessions if name in errors]
    if kind == _EXACT or (name == "length_mm" and kind in ("tpose", "kim2012")):
        return "known"
    if not values:
        return "none"
    return f"{format_fixed(float(np.mean(values)), decimals)} ({format_fixed(max(values), decimals)})"


def _format_cost(increase: PairedDifference) -> str:
    if increase.mean is None:
        return NOT_MEASURED
    number = Interval.of(increase.mean, increase.low, increase.high, signed=True)
    return str(number) if increase.low is not None else f"{number} ({increase.why})"
