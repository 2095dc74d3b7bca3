"""Statistics of made-up errors whose excursions, gaps and classes of quality are known."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.bench.physics.error_statistics import RecordedErrors, error_statistics
from harness.errors import BadInput
from harness.report.physics.error_comparison import ErrorModelComparison
from harness.report.physics.page import write_physics_page
from tests.report.reading import text_of

RATE_HZ, SAMPLES = 40.0, 1200


def recording() -> RecordedErrors:
    """Thirty seconds of two stations: one is 3 cm off for 2 s, the other is lost for 1 s with a large error."""
    error_m = np.zeros((SAMPLES, 2, 3))
    error_m[:, :, 0] = 0.001
    error_m[400:480, 0] = [0.0, 0.03, 0.0]
    quality = np.ones((SAMPLES, 2))
    quality[400:480, 0] = 0.35
    error_m[600:640, 1] = 5.0
    quality[600:640, 1] = 0.0
    return RecordedErrors(np.arange(SAMPLES) / RATE_HZ, error_m, quality)


def test_episodes_are_pooled_over_stations_and_recordings() -> None:
    found = error_statistics("physics", "made up", [recording(), recording()])
    assert (found.label, found.source, found.recordings, found.readings) == ("physics", "made up", 2, 4 * SAMPLES)
    assert found.station_s == pytest.approx(120.0)
    np.testing.assert_allclose(found.excursion_s, [2.0, 2.0])
    np.testing.assert_allclose(found.excursion_peak_m, [0.03, 0.03])
    np.testing.assert_allclose(found.gap_s, [1.0, 1.0])
    assert found.truncated == 0
    assert found.per_minute(len(found.gap_s)) == pytest.approx(1.0)


def test_a_lost_reading_has_no_error() -> None:
    found = error_statistics("physics", "made up", [recording()])
    assert found.lost_share == pytest.approx(40 / 2400)
    np.testing.assert_allclose(found.error_m[0], 0.001)
    assert found.error_m[2] == pytest.approx(0.03)
    assert found.segments == 5 + 2 + 1  # of 10 s in 30 s of one station, in 15 s and in 14 s of the other
    assert 1e6 * found.density_m2_hz.max() < 1e6


def test_quality_has_classes_that_include_their_upper_end() -> None:
    quality = np.array([0.0, 1e-6, 0.1, 0.1 + 1e-6, 0.5, 0.95, 1.0, 1.0])[:, None]
    error_m = np.zeros((8, 1, 3))
    error_m[:, 0, 2] = np.arange(8) / 1000.0
    found = error_statistics("a", "b", [RecordedErrors(np.arange(8) / 8.0, error_m, quality)], segment_s=0.5)
    counts = 8.0 * found.quality_share
    np.testing.assert_allclose(counts, [1, 2, 1, 0, 0, 1, 0, 0, 0, 0, 3])
    np.testing.assert_allclose(found.class_error_m[:, 0], [0.0015, 0.003, *[np.nan] * 2, 0.004, *[np.nan] * 4, 0.006])
    np.testing.assert_allclose(found.error_m, np.quantile([1, 2, 3, 4, 5, 6, 7], [0.5, 0.95, 0.99]) / 1000.0)
    assert found.quality_edges.tolist() == pytest.approx([n / 10 for n in range(11)])


def test_limits_are_those_asked_for() -> None:
    found = error_statistics("a", "b", [recording()], limit_m=0.05, segment_s=5.0)
    assert len(found.excursion_s) == 0
    assert found.frequency_hz[0] == pytest.approx(0.2)
    split = recording()
    split.error_m[440:444, 0] = 0.0
    assert len(error_statistics("a", "b", [split]).excursion_s) == 1
    assert len(error_statistics("a", "b", [split], merge_s=0.05).excursion_s) == 2


def test_recordings_that_cannot_be_pooled_are_refused() -> None:
    one = recording()
    for wrong in (replace(one, time_s=one.time_s**2), replace(one, time_s=-one.time_s)):
        with pytest.raises(BadInput, match="intervals"):
            error_statistics("a", "b", [wrong])
    with pytest.raises(BadInput, match="40 and 20 Hz"):
        error_statistics("a", "b", [one, replace(one, time_s=2.0 * one.time_s)])
    with pytest.raises(BadInput, match="no recording"):
        error_statistics("a", "b", [])


def test_the_statistics_fill_a_page(tmp_path: Path) -> None:
    models = tuple(error_statistics(name, "made up", [recording()]) for name in ("physics", "noise = default"))
    comparison = ErrorModelComparison(models, (), "harness bench physics", 0.01, 0.5, 10.0)
    text = text_of(write_physics_page(tmp_path / "physics.html", comparison))
    assert "physics: 1 excursion; noise = default: 1 excursion." in text
    assert "physics: 1 gap, 1.67 % of the readings" in text


@pytest.mark.parametrize("lost", [False, True])
def test_no_error_or_no_reading_at_all_still_fills_a_page(tmp_path: Path, lost: bool) -> None:
    quality = np.zeros((SAMPLES, 2)) if lost else np.ones((SAMPLES, 2))
    exact = RecordedErrors(np.arange(SAMPLES) / RATE_HZ, np.zeros((SAMPLES, 2, 3)), quality)
    comparison = ErrorModelComparison((error_statistics("clean", "no error", [exact]),), (), "bench", 0.01, 0.5, 10.0)
    text = text_of(write_physics_page(tmp_path / "physics.html", comparison))
    assert f"median error [mm] {'not measured' if lost else '0.00'}" in text
    assert f"clean: {'2 gaps, 100.00 %' if lost else '0 gaps, 0.00 %'} of the readings" in text
    assert f"clean: {'0' if lost else '10'} segments" in text
