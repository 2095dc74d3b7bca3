"""A ranking of methods in words, and as dots: mean errors with intervals, and paired differences to the lowest."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.compare import MIN_UNITS, MethodRanking, count_units, mean_interval
from harness.core.number_format import count_noun, format_number, format_share
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Axes, Figure, mark_scale
from harness.report.kit.text import list_first

BOLD_NOTE = " Bold: better than every other method, by the rules of harness compare."
"""End of the caption of a table with bold cells."""
LAG_NOTE = "Methods that wait for later frames are ranked apart from causal ones, each lag for itself."
"""Sentence of pages and tables with methods of several lags."""
LAG_COVERAGE = " A method with a lag leaves the last frames of a take unanswered."
"""End of the caption of a table of coverage with such methods."""
LAG_COLUMN = "lag"
"""Heading of a column with the lags of methods [frames]."""
_MOST_NAMED = 4


def name_lag(frames: int) -> str:
    """A lag in words, such as "a lag of 2 frames"."""
    return f"a lag of {count_noun(frames, 'frame')}" if frames else "no lag"


def describe_ranking(ranking: MethodRanking, where: str, format_error: Callable[[float], str]) -> str:
    """Which method is best, or has the lowest error, and what can be told about the others.

    `where` names the motion, such as "15 clips of 3 performers of built-in motion".
    """
    lowest, error = ranking.lowest, format_error(ranking.means[ranking.lowest])
    if not ranking.results:
        return f"{lowest}: {error} mean joint-angle error on {where}. No other method was measured."
    if ranking.best:
        return f"{lowest} is best: {error} mean joint-angle error on {where}. {_lead(ranking, format_error)}"
    first = f"{lowest} has the lowest mean joint-angle error, {error} on {where}"
    undecided = ranking.others("cannot tell")
    why = ranking.results[undecided[0]].why if undecided else ""
    if len(undecided) == len(ranking.results):
        others = "the other method" if len(undecided) == 1 else f"any of the other {len(undecided)}"
        return f"{first}, but cannot be called better than {others} ({why})."
    parts = [f"{first}."]
    if better := ranking.others("better"):
        parts.append(f"It is better than {list_first(better, _MOST_NAMED)}.")
    if same := ranking.others("same"):
        parts.append(f"The same within the margin: {list_first(same, _MOST_NAMED)}.")
    if undecided:
        parts.append(f"Cannot tell whether it is better than {list_first(undecided, _MOST_NAMED)}: {why}.")
    return " ".join(parts)


def _lead(ranking: MethodRanking, format_error: Callable[[float], str]) -> str:
    """The sentence on how much lower the best error is than the next."""
    (_, best), (second, next_lowest), *_ = ranking.values.items()
    difference, wins = float(np.mean(next_lowest - best)), int(np.sum(best < next_lowest))
    share = format_share(difference / float(next_lowest.mean()))
    counted = count_units(ranking.units)
    return (
        f"That is {format_error(difference)} ({share}) less than {second}, the next, and lower on {wins} of {counted}."
    )


_LOWEST: Mapping[str, Any] = {"marker": "D", "color": COLOURS[1], "label": "lowest mean"}
_TIED: Mapping[str, Any] = {"marker": "o", "color": COLOURS[1], "markerfacecolor": PAPER, "label": "tied with it"}
_WORSE: Mapping[str, Any] = {"marker": "s", "color": FAINT, "label": "worse"}
"""Marks of a row; they differ in shape and filling, so that they can be told apart without colour."""
_ROW_IN, _FRAME_IN, _TITLE_IN = 0.2, 0.95, 0.4
"""Heights in text of 10 pt [in]: a line of text of a row, axis and legend, the heading of a panel."""
_NAME_LETTERS, _LABEL_LETTERS, _HEADING_LETTERS = 5.0, 4.0, 13.0
"""Letters of a line for each inch of width, in text of 10 pt: of a name, of the label of an axis, of a heading."""
_FAR = 2.0
"""Means above this many times the middle one are beyond the axis, so that they do not squeeze the others [choice]."""
_MOST_LINES = 3
"""Most lines of a name."""
_DOT, _LINE = 4.4, 1.6
"""Size of a dot and width of an interval in text of 10 pt [pt]."""


@dataclass(frozen=True)
class RankingPanel:
    """One ranking of a chart."""

    title: str
    """What was ranked; empty if the chart has one panel that needs none."""
    ranking: MethodRanking

    @property
    def heading(self) -> str:
        """Title and number of units, and whether they can show a difference."""
        counted = count_units(self.ranking.units)
        too_few = (
            ": differences cannot be shown" if len(self.ranking.units) < MIN_UNITS and self.ranking.results else ""
        )
        return f"{self.title} ({counted}){too_few}" if self.title else f"{counted}{too_few}"

    @property
    def largest_drawn(self) -> float:
        """The largest mean inside the axis: at most `_FAR` times the middle mean, of two methods the larger one."""
        means = list(self.ranking.means.values())
        middle = means[min(max(1, (len(means) - 1) // 2), len(means) - 1)]
        return max(mean for mean in means if mean <= _FAR * middle)

    def wrapped_names(self, letters: int) -> list[str]:
        """The name of each row, in lines of about so many letters."""
        return [wrap_name(name, letters) for name in self.ranking.values]


def wrap_name(name: str, letters: int) -> str:
    """A name in at most three lines, broken at blanks, commas, brackets, colons and plus signs where possible."""
    breakable = "".join(f"{sign} " if sign in ",:+" else f" {sign}" if sign in "[(" else sign for sign in name)
    lines = textwrap.wrap(breakable, letters) if len(name) > letters else [name]
    for sign in ",:+":
        lines = [line.replace(f"{sign} ", sign) for line in lines]
    lines = [line.replace(" [", "[") for line in lines]
    return "\n".join(lines[:_MOST_LINES]) + ("…" if len(lines) > _MOST_LINES else "")


def explain_marks(panels: Sequence[RankingPanel]) -> str:
    """Sentences of a caption on intervals, differences and ties, as far as the panels have them."""
    sentences = ["Lines: 95 % intervals over units."] if any(len(panel.ranking.units) > 1 for panel in panels) else []
    if any(panel.ranking.results for panel in panels):
        sentences += [
            "Right: paired difference to the method with the lowest mean; thin: corrected for all lines tested.",
            "Tied: no significant difference that exceeds the margin (sign-flip test over units, Holm's correction).",
        ]
    if any(mean > largest_drawn(panels) for panel in panels for mean in panel.ranking.means.values()):
        sentences.append("An arrow with a number: a value beyond the axis.")
    if any(len(panel.ranking.units) < MIN_UNITS for panel in panels):
        sentences.append(f"Fewer than {MIN_UNITS} units cannot show a difference.")
    return " ".join(sentences)


def largest_drawn(panels: Sequence[RankingPanel]) -> float:
    """The largest mean inside the axis that panels share."""
    return max(panel.largest_drawn for panel in panels)


def draw_ranking(figure: Figure, panels: Sequence[RankingPanel], quantity: str, unit: str) -> None:
    """Draw the panels below each other: means on the left, differences to the lowest mean on the right.

    Without any other method to compare with there are means alone. The figure gets the height that the rows need.
    Values of methods that err several times as much as the others are written at the edge.
    """
    from matplotlib.ticker import MaxNLocator

    scale, compared = mark_scale(), any(panel.ranking.results for panel in panels)
    width = figure.get_figwidth() / scale
    names = [panel.wrapped_names(int(_NAME_LETTERS * width)) for panel in panels]
    lines = [sum(1 + name.count("\n") for name in of) for of in names]
    figure.set_figheight(scale * (_FRAME_IN + sum(_TITLE_IN + _ROW_IN * count for count in lines)))
    largest = largest_drawn(panels)
    grid = figure.subplots(len(panels), 1 + compared, sharex="col", squeeze=False, height_ratios=lines)
    for row, panel, of in zip(grid, panels, names, strict=True):
        places = _places(of)
        _draw_means(row[0], panel.ranking, places, largest, unit)
        row[0].set_yticks(places, of)
        row[0].get_yticklabels()[0].set_fontweight("bold")
        if compared:
            _draw_differences(row[1], panel.ranking, places, largest, unit)
        for axes in row:
            axes.set_ylim(places[-1] + 0.6 + 0.5 * of[-1].count("\n"), -0.6 - 0.5 * of[0].count("\n"))
            axes.grid(False, axis="y")
            axes.tick_params(axis="y", length=0)
        _draw_heading(row, textwrap.fill(panel.heading, int(_HEADING_LETTERS * width)))
    for axes, name in zip(grid[-1], (quantity, "difference to the lowest"), strict=False):
        letters = int((1.0 if compared else 2.0) * _LABEL_LETTERS * width)
        axes.set_xlabel(textwrap.fill(f"{name} [{unit}]", letters))
        axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        _limit_axis(axes, 0.0 if axes is grid[-1][0] else -largest, 2.0 * largest)
    if compared:
        _add_legend(figure, panels)


def _places(names: Sequence[str]) -> list[float]:
    """The vertical position of each row: lines of text from the middle of the first one."""
    heights = [1 + name.count("\n") for name in names]
    return [sum(heights[:n]) + 0.5 * (heights[n] - heights[0]) for n in range(len(heights))]


def _draw_heading(row: Sequence[Axes], heading: str) -> None:
    """Write the heading from the left edge of the figure; the layout leaves its height free, but not its width."""
    row[-1].set_title("\n".join(" " for _ in heading.splitlines()), loc="right")
    start = ("figure fraction", "axes fraction")
    size = row[0].title.get_fontsize()
    note = row[0].annotate(
        heading, (0.01, 1.0), (0, 4), xycoords=start, textcoords="offset points", va="bottom", fontsize=size
    )
    note.set_in_layout(False)


def _limit_axis(axes: Axes, lowest: float, highest: float) -> None:
    """Keep intervals that are far wider than the means differ from stretching the axis."""
    low, high = axes.get_xlim()
    if highest > 0.0:  # methods without an error leave the axis as it is
        axes.set_xlim(max(low, lowest), min(high, highest))


def _draw_means(axes: Axes, ranking: MethodRanking, places: Sequence[float], largest: float, unit: str) -> None:
    for y, (name, values) in zip(places, ranking.values.items(), strict=True):
        style = _mark(ranking, name)
        if values.mean() > largest:
            _write_at_edge(axes, format_number(float(values.mean()), unit), y, style)
            continue
        if len(values) > 1:
            axes.hlines(y, *mean_interval(values), color=style["color"], linewidth=_LINE * mark_scale())
        _draw_dot(axes, float(values.mean()), y, style)


def _draw_differences(axes: Axes, ranking: MethodRanking, places: Sequence[float], largest: float, unit: str) -> None:
    axes.axvline(0.0, color=INK, linewidth=0.7)
    for y, name in zip(places, ranking.values, strict=True):
        style = _mark(ranking, name)
        if name == ranking.lowest:
            _draw_dot(axes, 0.0, y, style)
            continue
        result, difference = ranking.results[name], ranking.differences[name]
        if ranking.means[name] > largest:
            _write_at_edge(axes, format_number(difference, unit, signed=True), y, style)
            continue
        if result.low is not None and result.high is not None:  # of the lowest against the other: the sign is turned
            axes.hlines(y, -result.high, -result.low, color=style["color"], linewidth=_LINE * mark_scale())
        if name in ranking.simultaneous:
            axes.hlines(y, *ranking.simultaneous[name], color=style["color"], linewidth=0.4 * _LINE * mark_scale())
        _draw_dot(axes, difference, y, style)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)  # the line at zero stands for it


def _write_at_edge(axes: Axes, text: str, y: float, style: Mapping[str, Any]) -> None:
    """A value beyond the right end of the axis, as an arrow and a number."""
    edge = axes.get_yaxis_transform()
    arrow: Mapping[str, Any] = {"marker": ">", "color": style["color"], "markersize": _DOT * mark_scale()}
    axes.plot(1.0, y, linestyle="none", clip_on=False, transform=edge, **arrow)
    gap = (-1.5 * _DOT * mark_scale(), 0)
    place: Mapping[str, Any] = {"xytext": gap, "textcoords": "offset points", "ha": "right", "va": "center"}
    size = axes.xaxis.label.get_fontsize()
    axes.annotate(text, (1.0, y), xycoords=edge, color=style["color"], fontsize=size, **place)


def _mark(ranking: MethodRanking, name: str) -> Mapping[str, Any]:
    if name == ranking.lowest:
        return _LOWEST
    return _WORSE if ranking.results[name].verdict == "better" else _TIED


def _draw_dot(axes: Axes, x: float, y: float, style: Mapping[str, Any]) -> None:
    shown = {key: value for key, value in style.items() if key != "label"}
    axes.plot(x, y, linestyle="none", markersize=_DOT * mark_scale(), markeredgewidth=1.1 * mark_scale(), **shown)


def _add_legend(figure: Figure, panels: Sequence[RankingPanel]) -> None:
    """Explain the marks that occur."""
    from matplotlib.lines import Line2D

    used = [_mark(panel.ranking, name) for panel in panels for name in panel.ranking.values]
    marks = [style for style in (_LOWEST, _TIED, _WORSE) if style in used]
    size = {"linewidth": _LINE * mark_scale(), "markersize": _DOT * mark_scale()}
    handles = [Line2D([], [], **{**size, **style}) for style in marks]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
