"""The page of a run as a reader uses it: what the first screen shows, values under the pointer, the legend."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.report.run.data import read_run
from harness.report.run.page import write_run_page
from tests.planted import Plan, planted_run

pytestmark = pytest.mark.long
METHODS = {"expert_map": 1.0, "ik": 4.0} | {f"method_{n}": 2.0 + n for n in range(11)}


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of 13 methods with its page; rendered where that is possible."""
    plan = Plan(methods=METHODS, behaviours=("walking",), takes=2, duration_s=4.0)
    out = planted_run(tmp_path_factory.mktemp("first") / "run", plan)
    write_run_page(out)
    return out


@pytest.fixture
def page(browser: Any, run_folder: Path) -> Iterator[Any]:
    opened = browser.new_page(viewport={"width": 1400, "height": 900})
    opened.goto((run_folder / "report.html").as_uri())
    yield opened
    opened.close()


def test_the_first_screen_has_verdict_ranking_and_picture_and_3d_follows(page: Any) -> None:
    bottoms = []
    for selector in ("h1", ".verdict-text", ".overview .chart img", ".overview .still"):
        box = page.locator(selector).bounding_box()
        bottoms.append(box["y"] + box["height"])
    assert max(bottoms) <= 900
    assert "expert_map has the lowest" in page.inner_text("h1")
    assert page.locator(".overview .chart img").get_attribute("alt").startswith("Mean joint angle error")
    assert "Truth and estimate" in page.locator(".overview .still").evaluate(
        "(still) => still.querySelector('img')?.alt ?? `Truth and estimate: ${still.innerText}`"
    )
    look = page.locator("#look").bounding_box()
    assert look["y"] <= 1000
    assert page.evaluate("document.querySelector('main > section').id") == "look"


def test_a_picture_that_is_missing_is_explained_in_its_place(browser: Any, run_folder: Path, tmp_path: Path) -> None:
    out = planted_run(tmp_path / "run", Plan(methods={"ik": 2.0}, behaviours=("walking",), duration_s=2.5))
    opened = browser.new_page(viewport={"width": 1400, "height": 900})
    opened.goto(write_run_page(out, rendered=False).as_uri())
    text = opened.locator(".overview .still").inner_text()
    assert text == "There is no picture of truth and estimate: rendering was turned off."
    opened.close()


def chart(page: Any) -> Any:
    """The first chart of errors over time, in view."""
    figure = page.locator("#time [data-hover]").first
    figure.scroll_into_view_if_needed()
    page.wait_for_selector("#time [data-ready]")
    return figure


def point_at(page: Any, figure: Any, time_s: float, error_deg: float) -> str:
    """Move the pointer to a place of the chart; returns the note there, "" without one."""
    plot = json.loads(figure.get_attribute("data-hover"))["plots"][0]
    left, top, right, bottom = plot["box"]
    (t0, t1), (low, high) = plot["x"]["limits"], np.log(plot["y"]["limits"])
    x = left + (time_s - t0) / (t1 - t0) * (right - left)
    y = bottom - (np.log(error_deg) - low) / (high - low) * (bottom - top)
    place = figure.locator("svg").evaluate(
        "(svg, [x, y]) => { const p = new DOMPoint(x, y).matrixTransform(svg.getScreenCTM()); return [p.x, p.y]; }",
        [float(x), float(y)],
    )
    page.mouse.move(*place)
    note = figure.locator(".hover-note")
    return str(note.inner_text()) if note.is_visible() else ""


def test_the_value_under_the_pointer_is_that_of_the_run(page: Any, run_folder: Path) -> None:
    figure = chart(page)
    run = read_run(run_folder)
    clip = page.locator("#time figcaption").first.inner_text().split(",")[0]
    for series in ("expert_map", "ik"):
        trace = next(trace for trace in run.traces if (trace.series, trace.clip) == (series, clip))
        row = int(np.flatnonzero(trace.scored)[40])
        time_s, error_deg = float(trace.time_s[row]), float(trace.errors["joint_angle_mean_deg"][row])
        note = point_at(page, figure, time_s, error_deg)
        assert note.startswith(series)
        value, unit, _, when, second = note.split(")")[-1].split()
        assert (unit, second) == ("deg", "s")
        assert float(value) == pytest.approx(error_deg, rel=0.03, abs=0.01)
        assert float(when) == pytest.approx(time_s, abs=0.02)
    page.mouse.move(1, 1)
    assert not figure.locator(".hover-note").is_visible()


def test_the_legend_hides_and_shows_a_line_by_click_and_by_key(page: Any) -> None:
    figure = chart(page)
    names = json.loads(figure.get_attribute("data-hover"))["names"]
    assert names[:2] == ["expert_map (lowest mean)", "ik (control)"]
    line, key = figure.locator('[data-series="1"]'), figure.get_by_role("button", name="ik (control)")
    assert line.is_visible()
    key.click()
    assert not line.is_visible()
    assert key.get_attribute("aria-pressed") == "false"
    key.press("Enter")
    assert line.is_visible()
    assert key.get_attribute("aria-pressed") == "true"
    assert figure.get_by_role("button").count() == len(names) == 13


def test_only_leader_and_control_are_coloured_and_no_line_looks_like_another(page: Any) -> None:
    figure = chart(page)
    looks = figure.evaluate(
        """(figure) => [...figure.querySelectorAll("[data-series]")]
          .sort((a, b) => a.dataset.series - b.dataset.series).map((line) => {
          const style = getComputedStyle(line.querySelector(":scope > path"));
          const marker = line.querySelector("use")?.getAttribute("xlink:href") ?? "";
          return [style.stroke, style.strokeDasharray, marker];
        })"""
    )
    assert len(looks) == 13
    assert [look[0] for look in looks[:2]] == ["rgb(0, 114, 178)", "rgb(213, 94, 0)"]
    assert {look[0] for look in looks[2:]} == {"rgb(152, 161, 171)"}
    assert len(set(map(tuple, looks))) == 13


def test_without_scripts_the_chart_is_a_whole_picture(browser: Any, run_folder: Path) -> None:
    context = browser.new_context(java_script_enabled=False)
    opened = context.new_page()
    opened.goto((run_folder / "report.html").as_uri())
    figure = opened.locator("#time .chart").first
    assert figure.locator("[data-series]").count() == 13
    assert figure.locator("[data-key] text").count() == 13
    assert figure.locator("svg").bounding_box()["height"] > 200
    context.close()


def test_each_joint_of_the_body_tells_its_value(page: Any) -> None:
    titles = page.locator("#joints svg title").all_text_contents()
    assert len(titles) == 4 * 22
    assert any(title.startswith("left femur: ") and title.endswith(" deg (expert_map)") for title in titles)
    assert any(title.startswith("right hand: ") and title.endswith(" mm (ik)") for title in titles)


def test_no_name_in_the_page_is_given_twice(page: Any) -> None:
    names = page.evaluate("[...document.querySelectorAll('[id]')].map((each) => each.id)")
    assert len(names) == len(set(names))
