"""The page of a comparison in a browser, at the widths of a desktop and of a phone: it fits, and it loads nothing."""

from pathlib import Path
from typing import Any

import pytest

from harness.report.comparison.page import write_comparison_page
from tests.report.comparison.compared import compared
from tests.report.watching import is_whole_and_quiet


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_comparison_page(compared({"local_pca": 0.05}, 7), tmp_path_factory.mktemp("browser") / "page.html")


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_is_whole_and_quiet(browser: Any, page_file: Path, width: int) -> None:
    images, first = is_whole_and_quiet(browser, page_file, width)
    assert images == 4
    assert "Regressed" in first
