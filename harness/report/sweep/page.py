"""The page of a sweep, written from its index: best method, effect of varied keys, failures, data files."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.compare.paired_statistics import MIN_UNITS
from harness.core.files import write_text
from harness.report.kit.document import Section, chart_panel, document
from harness.report.kit.markup import Markup, bullet_list, details, join, tag
from harness.report.kit.text import list_first
from harness.report.sweep.charts import (
    MAX_INTERVALS,
    MAX_SCENARIOS,
    MAX_SERIES,
    Curve,
    curves,
    scenarios_varying,
    sweep_chart,
)
from harness.report.sweep.data import METRICS, SweepData, VariedKey
from harness.report.sweep.reader import read_sweep
from harness.report.sweep.tables import failures, scenario_table, value_table
from harness.report.sweep.wording import describe_effect, list_values, sentence
from harness.results.index import INDEX_FILE
from harness.results.reported_metrics import PRIMARY_METRIC, SECONDARY_METRIC

_EXAMPLE = "SELECT scenario, method, avg(mpjpe_mm) FROM cells GROUP BY scenario, method"


def write_sweep_page(out: Path) -> Path:
    """Write OUT/report.html of the sweep in `out` and return its path; BadFile if `out` holds no sweep."""
    path = out / "report.html"
    write_text(path, sweep_page(read_sweep(out)))
    return path


def sweep_page(sweep: SweepData) -> str:
    """The HTML of the page."""
    intervals = min(len(sweep.series), MAX_SERIES) * sum(
        len(key.labels) * len(scenarios_varying(sweep, key)[:MAX_SCENARIOS]) for key in sweep.keys
    )
    with_intervals = intervals <= MAX_INTERVALS
    slow = f"Intervals: {intervals:,} take too long to compute; use fewer values, scenarios or methods to see them"
    sections: list[Section] = [
        ("Varied keys", "varied", _varied(sweep, with_intervals=with_intervals)),
        ("Methods by scenario", "scenarios", _scenarios(sweep)),
        ("Failures", "failures", failures(sweep)),
        ("Data files", "table", _files(sweep)),
    ]
    return document(
        title=f"{sweep.name}: harness sweep",
        kicker=f"harness sweep · {sweep.name}",
        heading=sentence(sweep),
        facts=_facts(sweep),
        missing=[] if with_intervals else [slow],
        sections=sections,
    )


def _facts(sweep: SweepData) -> Mapping[str, str]:
    facts = {
        "Scenarios": list_first(sweep.scenarios, 8),
        "Clips": f"{len(sweep.clips):,}",
        "Methods": list_first(sweep.series, 12),
        **{f"Varied: {key.name}": f"{list_values(key)}: {describe_effect(sweep, key)}" for key in sweep.keys},
        "Made by": sweep.command,
    }
    return {title: text for title, text in facts.items() if text}


def _varied(sweep: SweepData, *, with_intervals: bool) -> Markup:
    """For each key a chart for each scenario that varies it, and the numbers folded."""
    if not sweep.keys:
        return Markup()
    text = (
        f"Mean {PRIMARY_METRIC} over clips; each clip is first averaged over all other varied values. Bars: 95 % "
        f"interval, if there are at least {MIN_UNITS} clips."
    )
    charts: list[Markup] = []
    tables: list[Markup] = []
    for key in sweep.keys:
        scenarios = scenarios_varying(sweep, key)
        by_scenario = {n: curves(sweep, key, n, with_intervals=with_intervals) for n in scenarios[:MAX_SCENARIOS]}
        charts += [chart_panel(sweep_chart(sweep, key, n, lines)) for n, lines in by_scenario.items() if lines]
        if (more := len(scenarios) - len(by_scenario)) > 0:
            text += f" For {key.name}, {more:,} more scenarios are only in summary.csv."
        numbers = [_tables(sweep, key, n, lines) for n, lines in by_scenario.items()]
        tables.append(details(f"Numbers: {key.name}", *numbers))
    return join(tag("p", text), tag("div", *charts, class_="panels broad") if charts else None, *tables)


def _tables(sweep: SweepData, key: VariedKey, scenario: int, primary: Sequence[Curve]) -> Markup:
    secondary = curves(sweep, key, scenario, SECONDARY_METRIC, with_intervals=False)
    return join(
        value_table(sweep, key, scenario, primary, PRIMARY_METRIC),
        value_table(sweep, key, scenario, secondary, SECONDARY_METRIC),
    )


def _scenarios(sweep: SweepData) -> Markup:
    if not len(sweep):
        return Markup()
    first, further = METRICS[:2], METRICS[2:]
    more = details("More metrics", *(scenario_table(sweep, metric) for metric in further))
    return join(*(scenario_table(sweep, metric) for metric in first), more)


def _files(sweep: SweepData) -> Markup:
    def file(name: str) -> Markup:
        return tag("code", name)

    items: list[Any] = [
        join(file("summary.csv"), f": {len(sweep):,} rows in the order of the plan, with every metric."),
        join(
            file(INDEX_FILE),
            ": a database with the same data and more, such as the run time of each cell. An example query:",
        ),
    ]
    query = tag("pre", tag("code", f'sqlite3 {INDEX_FILE} "{_EXAMPLE}"'))
    return join(bullet_list(items), query)
