"""Tables of a sweep's page: methods by scenario, methods by the values of a key, and failed cells."""

import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence

from harness.compare.margins import GATED_METRICS
from harness.compare.ranking import find_best
from harness.core.arrays import Bools
from harness.core.number_format import count_noun, format_number
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, bullet_list, details, join, tag
from harness.report.kit.ranking import BOLD_NOTE
from harness.report.kit.table import count_note, html_table, statistic_cell
from harness.report.sweep.charts import Curve
from harness.report.sweep.data import Statistic, SweepData, VariedKey, unit_of
from harness.report.sweep.wording import FailureGroup, group_failures
from harness.score.metrics import DEFINITIONS

_MOST_FAILURES, _MOST_CELLS = 50, 20
_LOWER_IS_BETTER = ("deg", "mm", "ms")
"""Units of metrics whose lower values are better."""


def scenario_table(sweep: SweepData, metric: str) -> Markup:
    """A row for each series, a column for each scenario and, if there are several, one for all of them."""
    columns: list[int | None] = [*range(len(sweep.scenarios)), *([None] if len(sweep.scenarios) > 1 else [])]
    series = range(len(sweep.series))
    rows = [[sweep.statistic(metric, sweep.select(c, s)) for c in columns] for s in series]
    titles = ["all" if c is None else sweep.scenarios[c].replace("_", " ") for c in columns]
    over = "± standard deviation over clips, each averaged over varied values"
    best = [_best_rows(sweep, metric, ((s, sweep.select(c, s)) for s in series)) for c in columns]
    return _grid(metric, over, titles, sweep.series, rows, best)


def value_table(sweep: SweepData, key: VariedKey, scenario: int, curves: Sequence[Curve], metric: str) -> Markup:
    """The numbers of a chart: a row for each curve, a column for each value of the key."""
    titles = [f"{key.name}={text}" for text in key.labels]
    over = f"over clips of {sweep.scenarios[scenario]} ± standard deviation, or with its 95 % interval"
    series = [curve.colour_index for curve in curves]
    best = [
        _best_rows(sweep, metric, ((s, sweep.select(scenario, s, **{key.name: value})) for s in series))
        for value in range(len(titles))
    ]
    return _grid(metric, over, titles, [c.name for c in curves], [c.points for c in curves], best)


def _grid(
    metric: str,
    over: str,
    titles: Sequence[str],
    names: Sequence[str],
    statistics: Sequence[Sequence[Statistic]],
    best: Sequence[Collection[int]],
) -> Markup:
    """A row for each name. A column's head has its number of clips; cells with fewer clips have their own.

    `best` has the rows that are bold, for each column.
    """
    columns = [[row[n] for row in statistics] for n in range(len(titles))]
    clips = [max((statistic.clips for statistic in column), default=0) for column in columns]
    head = ["method", *(join(title, count_note(n)) for title, n in zip(titles, clips, strict=True))]
    rows = [
        [name, *(_cell(item, metric, at in best[n], clips[n]) for n, item in enumerate(row))]
        for at, (name, row) in enumerate(zip(names, statistics, strict=True))
    ]
    definition = DEFINITIONS[metric]
    caption = join(
        tag("b", f"{metric} [{definition.unit}]"), f": {definition.text}. Mean {over}.{BOLD_NOTE if any(best) else ''}"
    )
    return html_table(Table(head, rows), caption, label=metric)


def failures(sweep: SweepData) -> Markup:
    """Each kind of failure once, with its cells, the traceback of the first, and the command that retries them."""
    groups = group_failures(sweep)
    if not groups:
        return Markup()
    more = len(groups) - _MOST_FAILURES
    rest = tag("p", f"And {more:,} more kinds; summary.json has them all.") if more > 0 else None
    text = "Finished cells are kept. This command runs the failed ones again:"
    retry = join(tag("p", text), tag("pre", tag("code", sweep.command))) if sweep.command else None
    items = [_failure_item(group, sweep.command) for group in groups[:_MOST_FAILURES]]
    return join(retry, bullet_list(items), rest)


def _failure_item(group: FailureGroup, command: str) -> Markup:
    cells = list(group.cells[:_MOST_CELLS])
    if (more := len(group.cells) - _MOST_CELLS) > 0:
        cells.append(f"and {more:,} more")
    title = join(tag("b", count_noun(len(group.cells), "cell")), f": {group.message}")
    first = tag("p", "Message of the first cell, and the command that runs it alone:")
    alone = tag("pre", tag("code", f"{command} --cell {shlex.quote(group.cells[0])}")) if command else None
    return details(title, bullet_list(cells, class_=None), first, tag("pre", group.traceback), alone)


def _best_rows(sweep: SweepData, metric: str, rows: Iterable[tuple[int, Bools]]) -> set[int]:
    """The rows that are better than every other one, for each kind of performer and each lag.

    A row is a series and its cells.
    """
    if DEFINITIONS[metric].unit not in _LOWER_IS_BETTER:
        return set()
    groups: dict[tuple[str, int], dict[int, Bools]] = {}
    for n, (series, selected) in enumerate(rows):
        groups.setdefault((sweep.performers[series], sweep.lags[series]), {})[n] = selected

    def best(cells: Mapping[int, Bools], metrics: Sequence[str]) -> str | None:
        values = {str(n): sweep.clip_values(selected, metrics) for n, selected in cells.items()}
        return find_best(values, metric, sweep.sampling)

    # The gated metrics are read only where the lines of this metric alone leave a best row.
    candidates = [cells for cells in groups.values() if best(cells, (metric,))]
    return {int(row) for cells in candidates if (row := best(cells, (metric, *GATED_METRICS)))}


def _cell(statistic: Statistic, metric: str, best: bool, column_clips: int) -> Markup:
    mean, clips, unit = statistic.mean, statistic.clips, unit_of(metric)
    cell = statistic_cell(mean, statistic.sd, unit, n=clips, column_n=column_clips)
    if mean is not None and statistic.low is not None and statistic.high is not None:
        interval = f" {format_number(statistic.low, unit)} to {format_number(statistic.high, unit)}"
        note = None if clips == column_clips else count_note(clips)
        cell = join(format_number(mean, unit), tag("span", interval, class_="spread"), note)
    return tag("strong", cell) if best else cell
