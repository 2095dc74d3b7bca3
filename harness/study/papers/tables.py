"""Rows and cells of runs as errors by clip, tables and figures."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.results.cell import Cell
from harness.results.expected_orders import METRIC
from harness.results.findings import BarChart, FindingsTable, LineChart
from harness.results.summary import GROUP_KEYS

CellRow = Mapping[str, Any]
HINGE_GROUPS = {
    "trunk": ("lowerback", "upperback", "thorax"),
    "head and neck": ("lowerneck", "upperneck", "head"),
    "shoulders and upper arms": ("lclavicle", "lhumerus", "rclavicle", "rhumerus"),
    "forearms and hands": ("lradius", "lwrist", "lhand", "rradius", "rwrist", "rhand"),
    "legs": ("lfemur", "ltibia", "rfemur", "rtibia"),
    "feet": ("lfoot", "rfoot"),
}
"""The 48 hinges by the bones they turn."""


def errors_by_clip(rows: Iterable[CellRow], metric: str = METRIC) -> dict[str, float]:
    """Clip -> error, of rows that differ in nothing but the clip; what was not measured is left out.

    BadInput for rows of which two are of one clip, or that are never pooled (see `summary.GROUP`).
    """
    found: dict[str, float] = {}
    kinds: dict[str, Any] = {}
    for row in rows:
        for name in (*GROUP_KEYS, "behaviour"):
            if kinds.setdefault(name, row[name]) != row[name]:
                raise BadInput(f"Errors of {name} {kinds[name]!r} and {row[name]!r} are not pooled.", "Ask for one.")
        if row["clip"] in found:
            raise BadInput(f"Two errors on {row['clip']} are not pooled.", "Ask for one of what varies.")
        if row[metric] is not None:
            found[row["clip"]] = float(row[metric])
    return found


def mean_sd(errors: Mapping[str, float]) -> tuple[float | None, float | None]:
    """Over clips; None of none, and no deviation of one."""
    values = np.array(list(errors.values()))
    return float(values.mean()) if len(values) else None, float(values.std(ddof=1)) if len(values) > 1 else None


def format_mean(errors: Mapping[str, float], decimals: int = 2) -> str:
    """ "1.23 ± 0.45 (8)": mean, standard deviation over clips, how many."""
    mean, sd = mean_sd(errors)
    if mean is None:
        return "not measured"
    spread = "" if sd is None else f" ± {sd:.{decimals}f}"
    return f"{mean:.{decimals}f}{spread} ({len(errors)})"


def mean_table(title: str, what: str, groups: Mapping[str, Mapping[str, Mapping[str, float]]]) -> FindingsTable:
    """Group -> column -> errors by clip, as a row for each group; `what` names the first column."""
    columns = list(dict.fromkeys(column for each in groups.values() for column in each))
    rows = [(group, *(format_mean(each.get(column, {})) for column in columns)) for group, each in groups.items()]
    return FindingsTable(f"{title}: mean ± sd over clips (clips)", (what, *columns), tuple(rows))


def mean_bars(
    title: str,
    unit: str,
    groups: Mapping[str, Mapping[str, Mapping[str, float]]],
    *,
    caption: str = "",
    horizontal: bool = False,
    published: Mapping[str, tuple[float | None, ...]] | None = None,
) -> BarChart:
    """The same as bars: a group for each, a series for each column, standard deviations over clips as spread."""
    columns = list(dict.fromkeys(column for each in groups.values() for column in each))
    figures = {column: [mean_sd(each.get(column, {})) for each in groups.values()] for column in columns}
    return BarChart(
        title,
        unit,
        tuple(groups),
        {column: tuple(mean for mean, _ in each) for column, each in figures.items()},
        spread={column: tuple(sd for _, sd in each) for column, each in figures.items()},
        published=dict(published or {}),
        caption=caption,
        horizontal=horizontal,
    )


def error_lines(title: str, cells: Mapping[str, Cell], metric: str = METRIC, caption: str = "") -> LineChart:
    """Series -> cell of one and the same clip, as error over time; frames that one has and another has not are gaps."""
    every = sorted({int(k) for cell in cells.values() for k in cell.frame_index[cell.scores.scored]})
    place = {k: i for i, k in enumerate(every)}
    series, time_s = {}, np.full(len(every), np.nan)
    for name, cell in cells.items():
        values: Floats = np.full(len(every), np.nan)
        at = [place[int(k)] for k in cell.frame_index[cell.scores.scored]]
        values[at] = cell.errors[metric][cell.scores.scored]
        time_s[at] = cell.time_s[cell.scores.scored]
        series[name] = tuple(float(v) if np.isfinite(v) else None for v in values)
    return LineChart(
        title, "time [s]", "mean joint-angle error [deg]", tuple(map(float, time_s)), series, caption=caption
    )


def errors_by_joint_group(
    cells: Iterable[Cell], groups: Mapping[str, Sequence[str]] = HINGE_GROUPS
) -> dict[str, dict[str, float]]:
    """Group of hinges -> clip -> mean error [deg], of cells that differ in nothing but the clip."""
    found: dict[str, dict[str, float]] = {name: {} for name in groups}
    for cell in cells:
        errors = cell.scores.per_joint.get(METRIC, {})
        for group, bones in groups.items():
            values = [error for hinge, error in errors.items() if hinge.partition(".")[0] in bones]
            if values:
                found[group][cell.clip] = float(np.mean(values))
    return found
