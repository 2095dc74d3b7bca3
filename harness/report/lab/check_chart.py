"""The chart of checks: measured over expected numbers, departures in colour."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harness.measure.departures import Departure
from harness.report.kit.chart import draw_chart
from harness.report.kit.rows import label_rows
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Chart
from harness.report.lab.departures import condense_departures
from harness.report.lab.quantities import find_quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_ROW_IN, _FRAME_IN = 0.3, 0.75
_LEAST_RATIO, _MOST_RATIO = 0.02, 50.0
"""Ends of the axis of ratios."""
_TICKS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0)
_TICK_SPACING = 0.07
"""Least distance of two ticks, as a share of the axis."""


def check_chart(every: Sequence[Departure], expected_from: str) -> Chart | None:
    """Measured over expected number of each check, with its interval; None if no check has a ratio."""
    checks = _with_ratio(every)
    if not checks:
        return None
    names = [_check_name(check) for check in checks]
    texts = "; ".join(
        f"{name} {find_quantity(check.key).of(check.measured)}{', a departure' if check.is_named else ''}"
        for name, check in zip(names, checks, strict=True)
    )
    return draw_chart(
        "checks",
        "Measured over expected",
        f"Each number over that of {expected_from}, with its 95 % interval. Orange triangles: departures, after "
        "Holm's correction over all checks. Hollow: no departure. A number with nothing expected has no place here.",
        f"Measured over expected: {texts}.",
        lambda figure: _draw_checks(figure, checks, names),
        _FRAME_IN + _ROW_IN * len(checks),
    )


def _check_name(check: Departure) -> str:
    label = find_quantity(check.key).label
    return f"{label}, {check.station}" if check.station else label


def _draw_checks(figure: "Figure", checks: Sequence[Departure], names: Sequence[str]) -> None:
    axes = figure.subplots()
    ends = []
    for row, check in enumerate(checks):
        number = check.measured.scaled(1.0 / check.expected.value)
        ratio, low, high = number.value, number.low, number.high
        colour = COLOURS[0] if check.is_named else FAINT
        low, high = max(low, _LEAST_RATIO), min(high, _MOST_RATIO)
        axes.plot([low, high], [row, row], color=colour, linewidth=2.2, solid_capstyle="butt")
        marker = (">" if ratio > 1.0 else "<") if check.is_named else "o"
        face = colour if check.is_named else PAPER
        axes.plot(
            np.clip(ratio, _LEAST_RATIO, _MOST_RATIO), row, marker, color=colour, markerfacecolor=face, markersize=6
        )
        ends += [low, high]
    axes.axvline(1.0, color=INK, linewidth=0.9, zorder=1)
    label_rows(axes, names)
    _scale_ratios(axes, min(0.8, 0.9 * min(ends)), max(1.25, 1.1 * max(ends)))
    axes.set_xlabel("measured over expected")


def _with_ratio(checks: Sequence[Departure]) -> list[Departure]:
    """The checks whose numbers have a ratio: those of all stations together, and departures of single ones."""
    told = condense_departures(checks)
    return [
        check
        for check in checks
        if (not check.station or check in told) and check.expected.value > 0.0 and check.measured.value > 0.0
    ]


def _scale_ratios(axes: "Axes", low: float, high: float) -> None:
    """Make the x axis logarithmic from `low` to `high`, with plain ticks that stand far enough apart."""
    from matplotlib.ticker import NullLocator

    axes.set_xscale("log")
    axes.xaxis.set_minor_locator(NullLocator())
    ticks = [1.0]
    for tick in sorted((tick for tick in _TICKS if low <= tick <= high), key=lambda tick: abs(math.log(tick))):
        if min(abs(math.log(tick / other)) for other in ticks) > _TICK_SPACING * math.log(high / low):
            ticks.append(tick)
    axes.set_xticks(sorted(ticks), [f"{tick:g}" for tick in sorted(ticks)])
    axes.set_xlim(low, high)
