"""What the charts draw: curves, bands, scales and names of axes, read off the figures."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from harness.core.arrays import Floats
from harness.report.kit.style import to_svg
from harness.report.physics.charts import (
    excursions_chart,
    gaps_chart,
    quality_chart,
    rates_of_at_least,
    spectrum_chart,
)
from harness.report.physics.error_comparison import ErrorModelComparison
from tests.report.drawing import texts_apart
from tests.report.fabricate_physics import made_up, statistics, without_episodes

CHARTS = (spectrum_chart, excursions_chart, gaps_chart, quality_chart)


def figures_of(comparison: ErrorModelComparison) -> dict[str, Figure]:
    """Name of the chart -> its figure."""
    figures: dict[str, Figure] = {}

    def keep(figure: Figure, name: str) -> str:
        figures[name] = figure
        return to_svg(figure, name)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("harness.report.kit.chart.to_svg", keep)
        for draw in CHARTS:
            draw(comparison)
    return figures


def points(line: Line2D) -> tuple[Floats, Floats]:
    """The coordinates of a line."""
    return np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)


@pytest.fixture(scope="module")
def figures() -> dict[str, Figure]:
    return figures_of(made_up())


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
def test_axes_have_names_and_scales(
    figures: dict[str, Figure], name: str, labels: list[tuple[str, str]], scales: list[str]
) -> None:
    axes = figures[name].axes
    assert [(each.get_xlabel(), each.get_ylabel()) for each in axes] == labels
    assert [f"{each.get_xscale()} {each.get_yscale()}" for each in axes] == scales
    tops = [each.get_position().y1 for each in axes]
    assert max(tops) - min(tops) < 1e-6, "panels stand side by side"


def test_names_and_numbers_do_not_overlap(figures: dict[str, Figure]) -> None:
    for figure in figures.values():
        texts_apart(figure)


def test_the_spectrum_is_drawn_in_square_millimetres_below_half_the_rate(figures: dict[str, Figure]) -> None:
    (axes,) = figures["spectrum"].axes
    x, y = points(axes.lines[0])
    model = statistics()
    np.testing.assert_allclose(x, model.frequency_hz[:-1])
    np.testing.assert_allclose(y, 1e6 * model.density_m2_hz[:-1])


def test_excursions_have_bands_where_they_are_held_to(figures: dict[str, Figure]) -> None:
    for axes, (low, high) in zip(figures["excursions"].axes, [(1.0, 10.0), (10.0, 40.0)], strict=True):
        (band,) = axes.patches
        extents = band.get_extents().transformed(axes.transData.inverted())
        assert (extents.x0, extents.x1) == pytest.approx((low, high))
    assert not figures["gaps"].axes[0].patches


def test_long_excursions_have_dashed_curves_of_sizes(figures: dict[str, Figure]) -> None:
    peaks = figures["excursions"].axes[1]
    dashed = [line for line in peaks.lines if line.get_linestyle() == "--"]
    assert len(dashed) == 2
    for line, model in zip(dashed, made_up().models, strict=True):
        sizes_mm = np.sort(1e3 * model.excursion_peak_m[model.excursion_s >= 1.0])
        np.testing.assert_allclose(points(line)[0], sizes_mm)
        np.testing.assert_allclose(points(line)[1], np.arange(len(sizes_mm), 0, -1) / 120.0)


@pytest.mark.parametrize(("duration", "size"), [(False, False), (True, False), (False, True)])
def test_without_ranges_there_are_no_bands(duration: bool, size: bool) -> None:
    comparison = replace(
        made_up(), duration_range_s=(1.0, 10.0) if duration else None, peak_range_m=(0.01, 0.04) if size else None
    )
    durations, peaks = figures_of(comparison)["excursions"].axes
    assert (bool(durations.patches), bool(peaks.patches)) == (duration, size)
    assert any(line.get_linestyle() == "--" for line in peaks.lines) == duration
    caption = excursions_chart(comparison).caption
    assert ("Grey:" in caption) == (duration or size)
    assert ("dashed: only those of 1 s or more" in caption) == duration


def test_bars_have_the_share_of_each_class(figures: dict[str, Figure]) -> None:
    shares, errors = figures["quality"].axes
    bars = shares.containers[0]
    tops = [bar.get_y() + bar.get_height() for bar in bars]
    np.testing.assert_allclose(tops, [1.0] * 10 + [90.0])
    assert min(bar.get_y() for bar in bars) < 1.0
    middles = np.array([[bar.get_x() + 0.5 * bar.get_width() for bar in each] for each in shares.containers])
    np.testing.assert_allclose(middles.mean(axis=0), [-1.0, *np.arange(0.5, 10.0)])  # bars of one class share a place
    np.testing.assert_allclose(middles[1] - middles[0], bars[0].get_width())
    assert 2.0 * bars[0].get_width() < 1.0
    assert [text.get_text() for text in shares.get_xticklabels()] == ["lost", "0", "0.2", "0.4", "0.6", "0.8", "1"]
    np.testing.assert_allclose(points(errors.lines[0])[0], np.arange(0.05, 1.0, 0.1))
    np.testing.assert_allclose(points(errors.lines[0])[1], 1e3 * statistics().class_error_m[:, 0])
    np.testing.assert_allclose(points(errors.lines[1])[1], 1e3 * statistics().class_error_m[:, 1])
    assert [line.get_linestyle() for line in errors.lines] == ["-", "--", "-", "--"]


def test_a_model_without_episodes_has_a_word_in_place_of_curves() -> None:
    figures = figures_of(without_episodes())
    assert [text.get_text() for axes in figures["excursions"].axes for text in axes.texts] == ["none", "none"]
    assert [text.get_text() for text in figures["gaps"].legends[0].get_texts()] == ["clean"]


def test_only_short_excursions_leave_the_curves_alone() -> None:
    models = tuple(replace(model, excursion_s=np.full(len(model.excursion_s), 0.1)) for model in made_up().models)
    short = replace(made_up(), models=models)
    peaks = figures_of(short)["excursions"].axes[1]
    assert peaks.get_xscale() == "log"
    assert not peaks.texts


def test_rates_count_the_episodes_that_have_at_least_a_value() -> None:
    model = replace(statistics(), station_s=120.0)
    values, rates = rates_of_at_least(np.array([3.0, 1.0, 1.0, 2.0]), model)
    assert values.tolist() == [1.0, 2.0, 3.0]
    assert rates.tolist() == [2.0, 1.0, 0.5]
    assert np.isnan(replace(model, station_s=0.0).per_minute(3))


def test_charts_name_every_model_in_their_legend(figures: dict[str, Figure]) -> None:
    assert all(
        "for physics and noise = default;" in chart.alt
        for name, chart in zip(figures, (draw(made_up()) for draw in CHARTS), strict=True)
        if name != "quality"
    )
    for figure in figures.values():
        assert [text.get_text() for text in figure.legends[0].get_texts()] == ["physics", "noise = default"]
