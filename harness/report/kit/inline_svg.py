"""An SVG of matplotlib as a part of a page: ids, data attributes, titles, and lines that answer to the pointer.

matplotlib numbers its elements anew in each chart, so several charts on one page would share ids. `hover_chart.js`
reads the marks and scales. Without scripts the chart is a still picture with all lines and its legend.
"""

import html
import re
from collections.abc import Mapping
from typing import Any

from harness.report.kit.markup import Markup
from harness.report.kit.style import Axes, Figure

_REFERENCES = re.compile(r'(?:href="#|url\(#)([^")]+)')
_IDS = re.compile(r' id="([^"]*)"')
_METADATA = re.compile(r"<metadata>.*?</metadata>|<style type=\"text/css\">\*\{[^}]*\}</style>", re.DOTALL)
DATA_PREFIX = "data:"
"""Elements whose gid begins so get data attributes: "data:series=3,plot=0" becomes data-series and data-plot."""


def inline_svg(svg: str, alt: str, titles: Mapping[str, str]) -> Markup:
    """The `<svg>` element with an alternative text, and a title for the elements of some gids, shown on hover."""
    text = _METADATA.sub("", svg[svg.index("<svg") :])
    for gid, title in titles.items():
        text = text.replace(f'<g id="{gid}">', f"<g><title>{html.escape(title)}</title>", 1)
    kept = set(_REFERENCES.findall(text))
    text = _IDS.sub(lambda match: _attributes(match[1], kept), text)
    return Markup(text.replace("<svg", f'<svg role="group" aria-label="{html.escape(alt)}"', 1))


def _attributes(gid: str, kept: set[str]) -> str:
    if gid.startswith(DATA_PREFIX):
        pairs = (pair.split("=") for pair in gid.removeprefix(DATA_PREFIX).split(","))
        return "".join(f' data-{name}="{value}"' for name, value in pairs)
    return f' id="{gid}"' if gid in kept else ""


BAND_OF = "_band of "
"""Start of the label of a band that is shown and hidden with a line; the name of the line follows."""


def mark_series(figure: Figure) -> list[str]:
    """Mark each named line of the figure and its entry in the legend; returns the names, in the order of their marks.

    Lines of the same name in several axes are one series.
    """
    names: list[str] = []
    for plot, axes in enumerate(figure.axes):
        for line in axes.lines:
            name = str(line.get_label())
            if not name.startswith("_"):
                names += [] if name in names else [name]
                line.set_gid(f"{DATA_PREFIX}series={names.index(name)},plot={plot}")
        for band in axes.collections:
            name = str(band.get_label()).removeprefix(BAND_OF)
            if name in names:
                band.set_gid(f"{DATA_PREFIX}band={names.index(name)}")
    for legend in figure.legends:
        for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True):
            if text.get_text() in names and handle is not None:
                for part in (text, handle):
                    part.set_gid(f"{DATA_PREFIX}key={names.index(text.get_text())}")
    return names


def describe_plots(figure: Figure) -> list[dict[str, Any] | None]:
    """Describe the axes with named lines: box in the SVG [pt], limits, scales and units; None for other axes.

    The layout of the figure must have been computed.
    """
    return [
        _describe_plot(figure, axes) if any(not str(line.get_label()).startswith("_") for line in axes.lines) else None
        for axes in figure.axes
    ]


def _describe_plot(figure: Figure, axes: Axes) -> dict[str, Any]:
    width, height = 72.0 * figure.get_size_inches()
    place = axes.get_position()
    box = (place.x0 * width, (1.0 - place.y1) * height, place.x1 * width, (1.0 - place.y0) * height)
    return {
        "box": [round(float(side), 3) for side in box],
        "x": _describe_axis(axes.get_xlim(), axes.get_xscale(), _bottom_label(figure, axes)),
        "y": _describe_axis(axes.get_ylim(), axes.get_yscale(), axes.get_ylabel() or figure.axes[0].get_ylabel()),
    }


def _describe_axis(limits: tuple[float, float], scale: str, label: str) -> dict[str, Any]:
    unit = label.rpartition("[")[2].rstrip("]") if "[" in label else label
    return {"limits": [float(limit) for limit in limits], "log": scale == "log", "unit": unit}


def _bottom_label(figure: Figure, axes: Axes) -> str:
    """The label of the horizontal axis, or of the one that shares it."""
    shared = (other.get_xlabel() for other in figure.axes if axes.get_shared_x_axes().joined(axes, other))
    return axes.get_xlabel() or next((label for label in shared if label), "")
