"""The page of a constellation: its sentence, its tables and its pictures."""

import base64
import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from harness.report.coverage import page as coverage
from harness.report.coverage.content import CoverageContent
from harness.report.coverage.page import (
    coverage_page,
    coverage_sentence,
    dilution_chart,
    heard_chart,
    place_table,
    station_chart,
    station_table,
)
from harness.report.kit.chart import draw_chart
from harness.report.kit.page_html import page_html, write_page
from harness.report.kit.style import Chart
from tests.report.drawing import texts_apart
from tests.report.fabricate_coverage import fabricate_coverage
from tests.report.reading import read, text_of


def written(folder: Path, content: CoverageContent) -> Path:
    return write_page(coverage_page(content), folder / "page.html")


def test_the_heading_names_the_coverage_and_the_station_that_hears_least() -> None:
    assert coverage_sentence(fabricate_coverage()) == (
        "9 emitters: three or more are heard in 90 % of the cube below them, at a median DOP of 1.25; "
        "<b>torso</b> hears three for 25 % of golf_p1_01"
    )
    assert coverage_sentence(fabricate_coverage(stations=False)).endswith("at a median DOP of 1.25")


def test_tables_have_the_numbers() -> None:
    content = fabricate_coverage()
    assert list(place_table(content.rows, 1.0).rows) == [
        ["0 to 2 m", "90.0", "80.0", "6", "1.25"],
        ["1.7 m", "50.0", "0.0", "2", "no fix"],
    ]
    assert list(station_table(content.stations, content.clip).rows) == [
        ["left_hand", "0.0", "0.0", "10.0", "90.0", "85.0", "1.50"],
        ["<b>torso</b>", "25.0", "25.0", "25.0", "25.0", "20.0", "no fix"],
    ]


def test_the_page_is_whole_and_escapes_names(tmp_path: Path) -> None:
    page = written(tmp_path, fabricate_coverage("<i>x</i>"))
    text = text_of(page)
    assert "By place" in text
    assert "By station" in text
    assert "<b>torso</b>" in text
    assert not [tag for tag, _ in read(page).found if tag == "i"]
    assert len([tag for tag, _ in read(page).found if tag == "img"]) == 3


def test_a_page_without_a_clip_has_no_stations(tmp_path: Path) -> None:
    text = text_of(written(tmp_path, fabricate_coverage(stations=False)))
    assert "By station" not in text
    assert "Clip" not in text


def figure_of(monkeypatch: pytest.MonkeyPatch, chart: Callable[[CoverageContent], Chart]) -> Any:
    """The figure of a chart, drawn as in its file."""
    kept: list[Figure] = []

    def draw_and_keep(
        name: str, title: str, caption: str, alt: str, draw: Callable[[Figure], None], height_in: float
    ) -> Chart:
        def keep(figure: Figure) -> None:
            draw(figure)
            kept.append(figure)

        return draw_chart(name, title, caption, alt, keep, height_in)

    monkeypatch.setattr(coverage, "draw_chart", draw_and_keep)
    chart(fabricate_coverage())
    return kept[0]


@pytest.mark.parametrize("chart", [heard_chart, dilution_chart, station_chart])
def test_texts_of_charts_do_not_overlap(
    chart: Callable[[CoverageContent], Chart], monkeypatch: pytest.MonkeyPatch
) -> None:
    texts_apart(figure_of(monkeypatch, chart))


@pytest.mark.parametrize(
    ("chart", "expected"),
    [
        (heard_chart, ["0", "1", "2", "3", "4 to 5", "6 to 8", "9 to 12", "13 or more"]),
        (dilution_chart, ["below 1", "1 to 1.5", "1.5 to 2", "2 to 3", "3 to 5", "5 to 10", "10 or more"]),
    ],
)
def test_every_colour_has_its_name(
    chart: Callable[[CoverageContent], Chart], expected: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    figure = figure_of(monkeypatch, chart)
    assert [label.get_text() for label in figure.axes[-1].get_xticklabels()] == expected


def test_a_plan_view_has_forward_at_the_top_and_right_on_the_right(monkeypatch: pytest.MonkeyPatch) -> None:
    axes = figure_of(monkeypatch, heard_chart).axes[0]
    (image,) = axes.get_images()
    assert image.origin == "lower"
    np.testing.assert_allclose(image.get_extent(), [-2.1, 2.1, -3.1, 3.1])
    content = fabricate_coverage()
    np.testing.assert_array_equal(np.asarray(image.get_array()), content.views[0].heard)
    (dots,) = axes.get_lines()
    np.testing.assert_array_equal(np.transpose(dots.get_data()), content.emitter_m[:, [1, 0]])


def test_bars_of_a_station_add_up_to_the_whole_time(monkeypatch: pytest.MonkeyPatch) -> None:
    axes = figure_of(monkeypatch, station_chart).axes[0]
    ends = [max(bar.get_x() + bar.get_width() for bar in axes.patches[row::2]) for row in (0, 1)]
    assert ends == pytest.approx([100.0, 100.0])


def test_the_same_content_gives_the_same_page() -> None:
    pages = [page_html(coverage_page(fabricate_coverage())) for _ in range(2)]
    assert pages[0] == pages[1]


def test_places_without_a_fix_have_no_colour() -> None:
    from PIL import Image

    svg = dilution_chart(fabricate_coverage()).svg
    data = re.search(r"data:image/png;base64,\s*([A-Za-z0-9+/=\s]+)", svg)
    assert data is not None
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(data[1]))).convert("RGBA"))
    assert picture[0, 0, 3] == 0
    assert picture[picture.shape[0] // 2, picture.shape[1] // 2, 3] == 255
