"""Errors of the calibration against the truth, for the terminal and the page; nothing when every one was exact."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.core.number_format import format_fixed
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.table import html_table
from harness.results.cell import varied_text

_COLUMNS = (
    ("mounts [mm]", "mount_mm", 1),
    ("mounts [deg]", "mount_deg", 2),
    ("bone lengths [mm]", "length_mm", 1),
    ("room heading [deg]", "room_heading_deg", 2),
    ("room origin [mm]", "room_origin_mm", 0),
)
"""Title, error (see `Cell.calibration_errors`) and decimals."""
_CAPTION = (
    "errors against the truth. Mounts: root mean square over stations; bone lengths: root mean square over bones; "
    "room: its heading about the vertical and its origin. known: the truth is used. none: the equation has none"
)
_STATISTIC_NOTE = "Mean over clips (worst clip)"
_POSITION_NOTE = (
    "Nothing is aligned, so position errors contain the room's error: 17 mm for each degree of heading and metre of "
    "distance from where the performer stood model. mpjpe_pa_mm does not contain it."
)


def calibration_table(cells: Sequence[Mapping[str, Any]]) -> Table | None:
    """A row for each kind of calibration; None when every calibration was exact."""
    if not any(cell["calibration_errors"] for cell in cells):
        return None
    sessions: dict[tuple[str, str], dict[str, Mapping[str, float]]] = {}
    for cell in cells:  # methods and inputs share a calibration session
        key = str(cell["calibration"]), varied_text(cell["varied"])
        sessions.setdefault(key, {})[str(cell["clip"])] = cell["calibration_errors"]
    several = len({varied for _, varied in sessions}) > len({kind for kind, _ in sessions})
    head = ["calibration", *(["varied"] if several else []), "clips", *(title for title, *_ in _COLUMNS)]
    rows = []
    for (kind, varied), by_clip in sessions.items():
        errors = [_format_error(kind, name, decimals, list(by_clip.values())) for _, name, decimals in _COLUMNS]
        rows.append([kind, *([varied] if several else []), str(len(by_clip)), *errors])
    return Table(head, rows, text_columns=len(head))


def text(summary: Mapping[str, Any]) -> list[str]:
    """The table as lines for the terminal."""
    table = calibration_table(summary.get("cells", []))
    if table is None:
        return []
    return [f"calibration: {_CAPTION}. {_STATISTIC_NOTE}", _POSITION_NOTE, "", *table.lines(), ""]


def section(cells: Sequence[Mapping[str, Any]]) -> Markup:
    """The table for the page."""
    table = calibration_table(cells)
    caption = join(tag("b", "Calibration"), f": {_CAPTION}. {_STATISTIC_NOTE}. {_POSITION_NOTE}")
    return html_table(table, caption, label="calibration") if table else Markup()


def _format_error(kind: str, name: str, decimals: int, sessions: Sequence[Mapping[str, float]]) -> str:
    values = [errors[name] for errors in sessions if name in errors]
    if kind == "exact" or (name == "length_mm" and kind in ("tpose", "kim2012")):
        return "known"
    if not values:
        return "none"
    return f"{format_fixed(float(np.mean(values)), decimals)} ({format_fixed(max(values), decimals)})"
