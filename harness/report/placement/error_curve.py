"""Error against the number of stations, or against their cost: one point for each chosen set, with its interval.

Errors are those of held-out units where there are any. A line between two points tells whether the larger set is
better: thick where that can be told from zero, dashed where it cannot.
"""

import math
import textwrap
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from harness.core.number_format import Interval
from harness.report.kit.chart import draw_chart
from harness.report.kit.style import COLOURS, INK, MUTED, PAPER, Chart, Figure
from harness.report.placement.pareto import measured_best
from harness.report.placement.wording import held_out_error, set_error, set_name
from harness.results.findings import PlacementFindings, StationNames

_STEPS: dict[str, tuple[str, dict[str, Any]]] = {
    "better": ("the larger set is better", {"color": COLOURS[1], "linewidth": 2.4}),
    "worse": ("the larger set is worse", {"color": COLOURS[0], "linewidth": 2.4}),
    "cannot tell": ("cannot be told apart", {"color": MUTED, "linewidth": 1.4, "linestyle": (0, (4, 2))}),
    "": ("", {"color": MUTED, "linewidth": 1.0}),
}
"""Verdict on two sets -> its words and the line between their points; "" where they were not compared."""
_WIDTH_IN, _HEIGHT_IN, _LETTERS = 4.6, 3.75, 46


@dataclass(frozen=True)
class CurvePoint:
    """A set on the curve."""

    at: float
    """Number of stations, or cost."""
    stations: StationNames
    error: Interval
    on_front: bool
    """Whether no set with less stations, or of less cost, on the curve has a smaller error."""


def curve_points(findings: PlacementFindings) -> list[CurvePoint]:
    """The best set of each asked size, or with costs the Pareto front, from the smallest or cheapest set on."""
    costs = findings.station_costs
    of_set = {
        point.stations: Interval.of(point.error, point.low, point.high, findings.unit)
        for point in findings.front
        if point.error is not None
    }
    best = [b for b, _ in measured_best(findings) if not findings.sizes or len(b.stations) in findings.sizes]
    held = any(b.held_out is not None for b in best)
    for each in () if of_set else best:
        error = held_out_error(findings, each) if held else set_error(findings, findings.of(each.stations))
        if error.is_measured:
            of_set[each.stations] = error
    sign, lowest, points = 1.0 if findings.better == "lower" else -1.0, math.inf, []
    places = {names: sum(costs.get(name, 1.0) for name in names) for names in of_set}
    for stations in sorted(of_set, key=lambda names: (places[names], sign * of_set[names].value)):
        value = sign * of_set[stations].value
        points.append(CurvePoint(places[stations], stations, of_set[stations], value < lowest))
        lowest = min(lowest, value)
    return points


def error_curve(findings: PlacementFindings) -> Chart | None:
    """The curve; None with fewer than two points."""
    points = curve_points(findings)
    if len(points) < 2:
        return None
    against = "cost of the stations" if findings.station_costs else "number of stations"
    held = any(best.held_out is not None for best in findings.best)
    clips = "held-out units" if held else "the units on which the sets were chosen, which favours them"
    values = "; ".join(f"{point.at:g}: {set_name(point.stations)}, {point.error}" for point in points)
    return draw_chart(
        "error_curve",
        f"Error against the {against}",
        f"Mean error on {clips}, with 95 % intervals. Filled: no {'cheaper' if findings.station_costs else 'smaller'} "
        "set shown has a smaller error.",
        f"{findings.metric} [{findings.unit}] against the {against}: {values}.",
        lambda figure: _draw(figure, findings, points, against),
        _HEIGHT_IN,
        width_in=_WIDTH_IN,
        raster=True,
    )


def _draw(figure: Figure, findings: PlacementFindings, points: list[CurvePoint], against: str) -> None:
    axes = figure.subplots()
    verdicts = {(step.smaller, step.larger): step.verdict for step in findings.size_steps}
    for a, b in pairwise(points):
        text, style = _STEPS[verdicts.get((a.stations, b.stations), "")]
        text = text.replace("larger", "dearer") if findings.station_costs else text
        axes.plot([a.at, b.at], [a.error.value, b.error.value], label=text or "_", zorder=1, **style)
    for point in points:
        if point.error.has_interval:
            axes.vlines(point.at, point.error.low, point.error.high, color=INK, linewidth=1.4)
        face = COLOURS[1] if point.on_front else PAPER
        axes.plot(point.at, point.error.value, "D", color=face, markeredgecolor=COLOURS[1], markersize=7.0, zorder=3)
        axes.annotate(
            textwrap.fill(set_name(point.stations), max(_LETTERS // len(points), 11)),
            (point.at, point.error.low if point.error.has_interval else point.error.value),
            (0, -6),
            textcoords="offset points",
            ha="center",
            va="top",
            linespacing=1.05,
        )
    first, last = points[0].at, points[-1].at
    room = 0.5 * (last - first) / (len(points) - 1)
    axes.set_xlim(first - room, last + room)
    axes.set_xticks(sorted({point.at for point in points}))
    axes.set_xlabel(against)
    axes.set_ylabel(f"error [{findings.unit}]")
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.45 * (high - low), high)
    handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
    if handles:
        figure.legend(handles.values(), handles.keys(), loc="outside upper left", ncols=1)
