"""The page of a constellation: emitters heard and dilution of precision, by place and by station."""

import itertools
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import format_fixed
from harness.core.working_folder import plain_import
from harness.report.coverage.content import CoverageContent, CoverageRow, PlanView, StationRow, format_dilution
from harness.report.kit.axes import label_rows
from harness.report.kit.chart import add_legend, draw_chart
from harness.report.kit.page import Block, BrowserOnly, DataTable, Drawing, Page, Prose, Section
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Axes, Chart, Figure

_HEARD_EDGES = (0, 1, 2, 3, 4, 6, 9, 13)
"""Lowest number of emitters of each colour."""
_HEARD_COLOURS = ("#d55e00", "#eb9a5c", "#f8d4b4", "#cfe3f2", "#94c1e2", "#5698cb", "#1f6fae", "#0b4a7c")
"""Orange for fewer than three emitters, which fix no position; blue for three and more."""
_DILUTION_EDGES = (0.0, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0)
_SHARE_COLOURS = (COLOURS[0], "#eb9a5c", "#f8d4b4", COLOURS[1])
_ROW_IN, _FRAME_IN = 0.3, 0.95


def heard_chart(content: CoverageContent) -> Chart:
    """Plan views of the number of emitters heard."""
    with plain_import():
        from matplotlib.colors import BoundaryNorm, ListedColormap

    norm = BoundaryNorm((*_HEARD_EDGES, 10_000), len(_HEARD_COLOURS))
    labels = [f"{low}" if high == low + 1 else f"{low} to {high - 1}" for low, high in itertools.pairwise(_HEARD_EDGES)]
    views = [view.heard.astype(float) for view in content.views]
    bar = ("emitters heard", [*labels, f"{_HEARD_EDGES[-1]} or more"])
    style = {"cmap": ListedColormap(_HEARD_COLOURS), "norm": norm}
    return _plan_chart(content, "heard", "Emitters heard by place", views, style, bar)


def dilution_chart(content: CoverageContent) -> Chart:
    """Plan views of the dilution of precision."""
    with plain_import():
        from matplotlib import colormaps
        from matplotlib.colors import BoundaryNorm, ListedColormap

    count = len(_DILUTION_EDGES)
    colours = ListedColormap(colormaps["viridis_r"](np.linspace(0.0, 1.0, count)))
    norm = BoundaryNorm((*_DILUTION_EDGES, 1e9), count)
    labels = [f"{low:g} to {high:g}" if low else f"below {high:g}" for low, high in itertools.pairwise(_DILUTION_EDGES)]
    views = [view.dilution for view in content.views]
    bar = ("dilution of precision; no colour: no fix", [*labels, f"{_DILUTION_EDGES[-1]:g} or more"])
    style = {"cmap": colours, "norm": norm}
    return _plan_chart(content, "dilution", "Dilution of precision by place", views, style, bar)


def station_chart(content: CoverageContent) -> Chart:
    """Shares of the time in which each station hears no emitter, one, two, and three or more."""
    rows = content.stations

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        left = np.zeros(len(rows))
        for n, label in enumerate(("none", "one", "two", "three or more")):
            share = np.array([100.0 * row.shares[n] for row in rows])
            axes.barh(range(len(rows)), share, 0.7, left=left, color=_SHARE_COLOURS[n], label=label)
            left = left + share
        label_rows(axes, [row.station for row in rows])
        axes.set_xlim(0.0, 100.0)
        axes.set_xlabel("share of the time [%]")
        add_legend(figure, axes)

    values = "; ".join(
        f"{row.station} {100.0 * row.shares[3]:.1f} % of the time (DOP {format_dilution(row.dilution)})" for row in rows
    )
    return draw_chart(
        "stations",
        f"Emitters heard by the stations of {content.clip}",
        "An emitter is heard if its sound reaches one of the station's microphones past the body.",
        f"Three or more emitters are heard by {values}.",
        draw,
        _FRAME_IN + _ROW_IN * len(rows),
    )


def _plan_chart(
    content: CoverageContent,
    name: str,
    title: str,
    views: Sequence[Floats],
    style: dict[str, Any],
    bar: tuple[str, list[str]],
) -> Chart:
    """The values of each view in colour; `bar` is the title of the colour bar, and a label for each colour."""

    def draw(figure: Figure) -> None:
        panels = figure.subplots(1, len(content.views), sharey=True, squeeze=False)[0]
        for axes, view, values in zip(panels, content.views, views, strict=True):
            image = _draw_view(axes, content, view, values, style)
        panels[0].set_ylabel("x, forward [m]")
        look: dict[str, Any] = {"orientation": "horizontal", "shrink": 0.8, "aspect": 45, "spacing": "uniform"}
        colours = figure.colorbar(image, ax=list(panels), **look)
        edges = np.array(style["norm"].boundaries)
        colours.set_ticks(list(0.5 * (edges[:-1] + edges[1:])), labels=bar[1])
        colours.ax.minorticks_off()
        colours.ax.tick_params(length=0)
        colours.set_label(bar[0])
        colours.outline.set_visible(False)

    x_m, y_m = content.views[0].x_m, content.views[0].y_m
    height_in = 1.9 + 2.25 * min(float(np.ptp(x_m) / np.ptp(y_m)), 2.0)
    heights = " and ".join(f"{view.height_m:g} m" for view in content.views)
    return draw_chart(
        name,
        title,
        "Seen from above, without a body; a station faces each emitter. Dots: emitters. Square: the cube of the table.",
        f"{title} at {heights} above the floor.",
        draw,
        height_in,
    )


def _draw_view(axes: Axes, content: CoverageContent, view: PlanView, values: Floats, style: dict[str, Any]) -> Any:
    from matplotlib.patches import Rectangle

    step_x, step_y = np.diff(view.x_m[:2])[0] / 2, np.diff(view.y_m[:2])[0] / 2
    extent = (view.y_m[0] - step_y, view.y_m[-1] + step_y, view.x_m[0] - step_x, view.x_m[-1] + step_x)
    image = axes.imshow(values, origin="lower", extent=extent, interpolation="nearest", **style)
    axes.plot(
        content.emitter_m[:, 1],
        content.emitter_m[:, 0],
        "o",
        markersize=3.2,
        color=INK,
        markeredgecolor=PAPER,
        markeredgewidth=0.6,
    )
    middle_m = 0.5 * (np.min(content.emitter_m, axis=0) + np.max(content.emitter_m, axis=0))
    corner = (middle_m[1] - content.half_m, middle_m[0] - content.half_m)
    axes.add_patch(Rectangle(corner, 2 * content.half_m, 2 * content.half_m, fill=False, edgecolor=INK, linewidth=1.1))
    axes.set_title(f"{view.height_m:g} m above the floor")
    axes.set_xlabel("y, to the right [m]")
    axes.grid(False)
    for spine in axes.spines.values():
        spine.set_color(FAINT)
    return image


_DILUTION_NOTE = (
    "The dilution of precision (DOP) is the standard deviation of the position over that of a range: it tells how the "
    "directions of the emitters that are heard turn errors of ranges into errors of a position."
)


def coverage_page(content: CoverageContent) -> Page:
    """The page of a constellation."""
    by_place = [Drawing(partial(draw, content)) for draw in (heard_chart, dilution_chart)]
    by_station: list[Block] = [Drawing(partial(station_chart, content)), station_table(content.stations, content.clip)]
    return Page(
        verb="inspect",
        name=content.name,
        headline=coverage_sentence(content),
        facts={
            "Emitters": content.emitters,
            "Reach": content.reach,
            "Turn": content.turn,
            "Clip": content.clip,
            "Made by": content.command,
        },
        sections=[
            Section(
                "By place",
                "place",
                [BrowserOnly([Prose(_DILUTION_NOTE)]), *by_place, place_table(content.rows, content.half_m)],
            ),
            Section("By station", "station", by_station if content.stations else []),
        ],
    )


def coverage_sentence(content: CoverageContent) -> str:
    """The coverage of the cube in one sentence, and the station that hears least."""
    volume = content.rows[0]
    text = (
        f"{len(content.emitter_m)} emitters: three or more are heard in {format_fixed(100.0 * volume.share, 0)} % of "
        f"the cube below them, at a median DOP of {format_dilution(volume.dilution)}"
    )
    if content.stations:
        least = min(content.stations, key=lambda row: row.shares[3])
        text += f"; {least.station} hears three for {format_fixed(100.0 * least.shares[3], 0)} % of {content.clip}"
    return text


def place_table(rows: Sequence[CoverageRow], half_m: float) -> DataTable:
    """Coverage by height."""
    head = ["height above the floor", "3 or more [%]", "DOP up to 10 [%]", "median heard", "median DOP"]
    cells = [
        [r.place, _percent(r.share), _percent(r.fixed), format_fixed(r.heard, 0), format_dilution(r.dilution)]
        for r in rows
    ]
    caption = f"A cube of {2 * half_m:g} m on the floor below the middle of the emitters, and squares in it."
    return DataTable(head, cells, caption=caption, label="Coverage by height")


def station_table(rows: Sequence[StationRow], clip: str) -> DataTable:
    """Coverage by station."""
    head = ["station", "0 heard [%]", "1 [%]", "2 [%]", "3 or more [%]", "DOP up to 10 [%]", "median DOP"]
    cells = [[r.station, *map(_percent, (*r.shares, r.fixed)), format_dilution(r.dilution)] for r in rows]
    caption = (
        f"Shares of the time of {clip}, below the middle of its path: direct sound only, past the body, loud enough "
        "for the direction in which the station faces."
    )
    return DataTable(head, cells, caption=caption, label="Coverage by station")


def _percent(share: float) -> str:
    return format_fixed(100.0 * share, 1)
