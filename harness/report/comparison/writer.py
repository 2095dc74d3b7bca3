"""A comparison shown: as text for the terminal, and as one offline page that opens on the verdict."""

from importlib.util import find_spec
from pathlib import Path

from harness.compare.comparison import Comparison
from harness.core.files import write_text
from harness.report.comparison.interval_chart import intervals
from harness.report.comparison.page import Pictures, comparison_page
from harness.report.comparison.slope_chart import slopes
from harness.report.comparison.text import text
from harness.report.comparison.wording import in_order

__all__ = ["text", "write_page"]


def write_page(comparison: Comparison, path: Path) -> Path:
    """Write the page to `path`, whose folder is made; returns it. Without matplotlib it has the tables alone."""
    pictures, missing = Pictures(), ["Charts: matplotlib is not installed; their numbers are in the tables"]
    if find_spec("matplotlib") is not None:
        lines = in_order([line for line in comparison.differences if line.gated])
        drawn = [slopes(line, number) for number, line in enumerate(lines, start=1) if line.clips]
        pictures, missing = Pictures(drawn, intervals(comparison, True), intervals(comparison, False)), []
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, comparison_page(comparison, pictures, missing))
    return path
