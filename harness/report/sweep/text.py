"""A sweep on a terminal: how far it came and what it found, methods by scenario, what each key does, what failed."""

from harness.report.run.tables import number
from harness.report.run.text import aligned
from harness.report.sweep.data import HEADLINE, SECOND, Statistic, Sweep, unit_of
from harness.report.sweep.wording import effect, faults, sentence

_MOST_ROWS, _MOST_FAULTS = 60, 8


def text(sweep: Sweep) -> str:
    """Lines for the terminal, of which there are no more for more cells."""
    lines = [sentence(sweep), *_table(sweep)]
    if sweep.keys:
        pairs = [[key.name, effect(sweep, key)] for key in sweep.keys]
        lines += ["", *aligned([["varied", f"mean {HEADLINE}, least and most"], *pairs], text_columns=2)]
    found = faults(sweep)
    lines += [""] if found else []
    for fault in found[:_MOST_FAULTS]:
        lines.append(f"FAILED {len(fault.cells):,}, such as {fault.cells[0]}: {fault.line}")
    if (more := len(found) - _MOST_FAULTS) > 0:
        lines.append(f"and {more:,} more kinds of failure, in failures.json")
    return "\n".join(lines)


def _table(sweep: Sweep) -> list[str]:
    """A row for each scenario and series that has cells."""
    rows = []
    for s, scenario in enumerate(sweep.scenarios):
        for n, series in enumerate(sweep.series):
            chosen = sweep.where(s, n)
            if chosen.any():
                figures = [sweep.statistic(metric, chosen) for metric in (HEADLINE, SECOND)]
                clips = str(max(one.clips for one in figures))
                shown = map(_figure, (HEADLINE, SECOND), figures)
                rows.append([scenario, series, f"{int(chosen.sum()):,}", clips, *shown])
    if not rows:
        return []
    head = ["scenario", "method", "cells", "clips", "joint angle [deg]", "position [mm]"]
    lines = ["", *aligned([head, *rows[:_MOST_ROWS]], text_columns=2)]
    more = len(rows) - _MOST_ROWS
    return [*lines, f"and {more:,} more rows, in report.html"] if more > 0 else lines


def _figure(metric: str, found: Statistic) -> str:
    if found.mean is None:
        return "not measured"
    spread = "" if found.sd is None else f" ± {number(found.sd, unit_of(metric))}"
    return f"{number(found.mean, unit_of(metric))}{spread}"
