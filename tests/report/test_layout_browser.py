"""Every kind of page in a browser, at 1400 and 700 pixels and in print, light and dark: nothing is cut."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from harness.measure.reports import UnitReport, ValidationReport
from harness.report.comparison.page import write_comparison_page
from harness.report.coverage.content import CoverageContent
from harness.report.coverage.page import coverage_page
from harness.report.kit.page_html import write_page
from harness.report.lab.trust_page import trust_page
from harness.report.lab.unit_page import unit_page
from harness.report.lab.validation_page import validation_page
from harness.report.paper.page import write_paper_page
from harness.report.physics.error_comparison import ErrorModelComparison
from harness.report.physics.page import write_physics_page
from harness.report.placement.page import write_placement_page
from harness.report.run.page import write_run_page
from harness.report.sweep.page import write_sweep_page
from harness.results.findings import TrustFindings
from tests.planted import Plan, planted_run, planted_sweep
from tests.report.comparison.compared import compared
from tests.report.paper.findings import liu, write_study
from tests.report.sweep.test_page import VARIED

pytestmark = pytest.mark.long
KINDS = ("run", "comparison", "sweep", "placement", "paper", "physics", "coverage", "unit", "trust", "validation")
PRINTED_PX = 703
"""Width of an A4 page within margins of 12 mm, at 96 pixels an inch."""
UNFOLD = "document.querySelectorAll('details').forEach((each) => { each.open = true; })"
BEYOND = """(width) => [...document.querySelectorAll("body *")]
  .filter((each) => each.checkVisibility() && !(each.ownerSVGElement))
  .filter((each) => each.getBoundingClientRect().right > width + 1)
  .map((each) => `${each.tagName} ${each.className}: ${each.textContent.slice(0, 40)}`)"""
SCROLLING = """() => [...document.querySelectorAll(".wide")].filter((box) => box.checkVisibility())
  .map((box) => [box.scrollWidth > box.clientWidth + 2, box.nextElementSibling.checkVisibility()])"""

SMALLEST_PX, LARGEST_BYTES, SCREEN_PX = 11.0, 1_500_000, 900
TEXT_SIZES = """() => {
  const sizes = [], words = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (words.nextNode()) {
    const element = words.currentNode.parentElement, drawn = element.closest("svg");
    const unseen = element.closest("script, style, title, option, noscript") || !element.checkVisibility();
    if (unseen || !words.currentNode.data.trim()) continue;
    const scale = drawn ? Math.hypot(element.getScreenCTM().a, element.getScreenCTM().b) : 1;
    sizes.push([scale * parseFloat(getComputedStyle(element).fontSize), words.currentNode.data.trim()]);
  }
  for (const image of document.images) {
    if (!image.src.startsWith("data:image/svg+xml;base64,") || !image.checkVisibility()) continue;
    const bytes = Uint8Array.from(atob(image.src.split(",")[1]), (letter) => letter.charCodeAt(0));
    const svg = new DOMParser().parseFromString(new TextDecoder().decode(bytes), "image/svg+xml").documentElement;
    const scale = image.getBoundingClientRect().width / svg.viewBox.baseVal.width;
    for (const text of svg.querySelectorAll("text")) {
      const size = text.getAttribute("style").match(/font(?:-size)?:[^;]*?([0-9.]+)px/)[1];
      sizes.push([scale * parseFloat(size), text.textContent]);
    }
  }
  return sizes;
}"""
"""Size of each text of a page [px], also of those in pictures, and the text."""


@pytest.fixture(scope="module")
def pages(
    tmp_path_factory: pytest.TempPathFactory,
    unit_with_faults: UnitReport,
    late_capture: ValidationReport,
    trust_findings: TrustFindings,
    error_models: ErrorModelComparison,
    coverages: tuple[CoverageContent, CoverageContent],
    placement_study: Path,
) -> dict[str, Path]:
    """Kind -> the file of its page."""
    folder = tmp_path_factory.mktemp("pages")
    methods = {f"a_method_with_a_long_name_{n}": 1.0 + n for n in range(12)} | {"ik": 3.0}
    plan = Plan(behaviours=("walking", "boxing"), methods=methods, failing=("ik",))
    (folder / "placement").mkdir()
    shutil.copy(placement_study / "findings.json", folder / "placement")
    placement = write_placement_page(folder / "placement")
    shown = {
        "coverage": coverage_page(coverages[1]),
        "unit": unit_page(unit_with_faults, "harness characterize"),
        "validation": validation_page(late_capture, {"ik": {"mpjpe_mm": 41.2}}, "harness validate"),
        "trust": trust_page(trust_findings, "harness trust plan.toml"),
    }
    return {
        **{kind: write_page(page, folder / f"{kind}.html") for kind, page in shown.items()},
        "run": write_run_page(planted_run(folder / "run", plan), rendered=False),
        "comparison": write_comparison_page(compared({"local_pca": 0.05}, 7), folder / "comparison.html"),
        "sweep": write_sweep_page(planted_sweep(folder / "sweep", VARIED)),
        "placement": placement,
        "paper": write_paper_page(write_study(folder / "paper", liu())),
        "physics": write_physics_page(folder / "physics.html", error_models),
    }


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [1400, 700])
@pytest.mark.parametrize("kind", KINDS)
def test_a_page_fits_the_window_and_says_what_scrolls(
    browser: Any, pages: dict[str, Path], kind: str, width: int, scheme: str
) -> None:
    page = browser.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    page.goto(pages[kind].as_uri())
    page.evaluate(UNFOLD)
    page.wait_for_timeout(100)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    boxes = page.evaluate(SCROLLING)
    assert boxes
    assert all(scrolls == hinted for scrolls, hinted in boxes)
    if width == 700 and kind in ("run", "comparison"):
        assert any(scrolls for scrolls, _ in boxes)
    light = page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert light == (scheme == "light")
    page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_cut_in_print(browser: Any, pages: dict[str, Path], kind: str, scheme: str) -> None:
    page = browser.new_page(viewport={"width": PRINTED_PX, "height": 1030})
    page.goto(pages[kind].as_uri())
    page.emulate_media(media="print", color_scheme=scheme)
    page.evaluate(UNFOLD)
    assert page.evaluate(BEYOND, PRINTED_PX) == []
    assert not any(scrolls for scrolls, _ in page.evaluate(SCROLLING))
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    page.close()


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_is_small_and_its_first_screen_has_verdict_and_picture(
    browser: Any, pages: dict[str, Path], kind: str
) -> None:
    assert pages[kind].stat().st_size <= LARGEST_BYTES
    page = browser.new_page(viewport={"width": 1400, "height": SCREEN_PX})
    page.goto(pages[kind].as_uri())
    assert page.evaluate(
        "[...document.querySelector('header').children].slice(0, 2).map((each) => each.className || each.tagName)"
    ) == [
        "kicker",
        "H1",
    ]
    verdict = page.locator("h1").bounding_box()
    picture = page.locator("header figure").first.bounding_box()
    assert 0 < verdict["y"] < verdict["y"] + verdict["height"] <= picture["y"] + 1
    assert picture["y"] <= 0.5 * SCREEN_PX
    assert picture["width"] >= 300
    page.close()


@pytest.mark.parametrize("kind", KINDS)
def test_no_text_is_smaller_than_11_pixels(browser: Any, pages: dict[str, Path], kind: str) -> None:
    page = browser.new_page(viewport={"width": 700, "height": SCREEN_PX})
    page.goto(pages[kind].as_uri())
    page.evaluate(UNFOLD)
    for width in (700, 900, 1000, 1150, 1250, 1400):
        page.set_viewport_size({"width": width, "height": SCREEN_PX})
        sizes = page.evaluate(TEXT_SIZES)
        assert len(sizes) > 30
        assert [(width, size, text) for size, text in sizes if size < SMALLEST_PX] == []
    page.close()
