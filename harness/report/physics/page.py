"""The page of the tracker's physics: the truth table first, then the error models side by side."""

from collections.abc import Mapping

from harness.report.kit.document import Section, chart_figure, document
from harness.report.kit.markup import Markup, details, join, tag
from harness.report.kit.style import Chart
from harness.report.physics.error_comparison import ErrorModelComparison
from harness.report.physics.tables import (
    excursions_table,
    gaps_table,
    quality_table,
    spectrum_table,
    summary_table,
)
from harness.report.physics.truth_table import result_sentence, truth_table


def physics_page(comparison: ErrorModelComparison, charts: Mapping[str, Chart]) -> str:
    """The HTML of the page, with the charts of `physics.charts`; a section without its chart has its table open."""
    models = comparison.models
    tables = {
        "Spectrum": ("spectrum", spectrum_table(models)),
        "Excursions": ("excursions", excursions_table(models)),
        "Gaps": ("gaps", gaps_table(models)),
        "Quality": ("quality", quality_table(models)),
    }
    sections: list[Section] = [
        ("Summary", "summary", summary_table(comparison)),
        *((title, name, _chart_and_numbers(charts.get(name), table)) for title, (name, table) in tables.items()),
        ("Made by", "command", tag("pre", tag("code", comparison.command))),
    ]
    return document(
        title="Physics of the tracker: harness bench physics",
        kicker="harness bench physics",
        heading=result_sentence(models[0].label, comparison.rows),
        facts={model.label: model.source for model in models},
        sections=sections,
        lead=truth_table(comparison.rows),
    )


def _chart_and_numbers(chart: Chart | None, table: Markup) -> Markup:
    if chart is None:
        return table
    return join(chart_figure(chart), details("Numbers of this chart", table))
