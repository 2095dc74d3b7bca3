"""Writes the page of a comparison; re-exports its text for the terminal."""

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
    """Write the page to `path` and return it; its folder is created."""
    lines = sort_by_verdict([line for line in comparison.differences if line.gated])
    slopes = [slope_chart(line, number) for number, line in enumerate(lines, start=1) if line.clips]
    intervals = interval_charts(comparison, True), interval_charts(comparison, False)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, comparison_page(comparison, ComparisonCharts(slopes, *intervals)))
    return path
