"""The page of a sweep, written from its index: effects of varied keys, best method, failures, data files."""

import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from harness.compare import GATED_METRICS, MIN_UNITS, count_clips, count_units, find_best
from harness.core.arrays import Bools
from harness.core.number_format import Interval, count_noun, format_fixed
from harness.report.kit.page import (
    Block,
    BrowserOnly,
    Bullets,
    Code,
    DataTable,
    Drawing,
    Page,
    Panels,
    Prose,
    Section,
    Strong,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.kit.ranking import BOLD_NOTE
from harness.report.kit.text import format_statistic, list_first
from harness.report.sweep.charts import (
    MAX_INTERVALS,
    MAX_SCENARIOS,
    MAX_SERIES,
    Curves,
    curves,
    interaction_chart,
    scenarios_varying,
    sweep_chart,
)
from harness.report.sweep.data import METRICS, Statistic, SweepData, VariedKey, read_sweep, unit_of
from harness.report.sweep.effects import Interaction, KeyEffect, key_effects, key_interactions
from harness.report.sweep.wording import (
    best_sentence,
    effect_reason,
    group_failures,
    interaction_sentence,
    list_values,
    progress_sentence,
    sweep_sentence,
)
from harness.results import INDEX_FILE, PRIMARY_METRIC, SECONDARY_METRIC
from harness.score import DEFINITIONS

_EXAMPLE = "SELECT scenario, method, avg(mpjpe_mm) FROM cells GROUP BY scenario, method"
_MOST_FAILURES, _MOST_PRINTED, _MOST_CELLS, _MOST_ROWS = 50, 8, 20, 60
"""Most kinds of failure on the page and in a terminal, most cells of a kind, and most rows in a terminal."""
_MOST_INTERACTIONS = 6
_VERDICTS = {"worse": "worse", "better": "better", "same": "the same within the margin", "cannot tell": "cannot tell"}
_LOWER_IS_BETTER = ("deg", "mm", "ms")
"""Units of metrics whose lower values are better."""


def write_sweep_page(out: Path) -> Path:
    """Write OUT/report.html of the sweep in `out` and return its path; BadFile if `out` holds no sweep."""
    return write_page(sweep_page(read_sweep(out)), out / "report.html")


def sweep_page(sweep: SweepData) -> Page:
    """The page of a sweep."""
    intervals = min(len(sweep.series), MAX_SERIES) * sum(
        len(key.labels) * len(scenarios_varying(sweep, key)[:MAX_SCENARIOS]) for key in sweep.keys
    )
    slow = f"Intervals: {intervals:,} take too long to compute; use fewer values, scenarios or methods to see them"
    with_intervals = intervals <= MAX_INTERVALS
    return Page(
        verb="sweep",
        name=sweep.name,
        headline=sweep_sentence(sweep, reasons=False),
        lead=_result(sweep),
        facts={
            "Scenarios": list_first(sweep.scenarios, 8),
            "Clips": count_clips(sweep.clips, sweep.sampling),
            "Methods": list_first(sweep.series, 12),
            **{f"Varied: {key.name}": list_values(key) for key in sweep.keys},
            "Made by": sweep.command,
        },
        missing=[] if with_intervals else [slow],
        sections=[
            Section("Varied keys", "varied", _varied(sweep, with_intervals=with_intervals)),
            Section("Methods by scenario", "scenarios", _scenarios(sweep)),
            Section("Failures", "failures", _failures(sweep)),
            Section("Data files", "table", _files(sweep)),
        ],
    )


def sweep_text(sweep: SweepData) -> str:
    """The sweep for a terminal; its length is limited however many cells there are."""
    groups = group_failures(sweep)
    failures = [f"{len(of):,}, such as {of[0]}: {message}" for message, of in list(groups.items())[:_MOST_PRINTED]]
    more = len(groups) - len(failures)
    rest = [Prose(f"and {more:,} more kinds of failure, in summary.json")] if more else []
    sections = [
        Section("Methods", "methods", [_methods_table(sweep)]),
        Section("Failures", "failures", [Bullets(failures, prefix="FAILED "), *rest]),
    ]
    return render_text(Page("sweep", sweep.name, sweep_sentence(sweep), {}, sections, lead=_result(sweep)))


def _result(sweep: SweepData) -> list[Block]:
    """The progress, the best method, and for each kind of performers the interactions and the error at each value."""
    progress, is_complete = progress_sentence(sweep), len(sweep) == sweep.planned
    blocks: list[Block] = [Prose(progress, is_warning=not is_complete)] if sweep_sentence(sweep) != progress else []
    blocks += [Prose(text)] if sweep.keys and (text := best_sentence(sweep)) else []
    for performers in dict.fromkeys(sweep.performers):
        kind = f" ({performers} performers)" if performers else ""
        for interaction in key_interactions(sweep, performers)[:_MOST_INTERACTIONS]:
            draw = partial(interaction_chart, interaction)
            blocks += [
                Prose(interaction_sentence(interaction)),
                Drawing(draw, _interaction_table(interaction), level=0),
            ]
        for effect in key_effects(sweep, performers):
            reason = effect_reason(effect)
            blocks.append(_effect_table(effect, kind))
            blocks += [BrowserOnly([Prose(f"{effect.key.name}: {reason}.")])] if reason else []
    return blocks


def _interaction_table(interaction: Interaction) -> DataTable:
    """What each value of a key instead of the first one adds to the error, at each value of the other key."""
    key, by = interaction.key, interaction.by
    rows = [[f"{text} instead of {key.labels[0]}", *interaction.effects(n)] for n, text in enumerate(key.labels) if n]
    head = [key.name, *(f"at {by.name} {text}" for text in by.labels)]
    caption = f"What a value adds to the error [{unit_of(PRIMARY_METRIC)}], paired over units, with 95 % intervals."
    return DataTable(head, rows, caption=caption, label="interaction", most_printed=_MOST_ROWS)


def _effect_table(effect: KeyEffect, kind: str) -> DataTable:
    """The mean error at each value of a key, and the difference to the lowest."""
    rows = [
        [
            text,
            f"{format_fixed(float(effect.errors[:, n].mean()), 2)} {unit_of(PRIMARY_METRIC)}",
            "" if n == effect.lowest else effect.contrasts[n].difference,
            "lowest" if n == effect.lowest else _VERDICTS[effect.contrasts[n].verdict],
        ]
        for n, text in enumerate(effect.key.labels)
    ]
    caption = f"Over {count_units(effect.units)}{kind} and all methods that were measured at every value."
    head = [effect.key.name, "mean error", "more than the lowest", "verdict"]
    return DataTable(head, rows, caption=caption, label=f"effect of {effect.key.name}", most_printed=_MOST_ROWS)


def _methods_table(sweep: SweepData) -> DataTable:
    """A row for each scenario and series that has cells."""
    rows: list[list[object]] = []
    for s, scenario in enumerate(sweep.scenarios):
        for n, series in enumerate(sweep.series):
            selected = sweep.select(s, n)
            if selected.any():
                found = {metric: sweep.statistic(metric, selected) for metric in (PRIMARY_METRIC, SECONDARY_METRIC)}
                clips = max(statistic.clips for statistic in found.values())
                means = [_mean_text(statistic, metric, statistic.clips) for metric, statistic in found.items()]
                rows.append([scenario, series, f"{int(selected.sum()):,}", clips, *means])
    head = ["scenario", "method", "cells", "clips", "joint angle [deg]", "position [mm]"]
    return DataTable(head, rows, most_printed=_MOST_ROWS)


def _varied(sweep: SweepData, *, with_intervals: bool) -> list[Block]:
    """For each key a chart for each scenario that varies it, and the numbers folded."""
    if not sweep.keys:
        return []
    text = (
        f"Mean {PRIMARY_METRIC}; each clip is first averaged over all other varied values. Bars: 95 % interval over "
        f"units (performers, or what the scenarios declare), if there are at least {MIN_UNITS}."
    )
    charts, tables = [], []
    for key in sweep.keys:
        scenarios = scenarios_varying(sweep, key)
        by_scenario = {n: curves(sweep, key, n, with_intervals=with_intervals) for n in scenarios[:MAX_SCENARIOS]}
        charts += [(None, partial(sweep_chart, sweep, key, n, lines)) for n, lines in by_scenario.items() if lines]
        if (more := len(scenarios) - len(by_scenario)) > 0:
            text += f" For {key.name}, {more:,} more scenarios are only in summary.csv."
        numbers = [table for n, lines in by_scenario.items() for table in _value_tables(sweep, key, n, lines)]
        tables.append(BrowserOnly(numbers, f"Numbers: {key.name}"))
    return [Prose(text), Panels(charts, broad=True), *tables]


def _value_tables(sweep: SweepData, key: VariedKey, scenario: int, primary: Curves) -> list[DataTable]:
    secondary = curves(sweep, key, scenario, SECONDARY_METRIC, with_intervals=False)
    return [
        _value_table(sweep, key, scenario, lines, metric)
        for lines, metric in ((primary, PRIMARY_METRIC), (secondary, SECONDARY_METRIC))
    ]


def _value_table(sweep: SweepData, key: VariedKey, scenario: int, lines: Curves, metric: str) -> DataTable:
    """The numbers of a chart: a row for each curve, a column for each value of the key."""
    titles = [f"{key.name}={text}" for text in key.labels]
    over = f"over clips of {sweep.scenarios[scenario]} ± standard deviation, or over units with their 95 % interval"
    best = [
        _best_rows(sweep, metric, ((s, sweep.select(scenario, s, **{key.name: value})) for s in lines))
        for value in range(len(titles))
    ]
    return _grid(metric, over, titles, [sweep.series[s] for s in lines], list(lines.values()), best)


def _scenarios(sweep: SweepData) -> list[Block]:
    if not len(sweep):
        return []
    tables = [scenario_table(sweep, metric) for metric in METRICS]
    return [*tables[:2], BrowserOnly(tables[2:], "More metrics")]


def scenario_table(sweep: SweepData, metric: str) -> DataTable:
    """A row for each series, a column for each scenario and, if there are several, one for all of them."""
    columns: list[int | None] = [*range(len(sweep.scenarios)), *([None] if len(sweep.scenarios) > 1 else [])]
    series = range(len(sweep.series))
    rows = [[sweep.statistic(metric, sweep.select(c, s)) for c in columns] for s in series]
    titles = ["all" if c is None else sweep.scenarios[c].replace("_", " ") for c in columns]
    over = "± standard deviation over clips, each averaged over varied values"
    best = [_best_rows(sweep, metric, ((s, sweep.select(c, s)) for s in series)) for c in columns]
    return _grid(metric, over, titles, sweep.series, rows, best)


def _grid(
    metric: str,
    over: str,
    titles: Sequence[str],
    names: Sequence[str],
    statistics: Sequence[Sequence[Statistic]],
    best: Sequence[Collection[int]],
) -> DataTable:
    """A row for each name. A column's head has its number of clips; cells with fewer clips have their own.

    `best` has the rows that are bold, for each column.
    """
    clips = [max((row[n].clips for row in statistics), default=0) for n in range(len(titles))]
    head = ["method", *(f"{title} n\u00a0{n}" for title, n in zip(titles, clips, strict=True))]
    rows = [
        [name, *(_cell(item, metric, at in best[n], clips[n]) for n, item in enumerate(row))]
        for at, (name, row) in enumerate(zip(names, statistics, strict=True))
    ]
    definition = DEFINITIONS[metric]
    caption = f"{definition.text}. Mean {over}.{BOLD_NOTE if any(best) else ''}"
    return DataTable(head, rows, f"{metric} [{definition.unit}]:", caption, metric)


def _cell(statistic: Statistic, metric: str, best: bool, column_clips: int) -> object:
    cell: object = _mean_text(statistic, metric, column_clips)
    if statistic.low is not None and statistic.clips == column_clips:
        cell = Interval.of(statistic.mean, statistic.low, statistic.high)
    return Strong(cell) if best else cell


def _mean_text(statistic: Statistic, metric: str, column_clips: int) -> str:
    mean, sd, clips = statistic.mean, statistic.sd, statistic.clips
    return format_statistic(mean, sd, unit_of(metric), clips=clips, of_column=column_clips)


def _best_rows(sweep: SweepData, metric: str, rows: Iterable[tuple[int, Bools]]) -> set[int]:
    """The rows that are better than every other one, for each kind of performer and each number of later frames.

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


def _failures(sweep: SweepData) -> list[Block]:
    """Each kind of failure once, with its cells, the traceback of the first, and the command that retries them."""
    groups = group_failures(sweep)
    more = len(groups) - _MOST_FAILURES
    rest = [Prose(f"And {more:,} more kinds; summary.json has them all.")] if more > 0 else []
    text = "Finished cells are kept. This command runs the failed ones again:"
    retry: list[Block] = [Prose(text), Code(sweep.command)] if groups and sweep.command else []
    return [*retry, *(_failure(sweep, *group) for group in list(groups.items())[:_MOST_FAILURES]), *rest]


def _failure(sweep: SweepData, message: str, failed: Sequence[str]) -> Block:
    more = len(failed) - _MOST_CELLS
    cells = [*failed[:_MOST_CELLS], *([f"and {more:,} more"] if more > 0 else [])]
    alone = [Code(f"{sweep.command} --cell {shlex.quote(failed[0])}")] if sweep.command else []
    first = Prose("Message of the first cell, and the command that runs it alone:")
    blocks: list[Block] = [Bullets(cells), first, Code(sweep.failures[failed[0]]), *alone]
    return BrowserOnly(blocks, f"{count_noun(len(failed), 'cell')}: {message}")


def _files(sweep: SweepData) -> list[Block]:
    index = f"`{INDEX_FILE}`: a database with the same data and more, such as the run time of each cell."
    return [
        Bullets(
            [
                f"`summary.csv`: {len(sweep):,} rows in the order of the plan, with every metric.",
                f"{index} An example query:",
            ]
        ),
        Code(f'sqlite3 {INDEX_FILE} "{_EXAMPLE}"'),
    ]
