"""Lines of errors, over time and as distributions: the leader and one control in colour, the other methods grey."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.report.kit.axes import set_log_scale
from harness.report.kit.chart import decimate, insert_gaps
from harness.report.kit.style import COLOURS, DASHES, Axes, mark_scale, muted_line_style

CONTROL = "ik"
"""The control unless another one is chosen: inverse kinematics without a model of the motion."""
_LEADER: Mapping[str, Any] = {"color": COLOURS[1], "linestyle": "solid", "linewidth": 1.3, "zorder": 4}
_CONTROL: Mapping[str, Any] = {"color": COLOURS[0], "linestyle": DASHES[1], "linewidth": 1.1, "zorder": 3}
_OTHER: Mapping[str, Any] = {"linewidth": 0.8, "zorder": 2}


@dataclass(frozen=True)
class Highlights:
    """The series in colour."""

    leader: str
    """The series with the lowest mean error."""
    control: str | None
    """The series that it is shown against; None if there is no other."""

    def role(self, series: str) -> str:
        """What a legend adds to the name of a series."""
        return {self.leader: " (lowest mean)", self.control: " (control)"}.get(series, "")

    def order(self, series: Iterable[str]) -> list[str]:
        """The series in the order of a legend: the leader, the control, the others."""
        names = list(series)
        first = [name for name in (self.leader, self.control) if name in names]
        return [*first, *(name for name in names if name not in first)]

    def styles(self, series: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Style of the line of each series, in the order of the legend; no two series look the same."""
        coloured = {self.leader: _LEADER, self.control: _CONTROL}
        names = self.order(series)
        others = [name for name in names if name not in coloured]
        return {
            name: {**coloured[name]} if name in coloured else {**muted_line_style(others.index(name)), **_OTHER}
            for name in names
        }

    @property
    def description(self) -> str:
        """Sentences of a caption on the coloured lines, and why they are coloured."""
        leader = f"Blue: {self.leader}, the lowest mean error over all clips."
        if self.control is None:
            return leader
        is_control = self.control == CONTROL or self.control.startswith(f"{CONTROL} (")
        why = "the control: inverse kinematics, which other methods have to beat" if is_control else "the control"
        return f"{leader} Orange, dashed: {self.control}, {why}."


def choose_highlights(ranked: Sequence[str], wanted: str = CONTROL) -> Highlights:
    """The first of the ranked series as the leader, and as its control the wanted method or else the second one."""
    leader, *others = ranked
    return Highlights(leader, next(iter(find_series(others, wanted) or others), None))


def find_series(series: Iterable[str], method: str) -> list[str]:
    """The series of a method: those of its name, with or without qualifiers in brackets."""
    return [name for name in series if name == method or name.startswith(f"{method} (")]


_MARKERS_PER_LINE = 8


def draw_over_time(axes: Axes, lines: Mapping[str, tuple[Floats, Floats]], highlights: Highlights, label: str) -> None:
    """Draw times (F,) [s] and values (F,) of each series on a logarithmic axis; NaN and missing frames leave gaps."""
    for name, style in highlights.styles(lines).items():
        time_s, values = decimate(*insert_gaps(*lines[name]))
        every, size = max(1, len(time_s) // _MARKERS_PER_LINE), 3.0 * mark_scale()
        axes.plot(time_s, values, label=name + highlights.role(name), markevery=every, markersize=size, **style)
    set_log_scale(axes, "y")
    axes.set_ylabel(label)


_SHARES = np.concatenate([np.linspace(0.0, 0.98, 150), np.linspace(0.981, 1.0, 60)])
"""Shares at which curves have points, closer to each other where large errors are."""
_MARKED = tuple(int(np.argmin(np.abs(_SHARES - share))) for share in (0.1, 0.3, 0.5, 0.7, 0.9))
"""Points with a marker, in styles that have one."""


def draw_distribution(
    axes: Axes,
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
