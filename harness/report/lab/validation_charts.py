"""The charts of a validated capture: the two time offsets, and the errors of each station over time."""

from typing import TYPE_CHECKING

import numpy as np

from harness.core.arrays import Floats
from harness.measure.validation_report import ResidualSeries, ValidationReport
from harness.report.kit.chart import draw_chart, insert_gaps
from harness.report.kit.rows import label_rows
from harness.report.kit.style import COLOURS, FAINT, Chart
from harness.report.lab.quantities import find_quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_OFFSETS = ("time_offset_orientation_s", "time_offset_position_s")
_ROW_IN, _FRAME_IN, _SERIES_IN = 0.34, 0.75, 0.95
_MOST_POINTS = 1200
"""Points of one curve; more are averaged in pairs, fours and so on: the largest is drawn."""


def offsets_chart(report: ValidationReport) -> Chart | None:
    """The time offsets by orientation and by position; None unless both were measured."""
    offsets = {key: report.numbers[key] for key in _OFFSETS if key in report.numbers}
    if len(offsets) < 2 or not all(number.is_measured for number in offsets.values()):
        return None
    names = [find_quantity(key).label.removeprefix("time offset ") for key in offsets]
    shown = [find_quantity(key).of(number) for key, number in offsets.items()]

    def draw(figure: "Figure") -> None:
        axes = figure.subplots()
        for row, (number, colour) in enumerate(zip(shown, (COLOURS[1], COLOURS[0]), strict=True)):
            axes.plot([number.low, number.high], [row, row], color=colour, linewidth=2.2)
            axes.plot(number.value, row, "o", color=colour, markersize=6)
        label_rows(axes, names)
        axes.set_xlabel("time offset [ms]")

    return draw_chart(
        "offsets",
        "Time offset by orientation and by position",
        "How much later the stream is than its reference, with its 95 % interval. The two are estimated apart. Their "
        "difference is an error of the position along the velocity: positions that are not of the moment of the stamp.",
        f"Time offsets: {'; '.join(f'{name} {number}' for name, number in zip(names, shown, strict=True))}.",
        draw,
        _FRAME_IN + _ROW_IN * len(offsets),
    )


def residuals_chart(report: ValidationReport) -> Chart | None:
    """The errors of each station over time; None without any."""
    series = report.residuals
    if not series:
        return None
    return draw_chart(
        "residuals",
        "Errors of each station over time",
        "Distance of the position (left) and angle of the orientation (right) from the reference, after the "
        "registration. A curve shows the largest error of each short stretch. A gap is a stretch without a reading.",
        f"Errors over time of {', '.join(one.station for one in series)}; the numbers are in the table of accuracy.",
        lambda figure: _draw_residuals(figure, series),
        _FRAME_IN + _SERIES_IN * len(series),
    )


def _draw_residuals(figure: "Figure", series: tuple[ResidualSeries, ...]) -> None:
    panels = figure.subplots(len(series), 2, sharex=True, sharey="col", squeeze=False)
    for (left, right), one in zip(panels, series, strict=True):
        _draw_errors(left, one.time_s, 1e3 * one.position_m, COLOURS[1])
        _draw_errors(right, one.time_s, np.degrees(one.angle_rad), COLOURS[0])
        left.set_title(one.station)
    panels[0, 0].set_title(f"{series[0].station}: position [mm]")
    panels[0, 1].set_title("orientation [deg]")
    for axes in panels[-1]:
        axes.set_xlabel("time since the start [s]")


def _draw_errors(axes: "Axes", time_s: Floats, values: Floats, colour: str) -> None:
    times, largest = insert_gaps(*largest_of_stretches(time_s, values))
    axes.plot(times, largest, color=colour, linewidth=0.9)
    finite = values[np.isfinite(values)]
    if len(finite):
        axes.axhline(float(np.median(finite)), color=FAINT, linewidth=0.9)
        axes.set_ylim(bottom=0.0)


def largest_of_stretches(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """At most `_MOST_POINTS` times, and the largest value from each to the next; NaN where there is no reading."""
    every = -(-len(time_s) // _MOST_POINTS) if len(time_s) else 1
    starts = np.arange(0, len(time_s), every)
    if not len(starts):
        return time_s, values
    out: Floats = np.fmax.reduceat(values, starts)
    return time_s[starts], out
