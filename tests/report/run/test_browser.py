"""The page in a browser: headless Chromium opens it, nothing leaves it, and the 3-D view follows the slider."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from harness.report.run.page import write_run_page
from tests.planted import Plan, planted_run


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run; rendered where that is possible."""
    plan = Plan(methods={"ik": 2.0, "mean_pose": 12.0}, behaviours=("walking",), duration_s=4.0)
    return write_run_page(planted_run(tmp_path_factory.mktemp("browser") / "run", plan))


@pytest.fixture
def seen() -> dict[str, list[str]]:
    """What went wrong while a page was open."""
    return {"requests": [], "errors": []}


def _noted(dialog: Any, errors: list[str]) -> None:
    errors.append(dialog.message)
    dialog.dismiss()


@pytest.fixture(params=[1280, 390])
def page(request: pytest.FixtureRequest, browser: Any, page_file: Path, seen: dict[str, list[str]]) -> Iterator[Any]:
    """The page at desktop and at phone width."""
    opened = browser.new_page(viewport={"width": request.param, "height": 844})
    outside = ("data:", "blob:", page_file.as_uri())
    opened.on("request", lambda r: None if r.url.startswith(outside) else seen["requests"].append(r.url))
    opened.on("console", lambda m: seen["errors"].append(m.text) if m.type == "error" else None)
    opened.on("pageerror", lambda error: seen["errors"].append(str(error)))
    opened.on("dialog", lambda dialog: _noted(dialog, seen["errors"]))
    opened.goto(page_file.as_uri())
    yield opened
    opened.close()


def test_the_page_is_whole_and_quiet(page: Any, seen: dict[str, list[str]]) -> None:
    width = page.viewport_size["width"]
    assert page.evaluate("document.documentElement.scrollWidth") <= width, "the page scrolls sideways"
    page.evaluate("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    assert page.evaluate("document.documentElement.scrollWidth") <= width, "it does once everything is unfolded"
    page.evaluate("Promise.all([...document.images].map((image) => image.decode()))")
    sizes = page.evaluate("[...document.images].map((image) => [image.naturalWidth, image.naturalHeight, image.alt])")
    assert len(sizes) >= 3
    assert all(w > 0 and h > 0 and alt for w, h, alt in sizes)
    assert seen == {"requests": [], "errors": []}


@pytest.mark.long
def test_the_view_in_3d_shows_every_clip_and_method(page: Any, seen: dict[str, list[str]]) -> None:
    assert not page.evaluate("'ready' in player.dataset"), "the view is unpacked before it is needed"
    page.locator(".stage").scroll_into_view_if_needed()
    page.wait_for_selector("#player[data-ready]", timeout=60_000)
    assert page.locator("select[name=method0] option").all_inner_texts() == ["ik", "mean_pose"]
    assert page.locator("select[name=clip] option").all_inner_texts() == ["walking_p1_01"]
    assert len(page.locator("select[name=moment] option").all_inner_texts()) > 2
    page.locator(".motion-player input[type=range]").fill("50")
    assert "frame 51 of 1" in page.inner_text(".motion-player")
    page.wait_for_selector("#player[data-drawn='50']")
    assert page.evaluate("document.documentElement.scrollWidth") <= page.viewport_size["width"]
    assert seen == {"requests": [], "errors": []}
