"""Every line of a comparison as an interval over the band of its margin, a chart for each metric."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from harness.compare.comparison import Comparison, Difference, Verdict
from harness.report.comparison.wording import format_percent, groups_vary, percent_of_a
from harness.report.kit.style import COLOURS, FAINT, GRID, INK, PAPER, Chart
from harness.report.run.charts import draw_chart

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_IN, _ROW_IN, _FRAME_IN = 4.2, 0.34, 0.62
_LETTERS, _MOST_ROWS = 18, 3
"""Before a row, in so many rows of text at most."""
_MARKER_STYLES: Mapping[Verdict, dict[str, Any]] = {
    "worse": {"color": COLOURS[0]},
    "better": {"color": COLOURS[1]},
    "same": {"color": INK, "marker": "o"},
    "cannot tell": {"color": FAINT, "marker": "o", "markerfacecolor": PAPER},
}
"""What is worse or better has a triangle that points to where it went: by shape as well as by colour."""
_SYMLOG_RATIO = 40.0
"""So many times the median reach of a row, the longest row makes the axis symmetrically logarithmic."""


def interval_charts(comparison: Comparison, gated: bool) -> list[Chart]:
    """A chart for each metric of the lines that are gated, or that are not; those that are no share are left out."""
    chosen = [line for line in comparison.differences if line.gated == gated and line.mean_a]
    metrics = dict.fromkeys(line.metric for line in chosen)
    charts = []
    for number, metric in enumerate(metrics, start=1):
        lines = [line for line in chosen if line.metric == metric]
        name = f"intervals_{'gated' if gated else 'other'}_{number}"
        charts.append(_chart(name, metric, lines, groups_vary(comparison)))
    return charts


def _chart(name: str, metric: str, lines: Sequence[Difference], varied: bool) -> Chart:
    names = [_label(line, varied) for line in lines]
    told = [f"{line.method} {format_percent(percent_of_a(line, line.difference))} {line.verdict}" for line in lines]
    height_in = _FRAME_IN + sum(max(_ROW_IN, 0.17 * (1 + name.count("\n"))) for name in names)
    return draw_chart(
        name,
        metric,
        "",
        f"{metric}, difference in percent of A's mean: {'; '.join(told)}.",
        lambda figure: _draw(figure, lines, names),
        height_in,
        width_in=_WIDTH_IN,
    )


def _draw(figure: "Figure", lines: Sequence[Difference], names: Sequence[str]) -> None:
    axes = figure.subplots()
    for row, line in enumerate(lines):
        margin = percent_of_a(line, line.margin)
        axes.barh(row, 2.0 * margin, left=-margin, height=0.8, color=GRID, alpha=0.75)
        look = {"marker": ">" if line.difference > 0.0 else "<", **_MARKER_STYLES[line.verdict]}
        if line.low is not None and line.high is not None:
            ends = [percent_of_a(line, line.low), percent_of_a(line, line.high)]
            axes.plot(ends, [row, row], color=look["color"], linewidth=2.2, solid_capstyle="butt")
        axes.plot(percent_of_a(line, line.difference), row, markersize=6.5, linestyle="none", **look)
        said = f"{format_percent(percent_of_a(line, line.difference))} {line.verdict}"
        axes.annotate(said, (1.02, row), xycoords=axes.get_yaxis_transform(), va="center", fontsize=9.5)
    axes.axvline(0.0, color=FAINT, linewidth=0.9)
    axes.set_yticks(range(len(lines)), names)
    axes.set_ylim(len(lines) - 0.45, -0.55)
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.set_xlabel("B − A [% of A's mean]")
    _scale(axes, lines)


def _scale(axes: "Axes", lines: Sequence[Difference]) -> None:
    """The same to both sides; logarithmic beyond the middle where one line would flatten all others."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    reaches = sorted(_extent(line) for line in lines)
    middle, furthest = reaches[len(reaches) // 2], reaches[-1]
    end = 1.08 * furthest if furthest > 0.0 else 1.0
    if furthest > _SYMLOG_RATIO * middle > 0.0:
        axes.set_xscale("symlog", linthresh=2.0 * middle, linscale=1.5)
        axes.xaxis.set_major_locator(FixedLocator(_ticks(2.0 * middle, end)))
    else:
        axes.xaxis.set_major_locator(MaxNLocator(5))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:+g}".replace("+0", "0").replace("-", "−"))
    axes.set_xlim(-end, end)


def _ticks(linear: float, end: float) -> list[float]:
    """Zero and powers of ten on both sides, beyond what is linear; so few that they do not meet."""
    powers = [10.0**power for power in range(math.ceil(math.log10(linear)), math.floor(math.log10(end)) + 1)]
    kept = [powers[0], powers[-1]] if len(powers) > 2 else powers[-1:] or [end]
    return [*(-tick for tick in reversed(kept)), 0.0, *kept]


def _extent(line: Difference) -> float:
    ends = (percent_of_a(line, value) for value in (line.low, line.high, line.difference, line.margin))
    return max(abs(value) for value in ends if not math.isnan(value))


def _label(line: Difference, varied: bool) -> str:
    words = [line.method, *([line.group] if varied else [])]
    rows = [row for text in words for row in textwrap.wrap(text, _LETTERS) or [""]]
    cut = [*rows[: _MOST_ROWS - 1], textwrap.shorten(" ".join(rows[_MOST_ROWS - 1 :]), _LETTERS, placeholder="…")]
    return "\n".join(rows if len(rows) <= _MOST_ROWS else cut)
