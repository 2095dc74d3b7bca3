"""Axes whose vertical axis is a list of named rows, the first one at the top."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def label_rows(axes: "Axes", names: Sequence[str]) -> None:
    """Name the rows 0, 1, ... of the axes from the top, without ticks and grid lines between them."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
