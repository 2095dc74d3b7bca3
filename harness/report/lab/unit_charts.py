"""The charts of a measured unit: checks, Allan deviation, spectrum, episodes, quality, and stations on a bar."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from harness.measure import QualityClass, RigidPair
from harness.measure.reports import EPISODE_KINDS, CaptureSummary, DeviationCurve, EpisodeMark, UnitReport
from harness.report.kit.axes import label_rows, set_log_scale
from harness.report.kit.chart import add_legend, decimate, draw_chart
from harness.report.kit.style import COLOURS, INK, Axes, Chart, Figure, series_style

_HEIGHT_IN, _FRAME_IN, _LANE_IN = 3.6, 0.75, 0.16
_MODEL: dict[str, Any] = {"color": INK, "linestyle": (0, (4, 1.5)), "linewidth": 1.6}
_MOST_MARKS = 3000
"""Episodes of one kind and station that are drawn; of more the largest."""


def kinds_of(episodes: Sequence[EpisodeMark]) -> list[str]:
    """The kinds of episodes that there are, in their order."""
    return [kind for kind in EPISODE_KINDS if any(one.kind == kind for one in episodes)]


def _episode_counts(episodes: Sequence[EpisodeMark]) -> str:
    """Number of episodes of each kind in words."""
    counts = {kind: sum(one.kind == kind for one in episodes) for kind in kinds_of(episodes)}
    plural = {"echo": "echoes"}
    return ", ".join(
        f"{count:,} {kind if count == 1 else plural.get(kind, f'{kind}s')}" for kind, count in counts.items()
    )


def allan_chart(report: UnitReport) -> Chart | None:
    """Allan deviations of position and orientation; None without any."""
    groups = [
        ("position, one axis [mm]", 1e3, report.allan_position, report.allan_position_model),
        ("orientation, one axis [deg]", np.degrees(1.0), report.allan_orientation, report.allan_orientation_model),
    ]
    shown = [group for group in groups if group[2]]
    if not shown:
        return None
    has_model = any(model is not None for *_, model in shown)

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, len(shown), squeeze=False)[0]
        for axes, (title, factor, curves, model) in zip(panels, shown, strict=True):
            _draw_deviations(axes, curves, model, float(factor))
            axes.set_ylabel(title)
        add_legend(figure, panels[0])

    return draw_chart(
        "allan",
        "Allan deviation at rest",
        "How much the means of neighbouring stretches of this length differ. White noise falls by half when the time "
        "is four times as long; noise that lasts makes a hump at about twice its correlation time; drift rises at the "
        "right. Bands: 95 % intervals." + (" Dashed: the fitted error model." if has_model else ""),
        "Allan deviation against averaging time of each station; the numbers are in the table below.",
        draw,
        _HEIGHT_IN,
        hover=True,
    )


def _draw_deviations(axes: Axes, curves: Sequence[DeviationCurve], model: DeviationCurve | None, factor: float) -> None:
    for n, curve in enumerate(curves):
        colour = series_style(n)["color"]
        axes.fill_between(
            curve.tau_s,
            factor * curve.low,
            factor * curve.high,
            color=colour,
            alpha=0.15,
            linewidth=0.0,
            label=f"_band of {curve.station}",
        )
        axes.plot(curve.tau_s, factor * curve.deviation, label=curve.station, **_line(n))
    if model is not None:
        axes.plot(model.tau_s, factor * model.deviation, label=model.station, **_MODEL)
    set_log_scale(axes, "x")
    set_log_scale(axes, "y")
    axes.set_xlabel("averaging time [s]")


def _line(n: int) -> dict[str, Any]:
    """Colour and dashes of a station's curve, without markers."""
    return {key: value for key, value in series_style(n).items() if key != "marker"}


def spectrum_chart(report: UnitReport) -> Chart | None:
    """Spectrum of the position of each station; None without any."""
    if not report.spectra:
        return None

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for n, curve in enumerate(report.spectra):
            axes.plot(*decimate(curve.frequency_hz, 1e6 * curve.density_m2_hz), label=curve.station, **_line(n))
        set_log_scale(axes, "x")
        set_log_scale(axes, "y")
        axes.set_xlabel("frequency [Hz]")
        axes.set_ylabel("density [mm²/Hz]")
        add_legend(figure, axes)

    return draw_chart(
        "spectrum",
        "Spectrum of the position at rest",
        "Power spectral density, summed over the three axes. The area below a curve between two frequencies is the "
        "variance there. A flat curve is white noise; one that falls is noise that lasts; a peak is a vibration. A "
        "station without a curve has no 10 s without a gap.",
        "Power spectral density of the position at rest in square millimetres per hertz, of each station; the numbers "
        "are in the table below.",
        draw,
        _HEIGHT_IN,
        hover=True,
    )


def episodes_chart(report: UnitReport) -> Chart | None:
    """Time line of the episodes of each station; None without any."""
    if not report.episodes:
        return None
    stations = report.capture.stations
    kinds = kinds_of(report.episodes)
    counts = _episode_counts(report.episodes)
    return draw_chart(
        "episodes",
        "Episodes over the capture",
        f"When each station left its place or was lost. A short episode is drawn as a tick. There are {counts}.",
        f"Time line of the episodes of each station: {counts}; the numbers are in the table below.",
        lambda figure: _draw_episodes(figure, report.episodes, report.capture, kinds),
        _FRAME_IN + 0.45 + (_LANE_IN * len(kinds) + 0.14) * len(stations),
    )


def _draw_episodes(
    figure: Figure, episodes: Sequence[EpisodeMark], capture: CaptureSummary, kinds: Sequence[str]
) -> None:
    from matplotlib.collections import LineCollection

    axes = figure.subplots()
    stations, until_s = capture.stations, capture.duration_s
    lane = 0.8 / len(kinds)
    scale, unit = (60.0, "min") if until_s > 600.0 else (1.0, "s")
    least = 0.0015 * until_s / scale
    for k, kind in enumerate(kinds):
        segments = []
        for row, station in enumerate(stations):
            y = row - 0.4 + (k + 0.5) * lane
            marks = [one for one in episodes if one.kind == kind and one.station == station]
            marks = sorted(marks, key=lambda one: -one.duration_s)[:_MOST_MARKS]
            for one in sorted(marks, key=lambda one: one.begin_s):
                begin = one.begin_s / scale
                segments.append([(begin, y), (begin + max(one.duration_s / scale, least), y)])
        colour = COLOURS[k]
        height_pt = 0.75 * 72.0 * _LANE_IN
        axes.add_collection(LineCollection(segments, colors=colour, linewidths=height_pt, capstyle="butt"))
        axes.plot([], [], color=colour, linewidth=height_pt, label=kind)
    label_rows(axes, stations)
    axes.set_xlim(0.0, until_s / scale)
    axes.set_xlabel(f"time since the start [{unit}]")
    add_legend(figure, axes)


def quality_chart(classes: Sequence[QualityClass]) -> Chart | None:
    """Share and error of the readings in each class of quality; None without a class but that of the lost ones."""
    if not any(one.to > 0.0 for one in classes):
        return None

    def draw(figure: Figure) -> None:
        shares, errors = figure.subplots(1, 2)
        names = ["lost" if one.to == 0.0 else f"{one.to:g}" for one in classes]
        heights = np.array([100.0 * one.share for one in classes])
        shares.bar(range(len(classes)), heights, 0.8, color=COLOURS[1])
        every = max(1, len(classes) // 6)
        shares.set_xticks(range(0, len(classes), every), names[::every])
        shares.grid(False, axis="x")
        shares.set_xlabel("quality, up to")
        shares.set_ylabel("share of the readings [%]")
        known = [one for one in classes if one.to > 0.0]
        middle = [0.5 * (one.above + one.to) for one in known]
        for label, values, style in (
            ("median", [1e3 * one.median_m for one in known], {"marker": "o", "linestyle": "solid"}),
            ("95 % quantile", [1e3 * one.quantile95_m for one in known], {"marker": "s", "linestyle": (0, (4, 1.5))}),
        ):
            errors.plot(middle, values, color=COLOURS[1], markersize=3.5, label=label, **style)
        set_log_scale(errors, "y")
        errors.set_xlim(0.0, 1.0)
        errors.set_xlabel("quality")
        errors.set_ylabel("distance from the resting place [mm]")
        add_legend(figure, errors)

    return draw_chart(
        "quality",
        "Quality, and the error at each quality",
        "Left: the share of the readings in each class of quality. Right: the distance of a reading at rest from the "
        "station's place. Where quality tells the truth, the distance falls to the right.",
        "Share of the readings in each class of quality, and median and 95 % quantile of their distance from the "
        "resting place; the numbers are in the table below.",
        draw,
        _HEIGHT_IN,
    )


def pair_chart(pair: RigidPair) -> Chart | None:
    """Error of two stations on a bar by speed; None without motion."""
    if not pair.speeds:
        return None

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        middle = [0.5 * (one.from_m_s + one.to_m_s) for one in pair.speeds]
        values = np.array([1e3 * one.rms_m.value for one in pair.speeds])
        ends = 1e3 * np.array([[one.rms_m.low, one.rms_m.high] for one in pair.speeds]).T
        axes.errorbar(middle, values, np.abs(ends - values), color=COLOURS[1], marker="o", capsize=3, linewidth=1.4)
        axes.set_ylim(bottom=0.0)
        axes.set_xlim(left=0.0)
        axes.set_xlabel("speed of the bar [m/s]")
        axes.set_ylabel("RMS error [mm]")

    names = " and ".join(pair.stations)
    return draw_chart(
        "pair",
        f"Error of {names} in motion",
        "How far the vector from one station to the other departs from that of a rigid bar: the errors of both "
        "stations together, without any reference. An error that both share does not show.",
        f"RMS error of the vector between {names} in millimetres by speed; the numbers are in the table below.",
        draw,
        2.8,
    )
