"""The page of a timeline in a browser: it fits, it loads nothing, and its links lead to comparisons beside it."""

from pathlib import Path
from typing import Any

import pytest

from harness.compare.timeline import build_timeline
from harness.report.timeline.page import write_timeline_page
from tests.commands.test_timeline import METRICS, entry
from tests.compare.sides import write_run
from tests.report.watching import is_whole_and_quiet


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("timeline")
    runs = [str(write_run(folder / f"r{number}", entry(number))) for number in range(1, 10)]
    return write_timeline_page(build_timeline(runs, metrics=METRICS.split(",")), folder / "t.html")


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_is_whole_and_quiet(browser: Any, page_file: Path, width: int) -> None:
    _, first = is_whole_and_quiet(browser, page_file, width)
    assert "1 change in 4 series over 9 entries" in first
    assert (page_file.parent / "t_comparisons" / "r5_r6.html".replace("_", "-")).is_file()
