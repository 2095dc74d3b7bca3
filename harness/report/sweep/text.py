"""A sweep on a terminal: how far it came and what it found, methods by scenario, what each key does, what failed."""

from harness.report.run.tables import format_number
from harness.report.run.text import align_columns
from harness.report.sweep.data import PRIMARY_METRIC, SECONDARY_METRIC, Statistic, SweepData, unit_of
from harness.report.sweep.wording import describe_effect, group_failures, sentence

_MOST_ROWS, _MOST_FAILURES = 60, 8


def text(sweep: SweepData) -> str:
    """Lines for the terminal, of which there are no more for more cells."""
    lines = [sentence(sweep), *_table(sweep)]
    if sweep.keys:
        pairs = [[key.name, describe_effect(sweep, key)] for key in sweep.keys]
        lines += ["", *align_columns([["varied", f"mean {PRIMARY_METRIC}, least and most"], *pairs], text_columns=2)]
    found = group_failures(sweep)
    lines += [""] if found else []
    for fault in found[:_MOST_FAILURES]:
        lines.append(f"FAILED {len(fault.cells):,}, such as {fault.cells[0]}: {fault.message}")
    if (more := len(found) - _MOST_FAILURES) > 0:
        lines.append(f"and {more:,} more kinds of failure, in summary.json")
    return "\n".join(lines)


def _table(sweep: SweepData) -> list[str]:
    """A row for each scenario and series that has cells."""
    rows = []
    for s, scenario in enumerate(sweep.scenarios):
        for n, series in enumerate(sweep.series):
            chosen = sweep.select(s, n)
            if chosen.any():
                figures = [sweep.statistic(metric, chosen) for metric in (PRIMARY_METRIC, SECONDARY_METRIC)]
                clips = str(max(one.clips for one in figures))
                shown = map(_format_statistic, (PRIMARY_METRIC, SECONDARY_METRIC), figures)
                rows.append([scenario, series, f"{int(chosen.sum()):,}", clips, *shown])
    if not rows:
        return []
    head = ["scenario", "method", "cells", "clips", "joint angle [deg]", "position [mm]"]
    lines = ["", *align_columns([head, *rows[:_MOST_ROWS]], text_columns=2)]
    more = len(rows) - _MOST_ROWS
    return [*lines, f"and {more:,} more rows, in report.html"] if more > 0 else lines


def _format_statistic(metric: str, found: Statistic) -> str:
    if found.mean is None:
        return "not measured"
    spread = "" if found.sd is None else f" ± {format_number(found.sd, unit_of(metric))}"
    return f"{format_number(found.mean, unit_of(metric))}{spread}"
