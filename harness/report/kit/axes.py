"""Axes: a vertical axis of named rows, and logarithmic and square-root scales with plain numbers."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from harness.report.kit.style import Axes


def label_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows 0, 1, ... of the axes from the top, without ticks and grid lines between them."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)


def draw_interval(
    axes: Axes, row: float, ends: tuple[float | None, float | None], value: float, note: str = "", **style: Any
) -> None:
    """Draw an estimate as a marker in a row, with a line between its ends, and a note to the right of the axes."""
    low, high = ends
    if low is not None and high is not None:
        axes.plot([low, high], [row, row], color=style["color"], linewidth=2.2, solid_capstyle="butt")
    axes.plot(value, row, **{"linestyle": "none", "markersize": 6, **style})
    if note:
        axes.annotate(note, (1.02, row), xycoords=axes.get_yaxis_transform(), va="center", fontsize=9.5)


def set_log_scale(axes: Axes, side: Literal["x", "y"]) -> None:
    """Make an axis logarithmic, with plain numbers, unless no value on it is above zero (a perfect method)."""
    from matplotlib.ticker import LogLocator, NullLocator

    column = 0 if side == "x" else 1
    values = np.concatenate([np.asarray(line.get_data()[column], dtype=float) for line in axes.lines] or [np.zeros(1)])
    if np.nanmax(values, initial=0.0) > 0.0:
        axes.set(**{f"{side}scale": "log"})
        axis = axes.xaxis if side == "x" else axes.yaxis
        few = np.nanmin(values[values > 0.0]) * 300.0 < np.nanmax(values)
        axis.set_major_locator(LogLocator(subs=(1.0,) if few else (1.0, 2.0, 5.0)))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(lambda value, _: f"{value:g}")


def set_root_scale(axes: Axes) -> None:
    """Give the x axis a square-root scale from 0, with plain numbers."""
    axes.set_xscale("function", functions=(np.sqrt, np.square))
    axes.set_xlim(left=0.0)
    ticks = _root_ticks(axes.get_xlim()[1])
    axes.set_xticks(ticks, [f"{tick:g}" for tick in ticks])


def _root_ticks(end: float) -> list[float]:
    """Round tick values for a square-root axis from 0 to `end`, spaced widely enough to be read."""
    ticks = [0.0]
    for power in range(-3, 5):
        for tick in (digit * 10.0**power for digit in (1, 2, 5)):
            if tick <= end and np.sqrt(tick) - np.sqrt(ticks[-1]) > 0.09 * np.sqrt(end):
                ticks.append(tick)
    return ticks
