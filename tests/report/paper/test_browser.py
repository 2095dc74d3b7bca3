"""The page of a paper in a browser, at the widths of a desktop and of a phone: it fits, and it loads nothing."""

from pathlib import Path
from typing import Any

import pytest

from harness.report.paper.page import write_paper_page
from tests.report.paper.findings import liu, write_study
from tests.report.watching import is_whole_and_quiet


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_paper_page(write_study(tmp_path_factory.mktemp("browser") / "study", liu()))


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_is_whole_and_quiet(browser: Any, page_file: Path, width: int) -> None:
    assert is_whole_and_quiet(browser, page_file, width)[0] == 3


@pytest.mark.parametrize("width", [1280, 390])
def test_each_figure_of_a_claim_has_its_name_beside_it_on_a_phone(browser: Any, page_file: Path, width: int) -> None:
    """The head of the table is not shown there, but read out; the rows are still rows of a table."""
    page = browser.new_page(viewport={"width": width, "height": 844})
    page.goto(page_file.as_uri())
    name = "(cell) => getComputedStyle(cell, '::before').content"
    cell = page.get_by_role("table", name="claims", exact=True).locator("td").first
    assert cell.evaluate(name) == ('"kind"' if width < 640 else "none")
    table = page.get_by_role("table", name="claims", exact=True)
    assert table.get_by_role("columnheader").count() == 7
    claims = [len(experiment.claims) for experiment in liu().experiments if experiment.claims]
    assert table.get_by_role("rowheader").count() == sum(claims) + len(claims)
    assert table.get_by_role("cell", name="reproduced").first.is_visible()
    page.close()
