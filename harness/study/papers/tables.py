"""Conversion of rows and cells of runs to errors by clip, tables and figures."""

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
RMS = "joint_angle_rms_deg"
"""The root mean square of the hinge errors, which stands beside their mean."""
HINGE_GROUPS = {
    "trunk": ("lowerback", "upperback", "thorax"),
    "head and neck": ("lowerneck", "upperneck", "head"),
    "shoulders and upper arms": ("lclavicle", "lhumerus", "rclavicle", "rhumerus"),
    "forearms and hands": ("lradius", "lwrist", "lhand", "rradius", "rwrist", "rhand"),
    "legs": ("lfemur", "ltibia", "rfemur", "rtibia"),
    "feet": ("lfoot", "rfoot"),
}
"""Group -> bones; together they have the 48 hinges."""


def errors_by_clip(rows: Iterable[CellRow], metric: str = METRIC) -> dict[str, float]:
    """Clip -> error, of rows that differ only in the clip; clips without a measurement are left out.

    BadInput for two rows of one clip, and for rows that must not be pooled (see `summary.GROUP_KEYS`).
    """
    errors: dict[str, float] = {}
    kinds: dict[str, Any] = {}
    for row in rows:
        for name in (*GROUP_KEYS, "behaviour"):
            if kinds.setdefault(name, row[name]) != row[name]:
                raise BadInput(
                    f"Errors of {name} {kinds[name]!r} and {row[name]!r} cannot be pooled.", "Select one of them."
                )
        if row["clip"] in errors:
            raise BadInput(f"Two errors on {row['clip']} cannot be pooled.", "Select one value of what varies.")
        if row[metric] is not None:
            errors[row["clip"]] = float(row[metric])
    return errors


def mean_sd(errors: Mapping[str, float]) -> tuple[float | None, float | None]:
    """Mean and standard deviation over clips; None without clips, and no deviation for one clip."""
    values = np.array(list(errors.values()))
    return float(values.mean()) if len(values) else None, float(values.std(ddof=1)) if len(values) > 1 else None


def format_mean(errors: Mapping[str, float], decimals: int = 2, rms: Mapping[str, float] | None = None) -> str:
    """Format mean, standard deviation over clips and number of clips, such as "1.23 ± 0.45 (8)".

    With `rms` (clip -> root mean square error) its mean over clips follows: "1.23 ± 0.45, RMS 1.98 (8)".
    """
    mean, sd = mean_sd(errors)
    if mean is None:
        return "not measured"
    spread = "" if sd is None else f" ± {sd:.{decimals}f}"
    root = f", RMS {mean_sd(rms)[0]:.{decimals}f}" if rms else ""
    return f"{mean:.{decimals}f}{spread}{root} ({len(errors)})"


ErrorGroups = Mapping[str, Mapping[str, Mapping[str, float]]]
"""Group -> column -> error by clip."""


def mean_table(title: str, first_column: str, groups: ErrorGroups, rms: ErrorGroups | None = None) -> FindingsTable:
    """Table of groups by columns, with a row for each group; `rms` has the root mean square errors."""
    columns = list(dict.fromkeys(column for each in groups.values() for column in each))
    roots: ErrorGroups = rms or {}
    rows = [
        (
            group,
            *(format_mean(each.get(column, {}), rms=roots.get(group, {}).get(column)) for column in columns),
        )
        for group, each in groups.items()
    ]
    shown = "mean ± sd, RMS" if rms else "mean ± sd"
    return FindingsTable(f"{title}: {shown} over clips (clips)", (first_column, *columns), tuple(rows))


def mean_bars(
    title: str,
    unit: str,
    groups: Mapping[str, Mapping[str, Mapping[str, float]]],
    *,
    caption: str = "",
    horizontal: bool = False,
    published: Mapping[str, tuple[float | None, ...]] | None = None,
) -> BarChart:
    """Bar chart of group -> column -> errors by clip.

    A column is a series, the spread a standard deviation over clips.
    """
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
    """Line chart of errors over time; `cells` maps series to cells of one clip. Frames that a series lacks are gaps."""
    frames = sorted({int(k) for cell in cells.values() for k in cell.frame_index[cell.scores.scored]})
    position = {k: i for i, k in enumerate(frames)}
    series, time_s = {}, np.full(len(frames), np.nan)
    for name, cell in cells.items():
        values: Floats = np.full(len(frames), np.nan)
        at = [position[int(k)] for k in cell.frame_index[cell.scores.scored]]
        values[at] = cell.errors[metric][cell.scores.scored]
        time_s[at] = cell.time_s[cell.scores.scored]
        series[name] = tuple(float(v) if np.isfinite(v) else None for v in values)
    return LineChart(
        title, "time [s]", "mean joint-angle error [deg]", tuple(map(float, time_s)), series, caption=caption
    )


def errors_by_joint_group(
    cells: Iterable[Cell], groups: Mapping[str, Sequence[str]] = HINGE_GROUPS, metric: str = METRIC
) -> dict[str, dict[str, float]]:
    """Group of hinges -> clip -> error [deg], of cells that differ only in the clip.

    It is the mean over the hinges of the group; for the metric `RMS`, the root of the mean square.
    """
    by_group: dict[str, dict[str, float]] = {name: {} for name in groups}
    for cell in cells:
        errors = cell.scores.per_joint.get(metric, {})
        for group, bones in groups.items():
            values = np.array([error for hinge, error in errors.items() if hinge.partition(".")[0] in bones])
            if len(values):
                mean = np.sqrt(np.mean(values**2)) if metric == RMS else np.mean(values)
                by_group[group][cell.clip] = float(mean)
    return by_group
