"""The page of a sweep, written from its index: what was found, what was varied, what failed, and where the table is."""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from harness.compare.paired_statistics import FEWEST_CLIPS
from harness.core.files import write_text
from harness.report.comparison.wording import listed
from harness.report.kit.document import Section, document, embedded
from harness.report.kit.markup import Markup, folded, joined, tag
from harness.report.kit.style import Chart
from harness.report.sweep.charts import MOST_INTERVALS, MOST_SCENARIOS, MOST_SERIES, Curve, chart, curves, varying
from harness.report.sweep.data import HEADLINE, METRICS, SECOND, Key, Sweep
from harness.report.sweep.reader import read_sweep
from harness.report.sweep.tables import by_scenario, by_value, failures
from harness.report.sweep.wording import effect, sentence, values
from harness.results.index import INDEX

_EXAMPLE = "SELECT scenario, method, avg(mpjpe_mm) FROM cells GROUP BY scenario, method"


def write_sweep(out: Path) -> Path:
    """Write OUT/report.html of the sweep in `out` and return it; BadFile when there is none.

    Without matplotlib it has the tables alone.
    """
    path = out / "report.html"
    write_text(path, sweep_page(read_sweep(out)))
    return path


def sweep_page(sweep: Sweep) -> str:
    """The whole file."""
    draw, missing = find_spec("matplotlib") is not None, []
    wanted = min(len(sweep.series), MOST_SERIES) * sum(
        len(key.texts) * len(varying(sweep, key)[:MOST_SCENARIOS]) for key in sweep.keys
    )
    ends = wanted <= MOST_INTERVALS
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


def _facts(sweep: Sweep) -> Mapping[str, str]:
    facts = {
        "Scenarios": listed(sweep.scenarios, 8),
        "Clips": f"{len(sweep.clips):,}",
        "Methods": listed(sweep.series, 12),
        **{f"Varied: {key.name}": f"{values(key)}: {effect(sweep, key)}" for key in sweep.keys},
        "Made by": sweep.command,
    }
    return {title: text for title, text in facts.items() if text}


def _varied(sweep: Sweep, *, ends: bool, draw: bool) -> Markup:
    """For each key a chart for each scenario that varies it, and the figures folded."""
    if not sweep.keys:
        return Markup()
    text = (
        f"Mean {HEADLINE} over clips, each averaged over what else is varied. Bars: 95 % interval, where there "
        f"are {FEWEST_CLIPS} clips at least."
    )
    charts: list[Markup] = []
    tables: list[Markup] = []
    for key in sweep.keys:
        scenarios = varying(sweep, key)
        found = {scenario: curves(sweep, key, scenario, ends=ends) for scenario in scenarios[:MOST_SCENARIOS]}
        charts += [_figure(chart(sweep, key, n, those)) for n, those in found.items() if those and draw]
        if (more := len(scenarios) - len(found)) > 0:
            text += f" Of {key.name} {more:,} more scenarios are in the table alone."
        figures = [_tables(sweep, key, n, those) for n, those in found.items()]
        tables.append(folded(f"Figures: {key.name}", *figures) if draw else joined(tag("h3", key.name), *figures))
    return joined(tag("p", text), tag("div", *charts, class_="panels broad") if charts else None, *tables)


def _tables(sweep: Sweep, key: Key, scenario: int, found: Sequence[Curve]) -> Markup:
    second = curves(sweep, key, scenario, SECOND, ends=False)
    return joined(*(by_value(sweep, key, scenario, those, m) for those, m in ((found, HEADLINE), (second, SECOND))))


def _figure(drawn: Chart) -> Markup:
    image = tag("img", src=embedded(drawn.for_screen().encode(), "image/svg+xml"), alt=drawn.alt)
    return tag("figure", tag("h3", drawn.title), image, tag("figcaption", drawn.caption), class_="panel")


def _scenarios(sweep: Sweep) -> Markup:
    if not len(sweep):
        return Markup()
    first, further = METRICS[:2], METRICS[2:]
    more = folded("More metrics", *(by_scenario(sweep, metric) for metric in further))
    return joined(*(by_scenario(sweep, metric) for metric in first), more)


def _files(sweep: Sweep) -> Markup:
    def file(name: str) -> Markup:
        return tag("code", name)

    items: list[Any] = [
        joined(file("table.csv"), f": {len(sweep):,} rows in planned order, with every metric."),
        joined(file(INDEX), ": the same for questions, and more, such as how long each cell took:"),
    ]
    query = tag("pre", tag("code", f'sqlite3 {INDEX} "{_EXAMPLE}"'))
    return joined(tag("ul", *(tag("li", item) for item in items), class_="notes"), query)
