"""A sweep as text for the terminal: progress and best method, methods by scenario, effect of keys, failures."""

from harness.core.number_format import NOT_MEASURED, format_number
from harness.core.text_table import Table
from harness.report.sweep.data import Statistic, SweepData, unit_of
from harness.report.sweep.wording import describe_effect, group_failures, sentence
from harness.results.reported_metrics import PRIMARY_METRIC, SECONDARY_METRIC

_MOST_ROWS, _MOST_FAILURES = 60, 8


def text(sweep: SweepData) -> str:
    """The text of a sweep; its length is limited however many cells there are."""
    lines = [sentence(sweep), *_table(sweep)]
    if sweep.keys:
        pairs = [[key.name, describe_effect(sweep, key)] for key in sweep.keys]
        lines += ["", *Table(["varied", f"lowest and highest mean {PRIMARY_METRIC}"], pairs, text_columns=2).lines()]
    groups = group_failures(sweep)
    lines += [""] if groups else []
    for group in groups[:_MOST_FAILURES]:
        lines.append(f"FAILED {len(group.cells):,}, such as {group.cells[0]}: {group.message}")
    if (more := len(groups) - _MOST_FAILURES) > 0:
        lines.append(f"and {more:,} more kinds of failure, in summary.json")
    return "\n".join(lines)


def _table(sweep: SweepData) -> list[str]:
    """A row for each scenario and series that has cells."""
    rows = []
    for s, scenario in enumerate(sweep.scenarios):
        for n, series in enumerate(sweep.series):
            selected = sweep.select(s, n)
            if selected.any():
                statistics = [sweep.statistic(metric, selected) for metric in (PRIMARY_METRIC, SECONDARY_METRIC)]
                clips = str(max(statistic.clips for statistic in statistics))
                means = map(_format_statistic, (PRIMARY_METRIC, SECONDARY_METRIC), statistics)
                rows.append([scenario, series, f"{int(selected.sum()):,}", clips, *means])
    if not rows:
        return []
    head = ["scenario", "method", "cells", "clips", "joint angle [deg]", "position [mm]"]
    lines = ["", *Table(head, rows[:_MOST_ROWS], text_columns=2).lines()]
    more = len(rows) - _MOST_ROWS
    return [*lines, f"and {more:,} more rows, in report.html"] if more > 0 else lines


def _format_statistic(metric: str, statistic: Statistic) -> str:
    if statistic.mean is None:
        return NOT_MEASURED
    spread = "" if statistic.sd is None else f" ± {format_number(statistic.sd, unit_of(metric))}"
    return f"{format_number(statistic.mean, unit_of(metric))}{spread}"
