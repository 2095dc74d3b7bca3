"""Cumulative distributions: the share of values below each value, a curve for each series."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.core.arrays import Floats
from harness.report.kit.scales import set_log_scale
from harness.report.kit.style import mark_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHARES = np.concatenate([np.linspace(0.0, 0.98, 150), np.linspace(0.981, 1.0, 60)])
"""Shares at which curves have points, closer to each other where large errors are."""
_MARKED = tuple(int(np.argmin(np.abs(_SHARES - share))) for share in (0.1, 0.3, 0.5, 0.7, 0.9))
"""Points with a marker, in styles that have one."""


def draw_distribution(
    axes: "Axes",
    series: Mapping[str, Floats],
    label: str,
    styles: Mapping[str, Mapping[str, Any]],
    role: Callable[[str], str] = lambda name: "",
) -> None:
    """Draw the distribution of the finite values (N,) of each series in its style; one without any has no curve.

    `role` is what the legend adds to a name.
    """
    for name, values in series.items():
        finite = values[np.isfinite(values)]
        if len(finite):
            options = {
                "label": name + role(name),
                "markevery": list(_MARKED),
                "markersize": 4.2 * mark_scale(),
                **styles[name],
            }
            axes.plot(np.quantile(finite, _SHARES), 100.0 * _SHARES, **options)
    set_log_scale(axes, "x")
    axes.set_xlabel(label)
    axes.set_ylim(0.0, 100.0)
