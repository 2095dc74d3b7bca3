"""Charts of a comparison: paired slopes of one line, clip by clip, and intervals of all lines over their margins.

Slopes are estimation plots (Gardner and Altman 1986; Ho et al. 2019): each clip as a line from A to B, next to the
differences with mean, interval and margin.
"""

import math
import textwrap
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from harness.compare import Comparison, Difference, Verdict
from harness.core.arrays import Floats
from harness.core.number_format import format_change_percent
from harness.report.comparison.wording import (
    clip_steps,
    count_directions,
    format_mean,
    format_signed,
    groups_vary,
    line_interval,
    line_title,
    percent_of_a,
    rise_is_worse,
)
from harness.report.kit.axes import draw_interval, label_rows
from harness.report.kit.chart import draw_chart
from harness.report.kit.style import COLOURS, FAINT, GRID, INK, PAPER, Axes, Chart, Figure
from harness.report.kit.text import truncate

SIZE_IN = (3.3, 2.5)
WORSE_COLOUR, BETTER_COLOUR = COLOURS[0], COLOURS[1]
_SLOPE_AXES, _DIFFERENCE_AXES = (0.145, 0.17, 0.42, 0.72), (0.725, 0.17, 0.26, 0.72)
"""Positions of the two axes in the figure: left, bottom, width, height."""
_FAINT_FROM = 20
"""Number of clips from which on lines are thinner."""


def slope_chart(line: Difference, number: int) -> Chart:
    """The chart of one line; `number` distinguishes the files of a page."""
    up, down, same = count_directions(line)
    counts = ", ".join(f"{n} {what}" for n, what in ((up, "higher in B"), (down, "lower"), (same, "unchanged")) if n)
    caption = f"{len(line.clips)} clips: {counts}. {_largest_change(line)}"
    alt = (
        f"{line_title(line)}: mean {format_mean(line, line.mean_a)} in A, {format_mean(line, line.mean_b)} in B "
        f"[{line.unit}]; difference {line_interval(line)}, "
        f"{format_change_percent(percent_of_a(line, line.difference))} of A, "
        f"margin {format_mean(line, line.margin)}: {line.verdict}. {caption}"
    )
    name, (width_in, height_in) = f"slopes_{number}", SIZE_IN
    return draw_chart(
        name,
        line_title(line),
        caption,
        alt,
        lambda figure: _draw_line(figure, line),
        height_in,
        width_in=width_in,
        layout=None,
    )


def _draw_line(figure: Figure, line: Difference) -> None:
    left, right = (figure.add_axes(place) for place in (_SLOPE_AXES, _DIFFERENCE_AXES))
    a, b = np.array(line.a), np.array(line.b)
    _draw_slopes(left, line, a, b)
    _draw_differences(right, line, b - a)


def _draw_slopes(axes: Axes, line: Difference, a: Floats, b: Floats) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.ticker import MaxNLocator

    ends = np.stack([np.stack([np.zeros_like(a), a], axis=1), np.stack([np.ones_like(b), b], axis=1)], axis=1)
    many = len(a) >= _FAINT_FROM
    axes.add_collection(LineCollection(list(ends), colors=_colours(line), linewidths=0.7 if many else 1.1, alpha=0.65))
    axes.plot([0.0, 1.0], [line.mean_a, line.mean_b], "o-", color=INK, linewidth=2.6, markersize=5.5, zorder=4)
    axes.set_xlim(-0.12, 1.12)
    means = (format_mean(line, value) for value in (line.mean_a, line.mean_b))
    axes.set_xticks([0.0, 1.0], [f"{side}\n{value}" for side, value in zip("AB", means, strict=True)])
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=9, length=0)
    axes.margins(y=0.06)
    axes.autoscale_view()
    axes.grid(False, axis="x")
    axes.spines["left"].set_visible(False)


def _draw_differences(axes: Axes, line: Difference, difference: Floats) -> None:
    """Draw the clips' differences, their mean and its interval over the band of the margin."""
    from matplotlib.ticker import MaxNLocator

    axes.axhspan(-line.margin, line.margin, color=GRID, linewidth=0, alpha=0.75)
    axes.axhline(0.0, color=FAINT, linewidth=0.9)
    axes.scatter(_beeswarm_offsets(difference), difference, s=9, color=_colours(line), linewidths=0, alpha=0.75)
    if line.low is not None and line.high is not None:
        axes.plot([1.0, 1.0], [line.low, line.high], color=INK, linewidth=2.0, solid_capstyle="butt")
    axes.plot([1.0], [line.difference], "D", color=PAPER, markeredgecolor=INK, markeredgewidth=1.6, markersize=5.5)
    axes.set_xlim(-0.6, 1.65)
    axes.set_xticks([0.0, 1.0], ["clips", f"mean\n{format_signed(line, line.difference)}"])
    axes.set_title("B − A", fontsize=9.5, fontweight="normal", pad=3.0)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelsize=9, length=0)
    axes.grid(False)
    axes.spines["left"].set_visible(False)


def _colours(line: Difference) -> list[str]:
    """The colour of each clip: worse in B, better or equal."""
    worse = 1.0 if rise_is_worse(line.metric) else -1.0
    return [WORSE_COLOUR if worse * step > 0.0 else BETTER_COLOUR if step else FAINT for _, step in clip_steps(line)]


def _beeswarm_offsets(values: Floats) -> Floats:
    """(n,) horizontal offsets that put points of similar height next to each other, centred."""
    if not len(values) or np.ptp(values) == 0.0:
        return np.zeros(len(values))
    rows = np.floor((values - values.min()) / np.ptp(values) * 22.0)
    out = np.zeros(len(values))
    for row in np.unique(rows):
        members = np.flatnonzero(rows == row)
        out[members] = 0.11 * (np.arange(len(members)) - 0.5 * (len(members) - 1))
    widest = np.abs(out).max()
    scaled: Floats = out * min(1.0, 0.42 / widest) if widest else out
    return scaled


def _largest_change(line: Difference) -> str:
    """The sentence on the clip with the largest change; empty if none changed."""
    if not line.clips:
        return ""
    clip, step = max(clip_steps(line), key=lambda item: abs(item[1]))
    return f"Largest change: {clip}, {format_signed(line, step)}." if step else ""


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


def interval_charts(
    comparisons: Sequence[Comparison], gated: bool, *, between_methods: bool = False
) -> list[Callable[[], Chart]]:
    """What draws a chart for each metric of the gated lines, or of the others, of one or several comparisons.

    Lines whose mean in A is zero are left out. Rows of several comparisons have the name of B, `between_methods` alone.
    """
    several = len(comparisons) > 1
    chosen = [
        (line, [*([each.b] if several else []), *([] if between_methods else [line.method])], groups_vary(each))
        for each in comparisons
        for line in each.differences
        if line.gated == gated and line.mean_a and not (several and line.part)
    ]
    charts: list[Callable[[], Chart]] = []
    for number, metric in enumerate(dict.fromkeys(line.metric for line, _, _ in chosen), start=1):
        lines = [line for line, _, _ in chosen if line.metric == metric]
        names = [
            _label([*words, *([line.group] if vary else [])]) for line, words, vary in chosen if line.metric == metric
        ]
        name = f"intervals_{'gated' if gated else 'other'}_{number}"
        reference = comparisons[0].a if several else "A"
        charts.append(partial(_interval_chart, name, metric, lines, names, reference))
    return charts


def _interval_chart(name: str, metric: str, lines: Sequence[Difference], names: Sequence[str], reference: str) -> Chart:
    texts = [
        f"{row.replace(chr(10), ' ')} {format_change_percent(percent_of_a(line, line.difference))} {line.verdict}"
        for row, line in zip(names, lines, strict=True)
    ]
    height_in = _FRAME_IN + sum(max(_ROW_IN, 0.17 * (1 + name.count("\n"))) for name in names)
    return draw_chart(
        name,
        metric,
        "",
        f"{metric}, difference in percent of {reference}'s mean: {'; '.join(texts)}.",
        lambda figure: _draw_intervals(figure, lines, names, reference),
        height_in,
        width_in=_WIDTH_IN,
    )


def _draw_intervals(figure: Figure, lines: Sequence[Difference], names: Sequence[str], reference: str = "A") -> None:
    axes = figure.subplots()
    for row, line in enumerate(lines):
        margin = percent_of_a(line, line.margin)
        axes.barh(row, 2.0 * margin, left=-margin, height=0.8, color=GRID, alpha=0.75)
        style = {"marker": ">" if line.difference > 0.0 else "<", **_MARKER_STYLES[line.verdict]}
        low, middle, high = (percent_of_a(line, value) for value in (line.low, line.difference, line.high))
        ends = (None, None) if line.low is None else (low, high)
        draw_interval(
            axes, row, ends, middle, f"{format_change_percent(middle)} {line.verdict}", markersize=6.5, **style
        )
    axes.axvline(0.0, color=FAINT, linewidth=0.9)
    label_rows(axes, names)
    axes.set_xlabel("B − A [% of A's mean]" if reference == "A" else f"change [% of {truncate(reference, _LETTERS)}]")
    _scale(axes, lines)


def _scale(axes: Axes, lines: Sequence[Difference]) -> None:
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


def _label(words: Sequence[str]) -> str:
    rows = [row for text in words for row in textwrap.wrap(text, _LETTERS) or [""]]
    shortened = [*rows[: _MOST_ROWS - 1], textwrap.shorten(" ".join(rows[_MOST_ROWS - 1 :]), _LETTERS, placeholder="…")]
    return "\n".join(rows if len(rows) <= _MOST_ROWS else shortened)
