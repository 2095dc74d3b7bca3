"""A ranking of methods as dots: the mean error of each with its interval, and its paired difference to the lowest."""

import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from harness.compare.paired_statistics import MIN_CLIPS, mean_interval
from harness.compare.ranking import MethodRanking
from harness.core.number_format import count_noun
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, mark_scale

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LOWEST: Mapping[str, Any] = {"marker": "D", "color": COLOURS[1], "label": "lowest mean"}
_TIED: Mapping[str, Any] = {"marker": "o", "color": COLOURS[1], "markerfacecolor": PAPER, "label": "tied with it"}
_WORSE: Mapping[str, Any] = {"marker": "s", "color": FAINT, "label": "worse"}
"""Marks of a row; they differ in shape and filling, so that they can be told apart without colour."""
_ROW_MM, _FRAME_MM, _TITLE_MM = 4.2, 20.0, 8.0
"""Height of a line of text of a row, of axis and legend, and of a panel's title [mm]."""
_LETTERS, _MOST_LINES, _TITLE_LETTERS_PER_IN = 24, 3, 10.0
"""Letters of a line of a name, its most lines, and letters of a line of a title for each inch of the figure."""
_ONE_LINE_FROM_IN = 6.0
"""Width of a figure from which on labels of axes have one line, in text of 10 pt [in]."""
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
        """Title and number of clips, and whether they can show a difference."""
        clips = len(self.ranking.clips)
        counted = count_noun(clips, "clip")
        too_few = ": differences cannot be shown" if clips < MIN_CLIPS and self.ranking.results else ""
        return f"{self.title} ({counted}){too_few}" if self.title else f"{counted}{too_few}"

    @property
    def names(self) -> list[str]:
        """The name of each row in several lines."""
        return [wrap_name(name) for name in self.ranking.values]

    @property
    def lines(self) -> int:
        """Lines of text of all rows."""
        return sum(1 + name.count("\n") for name in self.names)


def wrap_name(name: str, letters: int = _LETTERS) -> str:
    """A name in at most three lines, broken at blanks, commas, brackets, colons and plus signs where possible."""
    breakable = "".join(f"{sign} " if sign in ",:+" else f" {sign}" if sign in "[(" else sign for sign in name)
    lines = textwrap.wrap(breakable, letters) if len(name) > letters else [name]
    for sign in ",:+":
        lines = [line.replace(f"{sign} ", sign) for line in lines]
    lines = [line.replace(" [", "[") for line in lines]
    kept = lines[:_MOST_LINES]
    return "\n".join(kept) + ("…" if len(lines) > _MOST_LINES else "")


def ranking_height_mm(panels: Sequence[RankingPanel]) -> float:
    """Height of the chart in print [mm]."""
    return _FRAME_MM + sum(_TITLE_MM + _ROW_MM * panel.lines for panel in panels)


def draw_ranking(figure: "Figure", panels: Sequence[RankingPanel], quantity: str, unit: str) -> None:
    """Draw the panels below each other: means on the left, differences to the lowest mean on the right.

    Without any other method to compare with there are means alone.
    """
    from matplotlib.ticker import MaxNLocator

    compared = any(panel.ranking.results for panel in panels)
    ratios = [panel.lines + 0.6 for panel in panels]
    grid = figure.subplots(len(panels), 1 + compared, sharex="col", squeeze=False, height_ratios=ratios)
    for row, panel in zip(grid, panels, strict=True):
        _draw_means(row[0], panel)
        if compared:
            _draw_differences(row[1], panel.ranking)
        for axes in row:
            axes.set_ylim(len(panel.ranking.values) - 0.4, -0.6)
            axes.grid(False, axis="y")
            axes.tick_params(axis="y", length=0)
        _draw_heading(row, panel.heading, int(_TITLE_LETTERS_PER_IN * figure.get_figwidth() / mark_scale()))
    gap = "\n" if compared and figure.get_figwidth() < _ONE_LINE_FROM_IN * mark_scale() else " "
    for axes, name in zip(grid[-1], (quantity, "difference to the lowest"), strict=False):
        axes.set_xlabel(f"{name}{gap}[{unit}]")
        axes.xaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 2.5, 5, 10]))
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    if compared:
        _add_legend(figure, panels)


def _draw_heading(row: Sequence["Axes"], heading: str, letters: int) -> None:
    """Write the heading over the whole row: the layout leaves its height free, but not its width."""
    text = textwrap.fill(heading, letters)
    row[0].set_title(text, loc="left").set_in_layout(False)
    row[-1].set_title("\n".join(" " for _ in text.splitlines()), loc="right")


def _draw_means(axes: "Axes", panel: RankingPanel) -> None:
    ranking = panel.ranking
    for y, (name, values) in enumerate(ranking.values.items()):
        style = _mark(ranking, name)
        if len(values) > 1:
            axes.hlines(y, *mean_interval(values), color=style["color"], linewidth=_LINE * mark_scale())
        _draw_dot(axes, float(values.mean()), y, style)
    axes.set_yticks(range(len(panel.names)), panel.names)
    axes.get_yticklabels()[0].set_fontweight("bold")


def _draw_differences(axes: "Axes", ranking: MethodRanking) -> None:
    axes.axvline(0.0, color=INK, linewidth=0.7)
    for y, name in enumerate(ranking.values):
        style = _mark(ranking, name)
        if y == 0:
            _draw_dot(axes, 0.0, y, style)
            continue
        result, difference = ranking.results[name], ranking.differences[name]
        if result.low is not None and result.high is not None:  # of the lowest against the other: the sign is turned
            axes.hlines(y, -result.high, -result.low, color=style["color"], linewidth=_LINE * mark_scale())
        _draw_dot(axes, difference, y, style)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)  # the line at zero stands for it


def _mark(ranking: MethodRanking, name: str) -> Mapping[str, Any]:
    if name == ranking.lowest:
        return _LOWEST
    return _WORSE if ranking.results[name].verdict == "better" else _TIED


def _draw_dot(axes: "Axes", x: float, y: float, style: Mapping[str, Any]) -> None:
    shown = {key: value for key, value in style.items() if key != "label"}
    axes.plot(x, y, linestyle="none", markersize=_DOT * mark_scale(), markeredgewidth=1.1 * mark_scale(), **shown)


def _add_legend(figure: "Figure", panels: Sequence[RankingPanel]) -> None:
    """Explain the marks that occur."""
    from matplotlib.lines import Line2D

    used = [_mark(panel.ranking, name) for panel in panels for name in panel.ranking.values]
    marks = [style for style in (_LOWEST, _TIED, _WORSE) if style in used]
    size = {"linewidth": _LINE * mark_scale(), "markersize": _DOT * mark_scale()}
    handles = [Line2D([], [], **{**size, **style}) for style in marks]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
