"""The page of the tracker's physics: verdicts come first, a missed row is shown as missed, charts have numbers."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadInput, ShapeError
from harness.report.physics.page import result_sentence, write_physics_page
from tests.report.fabricate_physics import ROWS, made_up, statistics, without_episodes
from tests.report.reading import read, text_of


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_physics_page(tmp_path_factory.mktemp("physics") / "new" / "physics.html", made_up())


def test_the_heading_counts_the_verdicts_and_names_what_is_missed(page: Path) -> None:
    heading = "Of 3 rows of the truth table, physics meets 1, misses 1 (free motion in 1 m³) and has no verdict on 1."
    assert heading in text_of(page)
    assert result_sentence("physics", ROWS[:1]) == "Of 1 row of the truth table, physics meets 1."
    assert result_sentence("physics", ROWS[1:2]).endswith("physics meets 0 and misses 1 (free motion in 1 m³).")
    assert "not held to any" in result_sentence("physics", ())


def test_each_row_has_its_range_its_figure_and_its_verdict(page: Path) -> None:
    text = text_of(page)
    first, second, third = (text.index(row.text, text.index("condition")) for row in ROWS)
    assert "1.0 to 2.0 mm 1.54 mm ✓ met 1.5 mm RMS" in text[first:second]
    assert "14 of 20 seeds; largest 6.2 cm the gate lets fewer echoes in ✗ missed up to 3 cm" in text[second:third]
    assert "RMS rises at each step not measured – no verdict –" in text[third:]


def test_each_chart_has_an_alternative_text_and_its_numbers(page: Path) -> None:
    pictures = [a for name, a in read(page).found if name in ("img", "svg") and (a.get("alt") or a.get("aria-label"))]
    assert len(pictures) == 4
    text = text_of(page)
    assert text.count("Numbers of this chart") == 4
    assert "made-up errors of physics" in text
    assert all(
        f"{title}. " in text.replace(" .", ".") for title in ("Spectrum of the position error", "Duration of gaps")
    )
    assert "(physics: 600 segments; noise = default: 600 segments)" in text
    assert "physics: 30 excursions; noise = default: 50 excursions." in text
    assert text.count("begins or ends within count with the part that was seen") == 2


def test_the_summary_has_rates_per_minute_and_station(page: Path) -> None:
    text = text_of(page)
    assert "minutes, summed over stations 120.0 120.0" in text
    assert "excursions above 10 mm, per minute 0.25 0.42" in text
    assert "median error [mm] 1.50 1.50" in text
    assert "gaps per minute 0.25 0.42" in text
    assert "share of the readings lost 1.00 % 1.00 %" in text
    sizes = (f"{1e3 * np.median(model.excursion_peak_m):.1f}" for model in made_up().models)
    assert f"median size of an excursion [mm] {' '.join(sizes)}" in text


def test_numbers_of_the_charts(page: Path) -> None:
    text = text_of(page)
    assert "0.1 100 100" in text  # the spectrum: 1e-6 m^2/Hz over the square of 0.1 Hz, in mm^2/Hz
    assert "number 30 50 30 50" in text
    longest = (f"{model.excursion_s.max():.2f}" for model in made_up().models)
    assert f"longest or largest {' '.join(longest)}" in text
    assert "lost 1.00 % 1.00 % – – – –" in text
    assert "0 to 0.1 1.00 % 1.00 % not measured not measured not measured not measured" in text
    assert "0.9 to 1 90.00 % 90.00 % 2.0 4.0 2.0 4.0" in text


def test_models_without_episodes_have_charts_and_dashes(tmp_path: Path) -> None:
    text = text_of(write_physics_page(tmp_path / "page.html", without_episodes()))
    assert "median duration of a gap [s] –" in text
    assert "clean: 0 excursions" in text
    assert "begins or ends within" not in text
    assert "truth table" not in text


def test_the_same_comparison_gives_the_same_bytes(page: Path, tmp_path: Path) -> None:
    assert write_physics_page(tmp_path / "again.html", made_up()).read_bytes() == page.read_bytes()


def test_records_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="no error model"):
        write_physics_page(tmp_path / "page.html", replace(made_up(), models=()))
    with pytest.raises(ShapeError, match="quality_share"):
        replace(statistics(), quality_share=np.zeros(10))
    with pytest.raises(ShapeError, match="excursion"):
        replace(statistics(), excursion_peak_m=np.zeros(2))
    with pytest.raises(ShapeError, match="density_m2_hz"):
        replace(statistics(), density_m2_hz=np.zeros(2))
    with pytest.raises(ShapeError, match="error_m"):
        replace(statistics(), error_m=np.zeros(2))
