"""The page of a sweep, written from its index: what was found, what was varied, what failed, and where the table is."""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from harness.compare.paired_statistics import MIN_CLIPS
from harness.core.files import write_text
from harness.report.comparison.wording import list_first
from harness.report.kit.document import Section, data_uri, document
from harness.report.kit.markup import Markup, details, join, tag
from harness.report.kit.style import Chart
from harness.report.sweep.charts import (
    MAX_INTERVALS,
    MAX_SCENARIOS,
    MAX_SERIES,
    Curve,
    curves,
    scenarios_varying,
    sweep_chart,
)
from harness.report.sweep.data import METRICS, PRIMARY_METRIC, SECONDARY_METRIC, SweepData, VariedKey
from harness.report.sweep.reader import read_sweep
from harness.report.sweep.tables import failures, scenario_table, value_table
from harness.report.sweep.wording import describe_effect, list_values, sentence
from harness.results.index import INDEX_FILE

_EXAMPLE = "SELECT scenario, method, avg(mpjpe_mm) FROM cells GROUP BY scenario, method"


def write_sweep_page(out: Path) -> Path:
    """Write OUT/report.html of the sweep in `out` and return it; BadFile when there is none.

    Without matplotlib it has the tables alone.
    """
    path = out / "report.html"
    write_text(path, sweep_page(read_sweep(out)))
    return path


def sweep_page(sweep: SweepData) -> str:
    """The whole file."""
    draw, missing = find_spec("matplotlib") is not None, []
    wanted = min(len(sweep.series), MAX_SERIES) * sum(
        len(key.labels) * len(scenarios_varying(sweep, key)[:MAX_SCENARIOS]) for key in sweep.keys
    )
    ends = wanted <= MAX_INTERVALS
    if sweep.keys and not draw:
        missing.append("Charts: matplotlib is not installed; their numbers are tables")
    if not ends:
        missing.append(
            f"Intervals: {wanted:,} would take too long; sweeps of fewer values, scenarios or methods have them"
        )
    sections: list[Section] = [
        ("What was varied", "varied", _varied(sweep, ends=ends, draw=draw)),
        ("Methods by scenario", "scenarios", _scenarios(sweep)),
        ("Failures", "failures", failures(sweep)),
        ("The whole table", "table", _files(sweep)),
    ]
    return document(
        title=f"{sweep.name}: harness sweep",
        kicker=f"harness sweep · {sweep.name}",
        heading=sentence(sweep),
        facts=_facts(sweep),
        missing=missing,
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


def _varied(sweep: SweepData, *, ends: bool, draw: bool) -> Markup:
    """For each key a chart for each scenario that varies it, and the figures folded."""
    if not sweep.keys:
        return Markup()
    text = (
        f"Mean {PRIMARY_METRIC} over clips, each averaged over what else is varied. Bars: 95 % interval, where there "
        f"are {MIN_CLIPS} clips at least."
    )
    charts: list[Markup] = []
    tables: list[Markup] = []
    for key in sweep.keys:
        scenarios = scenarios_varying(sweep, key)
        found = {scenario: curves(sweep, key, scenario, ends=ends) for scenario in scenarios[:MAX_SCENARIOS]}
        charts += [_figure(sweep_chart(sweep, key, n, those)) for n, those in found.items() if those and draw]
        if (more := len(scenarios) - len(found)) > 0:
            text += f" Of {key.name} {more:,} more scenarios are in the table alone."
        figures = [_tables(sweep, key, n, those) for n, those in found.items()]
        tables.append(details(f"Figures: {key.name}", *figures) if draw else join(tag("h3", key.name), *figures))
    return join(tag("p", text), tag("div", *charts, class_="panels broad") if charts else None, *tables)


def _tables(sweep: SweepData, key: VariedKey, scenario: int, found: Sequence[Curve]) -> Markup:
    second = curves(sweep, key, scenario, SECONDARY_METRIC, ends=False)
    return join(
        *(
            value_table(sweep, key, scenario, those, m)
            for those, m in ((found, PRIMARY_METRIC), (second, SECONDARY_METRIC))
        )
    )


def _figure(drawn: Chart) -> Markup:
    image = tag("img", src=data_uri(drawn.for_screen().encode(), "image/svg+xml"), alt=drawn.alt)
    return tag("figure", tag("h3", drawn.title), image, tag("figcaption", drawn.caption), class_="panel")


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
        join(file("summary.csv"), f": {len(sweep):,} rows in planned order, with every metric."),
        join(file(INDEX_FILE), ": the same for questions, and more, such as how long each cell took:"),
    ]
    query = tag("pre", tag("code", f'sqlite3 {INDEX_FILE} "{_EXAMPLE}"'))
    return join(tag("ul", *(tag("li", item) for item in items), class_="notes"), query)
