"""Writes the page of the tracker's physics."""

from pathlib import Path

from harness.core.files import write_text
from harness.errors import BadInput
from harness.report.physics.charts import charts
from harness.report.physics.error_comparison import ErrorModelComparison
from harness.report.physics.page import physics_page


def write_physics_page(path: Path, comparison: ErrorModelComparison) -> Path:
    """Write the page to `path` and return it; its folder is created. BadInput without any error model."""
    if not comparison.models:
        raise BadInput("There is no error model to show.", "Give at least one.")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, physics_page(comparison, charts(comparison)))
    return path
