"""The tables of a sweep's page: methods by scenario, methods by the values of a key, and what failed."""

import math
import shlex
from collections.abc import Sequence
from typing import Any

from harness.report.kit.markup import Markup, details, join, table, tag
from harness.report.run.tables import NOT_MEASURED, format_count, format_number
from harness.report.sweep.charts import Curve
from harness.report.sweep.data import Statistic, SweepData, VariedKey, unit_of
from harness.report.sweep.wording import FailureGroup, group_failures
from harness.score.metrics import DEFINITIONS

_MOST_FAILURES, _MOST_CELLS = 50, 20
_LOWER_IS_BETTER = ("deg", "mm", "ms")
"""Units of which less is better."""


def scenario_table(sweep: SweepData, metric: str) -> Markup:
    """A row for each series, a column for each scenario, and all of them together where there are several."""
    columns: list[int | None] = [*range(len(sweep.scenarios)), *([None] if len(sweep.scenarios) > 1 else [])]
    found = [[sweep.statistic(metric, sweep.select(c, s)) for c in columns] for s in range(len(sweep.series))]
    titles = ["all" if c is None else sweep.scenarios[c].replace("_", " ") for c in columns]
    return _grid(
        metric, "± standard deviation over clips, each averaged over what is varied", titles, sweep.series, found
    )


def value_table(sweep: SweepData, key: VariedKey, scenario: int, curves: Sequence[Curve], metric: str) -> Markup:
    """The figures of a chart."""
    titles = [f"{key.name}={text}" for text in key.labels]
    over = f"over clips of {sweep.scenarios[scenario]} ± standard deviation, or with the 95 % interval"
    return _grid(metric, over, titles, [c.name for c in curves], [c.points for c in curves])


def _grid(
    metric: str, over: str, titles: Sequence[str], names: Sequence[str], found: Sequence[Sequence[Statistic]]
) -> Markup:
    """A row for each name; above each column how many clips it has, beside a figure that has fewer how many."""
    columns = [[row[n] for row in found] for n in range(len(titles))]
    clips = [max((one.clips for one in column), default=0) for column in columns]
    best = [_best_statistic(column, metric) for column in columns]
    head = ["method", *(join(title, format_count(n)) for title, n in zip(titles, clips, strict=True))]
    rows = [
        [name, *(_cell(one, metric, best[n] is one, clips[n]) for n, one in enumerate(row))]
        for name, row in zip(names, found, strict=True)
    ]
    definition = DEFINITIONS[metric]
    caption = join(tag("b", f"{metric} [{definition.unit}]"), f": {definition.text}. Mean {over}.")
    return table(caption, head, rows, label=metric)


def failures(sweep: SweepData) -> Markup:
    """Each kind of failure once, with its cells, the first one's traceback, and how they are tried again."""
    found = group_failures(sweep)
    if not found:
        return Markup()
    more = len(found) - _MOST_FAILURES
    rest = tag("p", f"And {more:,} more kinds; summary.json has them all.") if more > 0 else None
    text = "Finished cells are kept. This tries all failed ones again:"
    again = join(tag("p", text), tag("pre", tag("code", sweep.command))) if sweep.command else None
    items = (_failure_item(fault, sweep.command) for fault in found[:_MOST_FAILURES])
    return join(again, tag("ul", *items, class_="notes"), rest)


def _failure_item(fault: FailureGroup, command: str) -> Markup:
    cells = [tag("li", cell) for cell in fault.cells[:_MOST_CELLS]]
    if (more := len(fault.cells) - _MOST_CELLS) > 0:
        cells.append(tag("li", f"and {more:,} more"))
    title = join(tag("b", f"{len(fault.cells):,} cell{'s'[: len(fault.cells) != 1]}"), f": {fault.message}")
    alone = tag("pre", tag("code", f"{command} --cell {shlex.quote(fault.cells[0])}")) if command else None
    return tag(
        "li", details(title, tag("ul", *cells), tag("p", "The first one's:"), tag("pre", fault.traceback), alone)
    )


def _best_statistic(column: Sequence[Statistic], metric: str) -> Statistic | None:
    """The best of several, where less is better."""
    known = [one for one in column if one.mean is not None]
    ranked = len(known) > 1 and DEFINITIONS[metric].unit in _LOWER_IS_BETTER
    return min(known, key=lambda one: one.mean if one.mean is not None else math.inf) if ranked else None


def _cell(found: Statistic, metric: str, best: bool, clips: int) -> Any:
    if found.mean is None:
        return NOT_MEASURED
    unit = unit_of(metric)
    beside = f" ± {format_number(found.sd, unit)}" if found.sd is not None else ""
    if found.low is not None and found.high is not None:
        beside = f" {format_number(found.low, unit)} to {format_number(found.high, unit)}"
    spread = tag("span", beside, class_="spread") if beside else None
    text = join(format_number(found.mean, unit), spread, None if found.clips == clips else format_count(found.clips))
    return tag("strong", text) if best else text
