"""The page of the tracker's physics: the truth table first, then the error models side by side."""

from functools import partial
from pathlib import Path

from harness.errors import BadInput
from harness.report.kit.page import Drawing, Page, Section
from harness.report.kit.page_html import write_page
from harness.report.physics.charts import excursions_chart, gaps_chart, quality_chart, spectrum_chart
from harness.report.physics.error_comparison import ErrorModelComparison
from harness.report.physics.tables import (
    excursions_table,
    gaps_table,
    quality_table,
    spectrum_table,
    summary_table,
)
from harness.report.physics.truth_table import result_sentence, truth_table


def write_physics_page(path: Path, comparison: ErrorModelComparison) -> Path:
    """Write the page to `path` and return it; its folder is created. BadInput without any error model."""
    if not comparison.models:
        raise BadInput("There is no error model to show.", "Give at least one.")
    return write_page(physics_page(comparison), path)


def physics_page(comparison: ErrorModelComparison) -> Page:
    """The page of a comparison of error models."""
    models = comparison.models
    parts = {
        "Spectrum": (spectrum_chart, spectrum_table(models)),
        "Excursions": (excursions_chart, excursions_table(models)),
        "Gaps": (gaps_chart, gaps_table(models)),
        "Quality": (quality_chart, quality_table(models)),
    }
    return Page(
        verb="bench physics",
        name="",
        headline=result_sentence(models[0].label, comparison.rows),
        lead=[truth_table(comparison.rows)],
        facts={model.label: model.source for model in models},
        sections=[
            Section("Summary", "summary", [summary_table(comparison)]),
            *(
                Section(title, title.lower(), [Drawing(partial(draw, comparison), table)])
                for title, (draw, table) in parts.items()
            ),
        ],
        command=comparison.command,
    )
