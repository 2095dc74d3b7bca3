"""The body map: the recommended set on the body, and what a station at each place contributes.

A disc is as large as the contribution; one that cannot be told from zero is pale. Labels stand left and right of the
body, where nothing covers them.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from harness.core.number_format import format_fixed
from harness.report.kit.chart import draw_chart, spread_positions
from harness.report.kit.style import COLOURS, FAINT, INK, MUTED, Axes, Chart, Figure
from harness.report.placement.body_view import HIGH_M, LOW_M, draw_outline, draw_ring, draw_station, locate_places
from harness.report.placement.contribution_significance import SIGNIFICANCE_NOTE, largest_group, significant_candidates
from harness.report.placement.wording import plain_name
from harness.results.findings import CandidatePlace, PlacementFindings, StationNames

HELPS, HARMS, PALE = COLOURS[1], COLOURS[0], MUTED
_WIDTH_IN, _HEIGHT_IN = 7.4, 3.9
_MOST_NAMED, _LINE_M, _HALF_WIDTH_M = 18, 0.105, 1.06
"""Most places with names; height of a line of text and half of the width of a view [m]."""
_WAYS = {
    "ablate": "error without it minus error with all {count} stations",
    "add": "reduction of the error by one more station",
    "exhaustive": "mean error of sets without it minus mean error of sets with it",
}
"""Mode -> what the contribution of a candidate is."""
DrawDisc = Callable[[Axes, str, tuple[float, float]], None]
"""Draws the disc of a place, by its name, at a point of a view [m]."""


def body_map(findings: PlacementFindings, recommended: StationNames) -> Chart:
    """The body from the front and from behind, with every candidate and the recommended set."""
    rows = largest_group(findings.contributions)
    values = {row.candidate: row.difference for row in rows if row.difference is not None}
    told = significant_candidates(rows)
    worn = {*findings.base, *(rows[0].base if rows and rows[0].mode == "add" else ())}
    places = [p for p in findings.candidates if not p.moved_from or p.name in {*recommended, *worn}]
    largest = max(map(abs, values.values()), default=0.0) or 1.0

    def draw_disc(axes: Axes, name: str, at: tuple[float, float]) -> None:
        value = values.get(name)
        if value is None:
            is_marked = name in worn or name in recommended
            draw_station(axes, at, INK if is_marked else PALE, hollow=not is_marked)
        else:
            colour = PALE if name not in told else HELPS if value > 0.0 else HARMS
            draw_station(axes, at, colour, hollow=name not in told, scale=0.6 + 0.5 * abs(value) / largest)
        if name in recommended:
            draw_ring(axes, at)

    first = {p.name: (p.name not in recommended, p.name not in told, -abs(values.get(p.name, 0.0))) for p in places}
    named = sorted(first, key=lambda name: first[name])[:_MOST_NAMED]
    notes = {name: format_fixed(value, 2, signed=True) for name, value in values.items()} | dict.fromkeys(worn, "worn")
    texts = {name: f"{plain_name(name)}\n{notes[name]}" if name in notes else plain_name(name) for name in named}
    what = _WAYS[rows[0].mode].format(count=len(rows[0].base)) if rows else ""
    told_text = ", ".join(
        f"{plain_name(name)} {notes[name]}{'' if name in told else ' (cannot be told from zero)'}"
        for name in sorted(values, key=lambda name: -values[name])
    )
    more = f" Named: {_MOST_NAMED} of {len(places)} places." if len(places) > _MOST_NAMED else ""
    numbers = f"Numbers: {what} [{findings.unit}]. {SIGNIFICANCE_NOTE} " if what else ""
    marks = {
        (INK, "ring"): "recommended" if recommended else "",
        (HELPS, "disc"): "error is lower with it" if any(values[name] > 0.0 for name in told) else "",
        (HARMS, "disc"): "error is higher with it" if any(values[name] < 0.0 for name in told) else "",
        (PALE, "pale"): "cannot be told from zero" if len(told) < len(values) else "" if values else "not recommended",
    }
    return draw_chart(
        "body_map",
        "Where the stations are",
        f"{numbers}In the front view the body's left side is on the right.{more}",
        f"The body with the recommended stations {', '.join(map(plain_name, recommended)) or 'none'}"
        + (f", and {what} [{findings.unit}]: {told_text}." if what else "."),
        lambda figure: _draw_map(figure, places, texts, draw_disc, marks),
        _HEIGHT_IN,
        width_in=_WIDTH_IN,
        layout=None,
        raster=True,
    )


def draw_views(figure: Figure, places: Sequence[CandidatePlace], texts: Mapping[str, str], draw_disc: DrawDisc) -> None:
    """Draw the body from the front and from behind, the discs of the places, and the texts of those that have one."""
    at_m, outward = locate_places(places)
    behind = outward[:, 0] < -0.5
    for side, title in enumerate(("from the front", "from behind")):
        axes = figure.add_axes((0.5 * side, 0.08, 0.5, 0.92))
        draw_outline(axes, behind=bool(side), half_width_m=_HALF_WIDTH_M)
        axes.text(0.0, LOW_M, title, ha="center", va="top", color=FAINT)
        shown = np.flatnonzero(behind == bool(side)).tolist()
        points = {places[n].name: ((-1.0 if side else 1.0) * float(at_m[n, 1]), float(at_m[n, 2])) for n in shown}
        for name, at in points.items():
            draw_disc(axes, name, at)
        _label_places(axes, points, {name: texts[name] for name in points if name in texts})


def _label_places(axes: Axes, points: Mapping[str, tuple[float, float]], texts: Mapping[str, str]) -> None:
    """Write the text of each place in the column of its side, with a line to its disc; no two texts overlap."""
    columns: tuple[list[str], list[str]] = ([], [])
    for name in sorted(texts, key=lambda name: abs(points[name][0]), reverse=True):
        across = points[name][0]
        right = len(columns[0]) > len(columns[1]) if abs(across) < 0.02 else across > 0.0
        columns[right].append(name)
    for right, column in zip((False, True), columns, strict=True):
        column.sort(key=lambda name: -points[name][1])
        lines = max((1 + texts[name].count("\n") for name in column), default=1)
        gap = lines * _LINE_M / (HIGH_M - LOW_M)
        heights = spread_positions([(HIGH_M - points[name][1]) / (HIGH_M - LOW_M) for name in column], gap)
        for name, height in zip(column, heights, strict=True):
            axes.annotate(
                texts[name],
                points[name],
                ((1.0 if right else -1.0) * (_HALF_WIDTH_M - 0.02), HIGH_M - height * (HIGH_M - LOW_M)),
                arrowprops={"arrowstyle": "-", "color": FAINT, "linewidth": 0.8, "shrinkA": 2.0, "shrinkB": 7.0}
                | {"relpos": (0.0 if right else 1.0, 0.5)},
                ha="right" if right else "left",
                va="center",
                linespacing=1.05,
                annotation_clip=False,
            )


def _draw_map(
    figure: Figure,
    places: Sequence[CandidatePlace],
    texts: Mapping[str, str],
    draw_disc: DrawDisc,
    marks: Mapping[tuple[str, str], str],
) -> None:
    from matplotlib.lines import Line2D

    draw_views(figure, places, texts, draw_disc)
    looks: dict[str, dict[str, Any]] = {
        "ring": {"markerfacecolor": "none", "markersize": 13.0, "markeredgewidth": 2.0},
        "disc": {"markersize": 10.0},
        "pale": {"markerfacecolor": "none", "markersize": 8.0, "markeredgewidth": 1.6},
    }
    handles = [
        Line2D([], [], linestyle="none", marker="o", color=colour, label=text, **looks[look])
        for (colour, look), text in marks.items()
        if text
    ]
    figure.legend(handles=handles, loc="lower center", ncols=len(handles), handletextpad=0.2, columnspacing=1.2)
