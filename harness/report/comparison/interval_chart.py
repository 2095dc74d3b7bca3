"""Charts with the interval of every line of a comparison over the band of its margin, one for each metric."""

import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from harness.compare.comparison import Comparison, Difference, Verdict
from harness.core.number_format import format_change_percent
from harness.report.comparison.wording import groups_vary, percent_of_a
from harness.report.kit.chart import draw_chart
from harness.report.kit.rows import label_rows
from harness.report.kit.style import COLOURS, FAINT, GRID, INK, PAPER, Chart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN, _ROW_IN, _FRAME_IN = 4.2, 0.34, 0.62
_LETTERS, _MOST_ROWS = 18, 3
"""Letters of a row's label, and its most rows of text."""
_MARKER_STYLES: Mapping[Verdict, dict[str, Any]] = {
    "worse": {"color": COLOURS[0]},
    "better": {"color": COLOURS[1]},
    "same": {"color": INK, "marker": "o"},
    "cannot tell": {"color": FAINT, "marker": "o", "markerfacecolor": PAPER},
}
"""Verdict -> marker. Worse and better have a triangle that points in the direction of the change, not only a colour."""
_SYMLOG_RATIO = 40.0
"""The axis is symmetrically logarithmic if the longest row reaches this many times as far as the median row."""


def interval_charts(comparison: Comparison, gated: bool) -> list[Callable[[], Chart]]:
    """What draws a chart for each metric of the gated lines, or of the others.

    Lines whose mean in A is zero are left out.
    """
    chosen = [line for line in comparison.differences if line.gated == gated and line.mean_a]
    metrics = dict.fromkeys(line.metric for line in chosen)
    charts: list[Callable[[], Chart]] = []
    for number, metric in enumerate(metrics, start=1):
        lines = [line for line in chosen if line.metric == metric]
        name = f"intervals_{'gated' if gated else 'other'}_{number}"
        charts.append(partial(_chart, name, metric, lines, groups_vary(comparison)))
    return charts


def _chart(name: str, metric: str, lines: Sequence[Difference], varied: bool) -> Chart:
    names = [_label(line, varied) for line in lines]
    texts = [
        f"{line.method} {format_change_percent(percent_of_a(line, line.difference))} {line.verdict}" for line in lines
    ]
    height_in = _FRAME_IN + sum(max(_ROW_IN, 0.17 * (1 + name.count("\n"))) for name in names)
    return draw_chart(
        name,
        metric,
        "",
        f"{metric}, difference in percent of A's mean: {'; '.join(texts)}.",
        lambda figure: _draw(figure, lines, names),
        height_in,
        width_in=_WIDTH_IN,
    )


def _draw(figure: "Figure", lines: Sequence[Difference], names: Sequence[str]) -> None:
    axes = figure.subplots()
    for row, line in enumerate(lines):
        margin = percent_of_a(line, line.margin)
        axes.barh(row, 2.0 * margin, left=-margin, height=0.8, color=GRID, alpha=0.75)
        style = {"marker": ">" if line.difference > 0.0 else "<", **_MARKER_STYLES[line.verdict]}
        if line.low is not None and line.high is not None:
            ends = [percent_of_a(line, line.low), percent_of_a(line, line.high)]
            axes.plot(ends, [row, row], color=style["color"], linewidth=2.2, solid_capstyle="butt")
        axes.plot(percent_of_a(line, line.difference), row, markersize=6.5, linestyle="none", **style)
        label = f"{format_change_percent(percent_of_a(line, line.difference))} {line.verdict}"
        axes.annotate(label, (1.02, row), xycoords=axes.get_yaxis_transform(), va="center", fontsize=9.5)
    axes.axvline(0.0, color=FAINT, linewidth=0.9)
    label_rows(axes, names)
    axes.set_xlabel("B − A [% of A's mean]")
    _scale(axes, lines)


def _scale(axes: "Axes", lines: Sequence[Difference]) -> None:
    """Make the axis symmetric about zero; logarithmic beyond the middle if one line would flatten all others."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    extents = sorted(_extent(line) for line in lines)
    middle, furthest = extents[len(extents) // 2], extents[-1]
    end = 1.08 * furthest if furthest > 0.0 else 1.0
    if furthest > _SYMLOG_RATIO * middle > 0.0:
        axes.set_xscale("symlog", linthresh=2.0 * middle, linscale=1.5)
        axes.xaxis.set_major_locator(FixedLocator(_ticks(2.0 * middle, end)))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(5 if end < 100.0 else 3))  # three digits are wide
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:+g}".replace("+0", "0").replace("-", "−"))
    axes.set_xlim(-end, end)


def _ticks(linear: float, end: float) -> list[float]:
    """Tick values: zero and at most two powers of ten on both sides, beyond the linear part."""
    powers = [10.0**power for power in range(math.ceil(math.log10(linear)), math.floor(math.log10(end)) + 1)]
    shown = [powers[0], powers[-1]] if len(powers) > 2 else powers[-1:] or [end]
    return [*(-tick for tick in reversed(shown)), 0.0, *shown]


def _extent(line: Difference) -> float:
    """How far the line reaches from zero [% of A's mean]."""
    ends = (percent_of_a(line, value) for value in (line.low, line.high, line.difference, line.margin))
    return max(abs(value) for value in ends if not math.isnan(value))


def _label(line: Difference, varied: bool) -> str:
    words = [line.method, *([line.group] if varied else [])]
    rows = [row for text in words for row in textwrap.wrap(text, _LETTERS) or [""]]
    shortened = [*rows[: _MOST_ROWS - 1], textwrap.shorten(" ".join(rows[_MOST_ROWS - 1 :]), _LETTERS, placeholder="…")]
    return "\n".join(rows if len(rows) <= _MOST_ROWS else shortened)
