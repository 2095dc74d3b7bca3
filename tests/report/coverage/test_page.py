"""The page of a constellation: its sentence, its tables and its pictures."""

import base64
import io
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from harness.core.number_format import format_fixed
from harness.report.coverage.content import CoverageContent
from harness.report.coverage.page import coverage_page, coverage_sentence, dilution_chart
from harness.report.kit.page_html import render_html, write_page
from tests.report.drawing import draw_page, drawn_figures, points, texts_apart
from tests.report.reading import count_pictures, read, section_ids, text_of

Coverages = tuple[CoverageContent, CoverageContent]


@pytest.fixture(scope="module")
def figures(coverages: Coverages) -> dict[str, Figure]:
    return drawn_figures(lambda: draw_page(coverage_page(coverages[1])))


def test_the_heading_names_the_coverage_and_the_station_that_hears_least(coverages: Coverages) -> None:
    plain, boxing = coverages
    cube = plain.rows[0]
    assert coverage_sentence(plain) == (
        f"9 emitters: three or more are heard in {100.0 * cube.share:.0f} % of the cube below them, at a median DOP of "
        f"{cube.dilution:.2f}"
    )
    least = min(boxing.stations, key=lambda row: row.shares[3])
    hears = f"; {least.station} hears three for {100.0 * least.shares[3]:.0f} % of boxing_p1_01"
    assert coverage_sentence(boxing) == coverage_sentence(plain) + hears


def test_the_page_has_every_number_and_escapes_names(tmp_path: Path, coverages: Coverages) -> None:
    content = replace(coverages[1], name="<i>x</i>")
    page = write_page(coverage_page(content), tmp_path / "page.html")
    text = text_of(page)
    assert section_ids(page) == ["place", "station"]
    assert count_pictures(page) == 3
    assert not [tag for tag, _ in read(page).found if tag == "i"]
    for row in content.rows:
        shares = f"{100.0 * row.share:.1f} {100.0 * row.fixed:.1f}"
        assert f"{row.place} {shares} {format_fixed(row.heard, 0)} {row.dilution:.2f}" in text
    for station in content.stations:
        numbers = [f"{100.0 * share:.1f}" for share in (*station.shares, station.fixed)]
        assert f"{station.station} {' '.join(numbers)} {station.dilution:.2f}" in text


def test_a_place_without_a_fix_has_no_dilution(tmp_path: Path, coverages: Coverages) -> None:
    plain, boxing = coverages
    nowhere = [replace(row, dilution=float("nan")) for row in plain.rows]
    stations = [replace(row, dilution=float("nan")) for row in boxing.stations]
    page = write_page(coverage_page(replace(boxing, rows=nowhere, stations=stations)), tmp_path / "page.html")
    assert text_of(page).count("no fix") >= len(nowhere) + len(stations)


def test_a_page_without_a_clip_has_no_stations(tmp_path: Path, coverages: Coverages) -> None:
    page = write_page(coverage_page(coverages[0]), tmp_path / "page.html")
    assert section_ids(page) == ["place"]
    assert "Clip" not in text_of(page)


def test_every_colour_has_its_name_apart_from_others(figures: dict[str, Figure]) -> None:
    expected = {
        "heard": ["0", "1", "2", "3", "4 to 5", "6 to 8", "9 to 12", "13 or more"],
        "dilution": ["below 1", "1 to 1.5", "1.5 to 2", "2 to 3", "3 to 5", "5 to 10", "10 or more"],
    }
    for name, labels in expected.items():
        assert [label.get_text() for label in figures[name].axes[-1].get_xticklabels()] == labels
    for figure in figures.values():
        texts_apart(figure)


def test_a_plan_view_has_forward_at_the_top_and_right_on_the_right(
    figures: dict[str, Figure], coverages: Coverages
) -> None:
    content = coverages[1]
    for axes, view in zip(figures["heard"].axes, content.views, strict=False):
        (image,), (dots,) = axes.get_images(), axes.get_lines()
        assert image.origin == "lower"
        steps = [0.5 * (each[1] - each[0]) for each in (view.y_m, view.x_m)]
        ends = [end for m, step in zip((view.y_m, view.x_m), steps, strict=True) for end in (m[0] - step, m[-1] + step)]
        np.testing.assert_allclose(image.get_extent(), ends)
        np.testing.assert_array_equal(np.asarray(image.get_array()), view.heard)
        np.testing.assert_array_equal(np.transpose(points(dots)), content.emitter_m[:, [1, 0]])


def test_bars_of_a_station_add_up_to_the_whole_time(figures: dict[str, Figure], coverages: Coverages) -> None:
    (axes,), count = figures["stations"].axes, len(coverages[1].stations)
    ends = [max(bar.get_x() + bar.get_width() for bar in axes.patches[row::count]) for row in range(count)]  # type: ignore[attr-defined]
    assert ends == pytest.approx([100.0] * count)


def test_the_same_content_gives_the_same_page(coverages: Coverages) -> None:
    assert render_html(coverage_page(coverages[1])) == render_html(coverage_page(coverages[1]))


def test_places_without_a_fix_have_no_colour(coverages: Coverages) -> None:
    content = coverages[0]
    dilution = content.views[0].dilution
    assert np.isnan(dilution[0, 0])
    assert np.isfinite(dilution[dilution.shape[0] // 2, dilution.shape[1] // 2])
    svg = dilution_chart(content).svg
    data = re.search(r"data:image/png;base64,\s*([A-Za-z0-9+/=\s]+)", svg)
    assert data is not None
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(data[1]))).convert("RGBA"))
    assert picture[0, 0, 3] == 0
    assert picture[picture.shape[0] // 2, picture.shape[1] // 2, 3] == 255
