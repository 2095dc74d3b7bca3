"""The page of the tracker's physics: verdicts come first, a missed row is shown as missed, charts have numbers."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.core.number_format import format_share
from harness.errors import BadInput, ShapeError
from harness.report.physics.error_comparison import ErrorModelComparison
from harness.report.physics.page import result_sentence, write_physics_page
from tests.report.reading import count_pictures, emptied, numbers_in_order, text_of

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, error_models: ErrorModelComparison) -> Path:
    return write_physics_page(tmp_path_factory.mktemp("physics") / "new" / "physics.html", error_models)


def test_the_heading_counts_the_verdicts_and_names_what_is_missed(
    page: Path, error_models: ErrorModelComparison
) -> None:
    rows = error_models.rows
    heading = "Of 3 rows of the truth table, physics meets 1, misses 1 (free motion) and has no verdict on 1."
    assert heading in text_of(page)
    assert result_sentence("physics", rows[:1]) == "Of 1 row of the truth table, physics meets 1."
    assert result_sentence("physics", rows[1:2]).endswith("physics meets 0 and misses 1 (free motion).")
    assert "not held to any" in result_sentence("physics", ())


def test_each_row_has_its_range_its_figure_and_its_verdict(page: Path) -> None:
    text = text_of(page)
    assert "static 1.0 to 2.0 mm 1.54 mm ✓ met 1.5 mm RMS" in text
    assert "free motion excursions in 18 of 20 seeds 14 of 20 seeds fewer echoes ✗ missed 3 cm" in text
    assert "RMS rises at each step not measured – no verdict –" in text


def test_each_chart_has_an_alternative_text_and_its_numbers(page: Path, error_models: ErrorModelComparison) -> None:
    text, (first, second) = text_of(page), error_models.models
    assert count_pictures(page) == text.count("Numbers of this chart") == 4
    assert first.source in text
    for title in ("Spectrum of the position error", "Duration of gaps"):
        assert f"{title}. " in text.replace(" .", ".")
    for model in (first, second):
        assert f"{model.label}: {model.segments} segment" in text
        assert f"{model.label}: {len(model.excursion_s)} excursion" in text
        assert f"{model.label}: {len(model.gap_s)} gap" in text
        assert text.count("begins or ends within count with the part that was seen") == 2 * bool(
            first.truncated or second.truncated
        )


def test_the_summary_has_rates_per_minute_and_station(page: Path, error_models: ErrorModelComparison) -> None:
    text = text_of(page)
    for name, value in (
        ("minutes, summed over stations", lambda m: f"{m.station_s / 60.0:.1f}"),
        ("median error [mm]", lambda m: f"{1e3 * m.error_m[0]:.2f}"),
        ("excursions above 10 mm, per minute", lambda m: f"{60.0 * len(m.excursion_s) / m.station_s:.2f}"),
        ("median size of an excursion [mm]", lambda m: f"{1e3 * np.median(m.excursion_peak_m):.1f}"),
        ("gaps per minute", lambda m: f"{60.0 * len(m.gap_s) / m.station_s:.2f}"),
        ("share of the readings lost", lambda m: format_share(m.lost_share, 2)),
        ("longest or largest", lambda m: f"{m.excursion_s.max():.2f}"),
        ("lost", lambda m: format_share(float(m.quality_share[0]), 2)),
        ("0.9 to 1", lambda m: format_share(float(m.quality_share[-1]), 2)),
    ):
        assert f"{name} {' '.join(map(value, error_models.models))}" in text, name
    last = [f"{1e3 * model.class_error_m[-1, k]:.1f}" for model in error_models.models for k in (0, 1)]
    assert numbers_in_order(text, "0.9 to 1 ", *last)


def test_a_model_without_episodes_has_charts_and_dashes(tmp_path: Path, error_models: ErrorModelComparison) -> None:
    none = emptied(("excursion_s", "excursion_peak_m", "gap_s"), np.zeros(0))
    model = replace(error_models.models[0], truncated=0, label="clean", **none)
    text = text_of(write_physics_page(tmp_path / "page.html", replace(error_models, models=(model,), rows=())))
    assert "median duration of a gap [s] –" in text
    assert "clean: 0 excursions" in text
    assert "begins or ends within" not in text
    assert "truth table" not in text


def test_the_same_comparison_gives_the_same_bytes(
    page: Path, tmp_path: Path, error_models: ErrorModelComparison
) -> None:
    assert write_physics_page(tmp_path / "again.html", error_models).read_bytes() == page.read_bytes()


def test_records_that_do_not_fit_are_refused(tmp_path: Path, error_models: ErrorModelComparison) -> None:
    with pytest.raises(BadInput, match="no error model"):
        write_physics_page(tmp_path / "page.html", replace(error_models, models=()))
    for name in ("quality_share", "excursion_peak_m", "density_m2_hz", "error_m"):
        with pytest.raises(ShapeError, match=name):
            replace(error_models.models[0], **emptied([name], np.zeros(97)))
