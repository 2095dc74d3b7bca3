"""The page of a paper in a browser, at the widths of a desktop and of a phone: it fits, and it loads nothing."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from harness.report.paper.page import write_paper_page
from tests.report.fabricate_paper import liu, write_study


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_paper_page(write_study(tmp_path_factory.mktemp("browser") / "study", liu()))


@pytest.fixture(params=[1280, 390])
def page(request: pytest.FixtureRequest, browser: Any, page_file: Path) -> Iterator[Any]:
    opened = browser.new_page(viewport={"width": request.param, "height": 844})
    opened.goto(page_file.as_uri())
    yield opened
    opened.close()


def test_the_page_is_whole(page: Any) -> None:
    width = page.viewport_size["width"]
    page.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") <= width, "the page scrolls sideways"
    page.evaluate("Promise.all([...document.images].map((image) => image.decode()))")
    sizes = page.evaluate("[...document.images].map((image) => [image.naturalWidth, image.naturalHeight, image.alt])")
    assert len(sizes) == 3
    assert all(w > 0 and h > 0 and alt for w, h, alt in sizes)


def test_the_page_asks_nothing_of_anyone(browser: Any, page_file: Path) -> None:
    seen: list[str] = []
    opened = browser.new_page()
    opened.on("request", lambda r: None if r.url.startswith(("data:", page_file.as_uri())) else seen.append(r.url))
    opened.on("console", lambda message: seen.append(message.text))
    opened.on("pageerror", lambda error: seen.append(str(error)))
    opened.goto(page_file.as_uri())
    assert seen == []
    opened.close()


def test_each_figure_of_a_claim_has_its_name_beside_it_on_a_phone(page: Any) -> None:
    """The head of the table is not shown there, but read out; the rows are still rows of a table."""
    phone = page.viewport_size["width"] < 640
    name = "(cell) => getComputedStyle(cell, '::before').content"
    cell = page.get_by_role("table", name="claims", exact=True).locator("td").first
    assert cell.evaluate(name) == ('"kind"' if phone else "none")
    table = page.get_by_role("table", name="claims", exact=True)
    assert table.get_by_role("columnheader").count() == 7
    assert table.get_by_role("rowheader").count() == 16 + 4
    assert table.get_by_role("cell", name="reproduced").first.is_visible()
