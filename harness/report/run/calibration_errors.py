"""What calibration found against the truth, for the terminal and for the page; nothing when all was known."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.report.kit.markup import Markup, join, table, tag
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
    "what it found against the truth: mounts, root mean square over stations; bone lengths, likewise over bones; the "
    "room's frame, its turn about the vertical and its origin"
)
_STATISTIC_NOTE = "mean over clips (worst clip)"
_POSITION_NOTE = (
    "Nothing is aligned, so positions have the room's error in them: 17 mm for each degree of heading and metre from "
    "where the performer stood model; mpjpe_pa_mm has not."
)


def table_rows(cells: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """The table's cells, head first; empty when every calibration was exact."""
    if not any(cell["calibration_errors"] for cell in cells):
        return []
    sessions: dict[tuple[str, str], dict[str, Mapping[str, float]]] = {}
    for cell in cells:  # methods and inputs share a session
        named = str(cell["calibration"]), varied_text(cell["varied"])
        sessions.setdefault(named, {})[str(cell["clip"])] = cell["calibration_errors"]
    several = len({varied for _, varied in sessions}) > len({kind for kind, _ in sessions})
    found = [["calibration", *(["varied"] if several else []), "clips", *(title for title, *_ in _COLUMNS)]]
    for (kind, varied), by_clip in sessions.items():
        errors = [_format_error(kind, name, decimals, list(by_clip.values())) for _, name, decimals in _COLUMNS]
        found.append([kind, *([varied] if several else []), str(len(by_clip)), *errors])
    return found


def text(summary: Mapping[str, Any]) -> list[str]:
    """Lines for the terminal."""
    found = table_rows(summary.get("cells", []))
    if not found:
        return []
    return [f"calibration: {_CAPTION}; {_STATISTIC_NOTE}", _POSITION_NOTE, "", *align_left(found), ""]


def align_left(found: Sequence[Sequence[str]]) -> list[str]:
    """Lines of a table in columns, all to the left."""
    widths = [max(len(line[i]) for line in found) for i in range(len(found[0]))]
    return ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)).rstrip() for line in found]


def section(cells: Sequence[Mapping[str, Any]]) -> Markup:
    """The same for the page."""
    found = table_rows(cells)
    if not found:
        return Markup()
    head, *rows = found
    return table(
        join(tag("b", "Calibration"), f": {_CAPTION}; {_STATISTIC_NOTE}. {_POSITION_NOTE}"),
        head,
        rows,
        label="calibration",
    )


def _format_error(kind: str, name: str, decimals: int, sessions: Sequence[Mapping[str, float]]) -> str:
    values = [errors[name] for errors in sessions if name in errors]
    if not values or (name == "length_mm" and kind == "tpose"):
        return "known"
    return f"{np.mean(values):.{decimals}f} ({max(values):.{decimals}f})"
