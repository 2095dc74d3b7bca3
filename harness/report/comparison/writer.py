"""Writes the page of a comparison; re-exports its text for the terminal."""

from importlib.util import find_spec
from pathlib import Path

from harness.compare.comparison import Comparison
from harness.core.files import write_text
from harness.report.comparison.interval_chart import interval_charts
from harness.report.comparison.page import ComparisonCharts, comparison_page
from harness.report.comparison.slope_chart import slope_chart
from harness.report.comparison.text import text
from harness.report.comparison.wording import sort_by_verdict

__all__ = ["text", "write_comparison_page"]


def write_comparison_page(comparison: Comparison, path: Path) -> Path:
    """Write the page to `path` and return it; its folder is created. Without matplotlib it has only tables."""
    pictures, missing = ComparisonCharts(), ["Charts: matplotlib is not installed; their numbers are in the tables"]
    if find_spec("matplotlib") is not None:
        lines = sort_by_verdict([line for line in comparison.differences if line.gated])
        slopes = [slope_chart(line, number) for number, line in enumerate(lines, start=1) if line.clips]
        intervals = interval_charts(comparison, True), interval_charts(comparison, False)
        pictures, missing = ComparisonCharts(slopes, *intervals), []
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, comparison_page(comparison, pictures, missing))
    return path
