"""The charts of the page: spectrum, excursions, gaps and quality, each with a curve or bar for every error model."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import count_noun, format_share
from harness.report.kit.axes import set_log_scale
from harness.report.kit.chart import add_legend, decimate, draw_chart
from harness.report.kit.style import FAINT, GRID, PAPER, Axes, Chart, Figure, series_style
from harness.report.physics.error_comparison import ErrorModelComparison, TrackerErrorStatistics

_HEIGHT_IN = 3.4
_MM2 = 1e6
"""Square millimetres in a square metre."""
_BAND: Mapping[str, Any] = {"color": GRID, "alpha": 0.6, "linewidth": 0.0}
"""Look of a range that episodes are held to."""
_DURATIONS_S, _SIZES_M = (1.0, 10.0), (0.01, 0.04)
"""Durations [s] and sizes [m] that the excursions are held to, marked in the chart."""
_LEAST_SHARE = 1e-6
"""Share at which bars on a logarithmic axis begin, unless a smaller one is shown."""


def spectrum_chart(comparison: ErrorModelComparison) -> Chart:
    """Spectra of the position error."""
    counts = "; ".join(f"{model.label}: {count_noun(model.segments, 'segment')}" for model in comparison.models)
    return draw_chart(
        "spectrum",
        "Spectrum of the position error",
        "Power spectral density, summed over the three axes. The area below a curve between two frequencies is the "
        "variance of the error there. A flat curve is white noise; one that falls is error that lasts. Welch's method "
        f"averages segments of {comparison.segment_s:g} s without a lost reading, minus their mean ({counts}).",
        "Power spectral density of the position error in square millimetres per hertz against frequency, for "
        f"{_names(comparison.models)}; the numbers are in the table below.",
        lambda figure: _draw_spectrum(figure, comparison.models),
        _HEIGHT_IN,
        hover=True,
    )


def _draw_spectrum(figure: Figure, models: Sequence[TrackerErrorStatistics]) -> None:
    axes = figure.subplots()
    for n, model in enumerate(models):
        inner = slice(0, -1)  # half the sampling rate is left out: its one-sided density has no mirror image to add
        x, y = decimate(model.frequency_hz[inner], _MM2 * model.density_m2_hz[inner])
        axes.plot(x, y, label=model.label, color=series_style(n)["color"])
    if any(model.segments for model in models):
        set_log_scale(axes, "x")
        set_log_scale(axes, "y")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("density [mm²/Hz]")
    add_legend(figure, axes)


def excursions_chart(comparison: ErrorModelComparison) -> Chart:
    """Durations and sizes of the excursions."""
    limit = f"{1e3 * comparison.limit_m:g} mm"
    counts = "; ".join(
        f"{model.label}: {count_noun(len(model.excursion_s), 'excursion')}" for model in comparison.models
    )
    return draw_chart(
        "excursions",
        "Duration and size of excursions",
        f"An excursion is a stretch with an error above {limit}; those less than {comparison.merge_s:g} s apart are "
        "one. A curve shows how many excursions for each minute and station last at least as long (left) or reach at "
        f"least this error (right; dashed: only those of {_DURATIONS_S[0]:g} s or more). {counts}. Grey: the durations "
        f"and sizes that excursions are held to. {_truncated_note(comparison)}",
        f"Number of excursions above {limit} for each minute and station by duration and by largest error, for "
        f"{_names(comparison.models)}; the numbers are in the table below.",
        lambda figure: _draw_excursions(figure, comparison),
        _HEIGHT_IN,
    )


def _draw_excursions(figure: Figure, comparison: ErrorModelComparison) -> None:
    durations, peaks = figure.subplots(1, 2, sharey=True)
    _draw_rates(durations, comparison.models, lambda model: model.excursion_s)
    _draw_rates(peaks, comparison.models, lambda model: 1e3 * model.excursion_peak_m)
    _draw_rates(peaks, comparison.models, lambda m: 1e3 * m.excursion_peak_m[m.excursion_s >= _DURATIONS_S[0]], "--")
    durations.axvspan(*_DURATIONS_S, **_BAND)
    peaks.axvspan(*(1e3 * end_m for end_m in _SIZES_M), **_BAND)
    for axes in (durations, peaks):
        _scale_rates(axes)
    durations.set_xlabel("duration, at least [s]")
    durations.set_ylabel("excursions per minute and station")
    peaks.set_xlabel("largest error, at least [mm]")
    add_legend(figure, durations)


def gaps_chart(comparison: ErrorModelComparison) -> Chart:
    """Durations of the gaps."""
    counts = "; ".join(
        f"{model.label}: {count_noun(len(model.gap_s), 'gap')}, {format_share(model.lost_share, 2)} of the readings"
        for model in comparison.models
    )
    return draw_chart(
        "gaps",
        "Duration of gaps",
        "A gap is a stretch in which a station is lost: its quality is 0. A curve shows how many gaps for each minute "
        f"and station last at least as long. {counts}. {_truncated_note(comparison)}",
        f"Number of gaps for each minute and station by duration, for {_names(comparison.models)}; the numbers are in "
        "the table below.",
        lambda figure: _draw_gaps(figure, comparison.models),
        _HEIGHT_IN,
    )


def _draw_gaps(figure: Figure, models: Sequence[TrackerErrorStatistics]) -> None:
    axes = figure.subplots()
    _draw_rates(axes, models, lambda model: model.gap_s)
    _scale_rates(axes)
    axes.set_xlabel("duration, at least [s]")
    axes.set_ylabel("gaps per minute and station")
    add_legend(figure, axes)


def _draw_rates(
    axes: Axes,
    models: Sequence[TrackerErrorStatistics],
    values_of: Callable[[TrackerErrorStatistics], Floats],
    dashes: str = "-",
) -> None:
    """Draw how many episodes of each model have at least a value, as steps; a model without any has only its name."""
    for n, model in enumerate(models):
        x, rates = rates_of_at_least(values_of(model), model)
        axes.plot(x, rates, drawstyle="steps-pre", linestyle=dashes, color=series_style(n)["color"], label=model.label)
        axes.plot(x[-1:], rates[-1:], "o", color=series_style(n)["color"], markersize=3.5)


def _scale_rates(axes: Axes) -> None:
    """Make both axes logarithmic; axes without any episode say so instead."""
    if any(np.size(line.get_xdata()) for line in axes.lines):
        set_log_scale(axes, "x")
        set_log_scale(axes, "y")
    else:
        axes.text(0.5, 0.5, "none", transform=axes.transAxes, ha="center", color=FAINT)
        axes.set(xticks=[], yticks=[])


def rates_of_at_least(values: Floats, model: TrackerErrorStatistics) -> tuple[Floats, Floats]:
    """The different values of episodes, rising, and how many per minute and station have at least each of them."""
    ordered = np.sort(values)
    different, smaller = np.unique(ordered, return_index=True)
    return different, model.per_minute(len(ordered) - smaller.astype(float))


def quality_chart(comparison: ErrorModelComparison) -> Chart:
    """Share and error of the readings in each class of quality."""
    return draw_chart(
        "quality",
        "Quality, and the error at each quality",
        "Left: the share of readings in each class of quality; the first class holds the lost readings. Right: the "
        "error of the readings in each class, the median as a solid line and the 95 % quantile as a dashed one. "
        "Where quality tells the truth, the error falls to the right.",
        "Share of readings in each class of quality, and median and 95 % quantile of the error in millimetres in each "
        f"class, for {_names(comparison.models)}; the numbers are in the table below.",
        lambda figure: _draw_quality(figure, comparison.models),
        _HEIGHT_IN,
    )


def _draw_quality(figure: Figure, models: Sequence[TrackerErrorStatistics]) -> None:
    shares, errors = figure.subplots(1, 2)
    _draw_shares(shares, models)
    for n, model in enumerate(models):
        middle = 0.5 * (model.quality_edges[1:] + model.quality_edges[:-1])
        style = series_style(n)
        for column, (dashes, face) in enumerate((("-", style["color"]), ("--", PAPER))):
            look = {"color": style["color"], "linestyle": dashes, "marker": style["marker"], "markerfacecolor": face}
            errors.plot(middle, 1e3 * model.class_error_m[:, column], markersize=3.5, **look)
    set_log_scale(errors, "y")
    errors.set_xlim(0.0, 1.0)
    errors.set_xlabel("quality")
    errors.set_ylabel("position error [mm]")
    add_legend(figure, shares)


def _draw_shares(axes: Axes, models: Sequence[TrackerErrorStatistics]) -> None:
    """Draw the shares of the classes as bars on a logarithmic axis, side by side."""
    from matplotlib.ticker import LogLocator, NullLocator

    smallest = min((float(share) for model in models for share in model.quality_share if share), default=1.0)
    floor = 100.0 * 10.0 ** np.floor(np.log10(max(0.99 * smallest, _LEAST_SHARE)))
    edges = models[0].quality_edges
    places = np.concatenate([[-1.0], np.arange(len(edges) - 1) + 0.5])  # the lost readings stand apart
    width = 0.8 / len(models)
    for n, model in enumerate(models):
        height = np.maximum(100.0 * model.quality_share - floor, 0.0)
        at = places + width * (n - 0.5 * (len(models) - 1))
        axes.bar(at, height, width, bottom=floor, color=series_style(n)["color"], label=model.label)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator())
    axes.yaxis.set_minor_locator(NullLocator())
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.set_ylim(floor, 130.0)
    axes.set_xticks([-1.0, *range(0, len(edges), 2)], ["lost", *(f"{edge:g}" for edge in edges[::2])])
    axes.grid(False, axis="x")
    axes.set_xlabel("quality")
    axes.set_ylabel("share of the readings [%]")


def _names(models: Sequence[TrackerErrorStatistics]) -> str:
    return " and ".join(model.label for model in models)


def _truncated_note(comparison: ErrorModelComparison) -> str:
    return (
        "Those that a recording begins or ends within count with the part that was seen."
        if any(model.truncated for model in comparison.models)
        else ""
    )
