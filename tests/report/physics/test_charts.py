"""What the charts draw: curves, bands, scales and names of axes, read off the figures."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from harness.report.physics.charts import (
    excursions_chart,
    gaps_chart,
    quality_chart,
    rates_of_at_least,
    spectrum_chart,
)
from harness.report.physics.error_comparison import ErrorModelComparison
from tests.report.drawing import drawn_figures, points, texts_apart
from tests.report.reading import emptied

pytestmark = pytest.mark.long
CHARTS = (spectrum_chart, excursions_chart, gaps_chart, quality_chart)
LABELS = ["physics", 'noise = "default"']


def figures_of(comparison: ErrorModelComparison) -> dict[str, Figure]:
    return drawn_figures(lambda: [draw(comparison) for draw in CHARTS])


@pytest.fixture(scope="module")
def figures(error_models: ErrorModelComparison) -> dict[str, Figure]:
    return figures_of(error_models)


@pytest.mark.parametrize(
    ("name", "labels", "scales"),
    [
        ("spectrum", [("frequency [Hz]", "density [mm²/Hz]")], ["log log"]),
        (
            "excursions",
            [("duration, at least [s]", "excursions per minute and station"), ("largest error, at least [mm]", "")],
            ["log log", "log log"],
        ),
        ("gaps", [("duration, at least [s]", "gaps per minute and station")], ["log log"]),
        (
            "quality",
            [("quality", "share of the readings [%]"), ("quality", "position error [mm]")],
            ["linear log", "linear log"],
        ),
    ],
)
def test_axes_have_names_scales_and_every_model(
    figures: dict[str, Figure], name: str, labels: list[tuple[str, str]], scales: list[str]
) -> None:
    axes = figures[name].axes
    assert [(each.get_xlabel(), each.get_ylabel()) for each in axes] == labels
    assert [f"{each.get_xscale()} {each.get_yscale()}" for each in axes] == scales
    tops = [each.get_position().y1 for each in axes]
    assert max(tops) - min(tops) < 1e-6, "panels stand side by side"
    assert [text.get_text() for text in figures[name].legends[0].get_texts()] == LABELS
    texts_apart(figures[name])


def test_the_spectrum_is_drawn_in_square_millimetres_below_half_the_rate(
    figures: dict[str, Figure], error_models: ErrorModelComparison
) -> None:
    (axes,) = figures["spectrum"].axes
    model = error_models.models[0]
    hz, density = points(axes.lines[0])
    shown = np.isin(model.frequency_hz[:-1], hz)
    np.testing.assert_allclose(density, 1e6 * model.density_m2_hz[:-1][shown])
    assert hz[-1] < model.frequency_hz[-1]


def test_excursions_have_bands_where_they_are_held_to(figures: dict[str, Figure]) -> None:
    for axes, (low, high) in zip(figures["excursions"].axes, [(1.0, 10.0), (10.0, 40.0)], strict=True):
        (band,) = axes.patches
        extents = band.get_extents().transformed(axes.transData.inverted())
        assert (extents.x0, extents.x1) == pytest.approx((low, high))
    assert not figures["gaps"].axes[0].patches


def test_long_excursions_have_dashed_curves_of_sizes(
    figures: dict[str, Figure], error_models: ErrorModelComparison
) -> None:
    peaks = figures["excursions"].axes[1]
    dashed = [line for line in peaks.lines if line.get_linestyle() == "--"]
    assert len(dashed) == 2
    for line, model in zip(dashed, error_models.models, strict=True):
        sizes_mm = np.unique(1e3 * model.excursion_peak_m[model.excursion_s >= 1.0])
        np.testing.assert_allclose(points(line)[0], sizes_mm)
        rates = np.arange(len(sizes_mm), 0, -1) * 60.0 / model.station_s
        np.testing.assert_allclose(points(line)[1], rates)


def test_bars_have_the_share_of_each_class(figures: dict[str, Figure], error_models: ErrorModelComparison) -> None:
    shares, errors = figures["quality"].axes
    first, second = error_models.models
    for bars, model in zip(shares.containers, (first, second), strict=True):
        tops = [bar.get_y() + bar.get_height() for bar in bars]
        shown = model.quality_share > 0.0
        np.testing.assert_allclose(np.array(tops)[shown], 100.0 * model.quality_share[shown])
    bars = shares.containers[0]
    middles = np.array([[bar.get_x() + 0.5 * bar.get_width() for bar in each] for each in shares.containers])
    np.testing.assert_allclose(middles.mean(axis=0), [-1.0, *np.arange(0.5, 10.0)])  # bars of one class share a place
    np.testing.assert_allclose(middles[1] - middles[0], bars[0].get_width())
    assert 2.0 * bars[0].get_width() < 1.0
    assert [text.get_text() for text in shares.get_xticklabels()] == ["lost", "0", "0.2", "0.4", "0.6", "0.8", "1"]
    np.testing.assert_allclose(points(errors.lines[0])[0], np.arange(0.05, 1.0, 0.1))
    for n, (model, column) in enumerate([(first, 0), (first, 1), (second, 0), (second, 1)]):
        np.testing.assert_allclose(points(errors.lines[n])[1], 1e3 * model.class_error_m[:, column])
    assert [line.get_linestyle() for line in errors.lines] == ["-", "--", "-", "--"]


def test_a_model_without_episodes_has_a_word_in_place_of_curves(error_models: ErrorModelComparison) -> None:
    none = emptied(("excursion_s", "excursion_peak_m", "gap_s"), np.zeros(0))
    bare = replace(error_models, models=(replace(error_models.models[0], **none),))
    figures = figures_of(bare)
    assert [text.get_text() for axes in figures["excursions"].axes for text in axes.texts] == ["none", "none"]
    assert [text.get_text() for text in figures["gaps"].legends[0].get_texts()] == LABELS[:1]


def test_only_short_excursions_leave_the_curves_alone(error_models: ErrorModelComparison) -> None:
    models = tuple(replace(m, excursion_s=np.full(len(m.excursion_s), 0.1)) for m in error_models.models)
    peaks = figures_of(replace(error_models, models=models))["excursions"].axes[1]
    assert peaks.get_xscale() == "log"
    assert not peaks.texts


def test_rates_count_the_episodes_that_have_at_least_a_value(error_models: ErrorModelComparison) -> None:
    model = replace(error_models.models[0], station_s=120.0)
    values, rates = rates_of_at_least(np.array([3.0, 1.0, 1.0, 2.0]), model)
    assert (values.tolist(), rates.tolist()) == ([1.0, 2.0, 3.0], [2.0, 1.0, 0.5])
    assert np.isnan(replace(model, station_s=0.0).per_minute(3))
