"""Conversion of rows and cells of runs to errors by unit, tables and figures."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from harness.compare.run_summary import GROUP_KEYS
from harness.core.arrays import Floats
from harness.core.number_format import count_noun, format_fixed, format_mean_sd
from harness.errors import BadInput
from harness.results import PRIMARY_METRIC, Cell
from harness.results.findings import BarChart, FindingsTable, LineChart

SummaryRow = Mapping[str, Any]
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


class UnitErrors(dict[str, float]):
    """Unit of statistics -> mean error of its clips."""

    rms: dict[str, float] | None = None
    """Unit -> root mean square beside it, of joint angles; None for other errors."""


def errors_by_unit(rows: Iterable[SummaryRow], metric: str = PRIMARY_METRIC) -> UnitErrors:
    """Errors of rows that differ only in the clip (see `PaperStudy.rows`).

    A unit of which a clip was not measured is left out, so that means of one unit can be paired. BadInput for two rows
    of one clip, and for rows that must not be pooled (see `compare.run_summary.run_statistics.GROUP_KEYS`).
    """
    of_clip: dict[str, SummaryRow] = {}
    kinds: dict[str, Any] = {}
    for row in rows:
        for name in (*GROUP_KEYS, "behaviour"):
            if kinds.setdefault(name, row[name]) != row[name]:
                raise BadInput(
                    f"Errors of {name} {kinds[name]!r} and {row[name]!r} cannot be pooled.", "Select one of them."
                )
        if row["clip"] in of_clip:
            raise BadInput(f"Two errors on {row['clip']} cannot be pooled.", "Select one value of what varies.")
        of_clip[row["clip"]] = row
    errors = UnitErrors(_average((row, row[metric]) for row in of_clip.values()))
    if metric == PRIMARY_METRIC:
        errors.rms = _average((row, row.get(RMS)) for row in of_clip.values())
    return errors


def _average(values: Iterable[tuple[SummaryRow, float | None]]) -> dict[str, float]:
    """Unit -> mean of the values of its clips, of units all of whose clips have one."""
    of_unit: dict[tuple[str, int], list[float]] = {}
    for row, value in values:
        if value is not None:
            of_unit.setdefault((row["unit"], row["unit_clips"]), []).append(value)
    return {unit: float(np.mean(each)) for (unit, planned), each in of_unit.items() if len(each) == planned}


def mean_sd(errors: Mapping[str, float]) -> tuple[float | None, float | None]:
    """Mean and standard deviation over units; None without units, and no deviation for one unit."""
    values = np.array(list(errors.values()))
    return float(values.mean()) if len(values) else None, float(values.std(ddof=1)) if len(values) > 1 else None


def format_mean(errors: Mapping[str, float], decimals: int = 2) -> str:
    """Format mean, standard deviation over units and number of units, such as "1.23 ± 0.45 (8)".

    Where the errors have root mean squares, their mean over units follows: "1.23 ± 0.45, RMS 1.98 (8)".
    """
    mean, sd = mean_sd(errors)
    rms = errors.rms if isinstance(errors, UnitErrors) else None
    if mean is None:
        return "not measured"
    root = f", RMS {format_fixed(mean_sd(rms)[0], decimals)}" if rms else ""
    return f"{format_mean_sd(mean, sd, decimals)}{root} ({len(errors)})"


ErrorGroups = Mapping[str, Mapping[str, Mapping[str, float]]]
"""Group -> column -> error by unit."""


def mean_table(title: str, first_column: str, groups: ErrorGroups) -> FindingsTable:
    """Table of groups by columns, with a row for each group."""
    columns = list(dict.fromkeys(column for each in groups.values() for column in each))
    rows = [(group, *(format_mean(each.get(column, {})) for column in columns)) for group, each in groups.items()]
    cells = (errors for each in groups.values() for errors in each.values())
    has_rms = any(isinstance(errors, UnitErrors) and errors.rms is not None for errors in cells)
    shown = "mean ± sd, RMS" if has_rms else "mean ± sd"
    return FindingsTable(f"{title}: {shown} over units (units)", (first_column, *columns), tuple(rows))


def number_of_units(sides: Iterable[Mapping[str, float]]) -> str:
    """A sentence on the numbers of units with an error, such as "12 units." or "5 to 13 units."; "" without any."""
    counts = sorted({len(errors) for errors in sides} - {0})
    several = f"{counts[0]} to " if len(counts) > 1 else ""
    return f"{several}{count_noun(counts[-1], 'unit')}." if counts else ""


def mean_bars(
    title: str,
    unit: str,
    groups: Mapping[str, Mapping[str, Mapping[str, float]]],
    *,
    caption: str = "",
    published: Mapping[str, tuple[float | None, ...]] | None = None,
) -> BarChart:
    """Bar chart of group -> column -> errors by unit.

    A column is a series, the spread a standard deviation over units.
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
        caption=f"{caption} {number_of_units(errors for each in groups.values() for errors in each.values())}".strip(),
    )


def error_lines(title: str, cells: Mapping[str, Cell], metric: str = PRIMARY_METRIC, caption: str = "") -> LineChart:
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
    cells: Iterable[tuple[SummaryRow, Cell]],
    groups: Mapping[str, Sequence[str]] = HINGE_GROUPS,
) -> dict[str, UnitErrors]:
    """Group of hinges -> errors [deg], of cells that differ only in the clip (see `errors_by_unit`).

    They are means over the hinges of the group, and roots of the mean squares.
    """
    by_group: dict[tuple[str, str], list[tuple[SummaryRow, float]]] = {}
    for row, cell in cells:
        for metric, (group, bones) in product((PRIMARY_METRIC, RMS), groups.items()):
            errors = cell.scores.per_joint.get(metric, {})
            values = np.array([error for hinge, error in errors.items() if hinge.partition(".")[0] in bones])
            if len(values):
                mean = np.sqrt(np.mean(values**2)) if metric == RMS else np.mean(values)
                by_group.setdefault((group, metric), []).append((row, float(mean)))
    found = {group: UnitErrors(_average(by_group.get((group, PRIMARY_METRIC), []))) for group in groups}
    for group, errors in found.items():
        errors.rms = _average(by_group.get((group, RMS), []))
    return found
