"""Error of a placement study against the number of stations, for its page and as the figure `placement` of papers."""

import math
import textwrap
from pathlib import Path
from typing import Any

from harness.compare import MIN_UNITS
from harness.core.number_format import count_noun
from harness.core.seeds import generator
from harness.errors import NothingMeasured
from harness.report.figures.print_figure import PrintFigure
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Axes, Figure, mark_scale, note_size
from harness.report.kit.text import metric_name
from harness.report.placement.wording import measured_errors, set_name
from harness.results.files import FINDINGS
from harness.results.findings import BestSet, PlacementFindings, StationSetResult, read_placement

_BEST, _TIED = COLOURS[1], COLOURS[0]
_LETTERS_PER_IN, _FEWEST_LETTERS, _AXES_SHARE = 11.2, 8, 0.75
"""Letters of the names of all best sets together for each inch of width, in text of 10 pt; fewest of one name; height
of the axes as a share of the figure's."""


def measured_best(findings: PlacementFindings) -> list[tuple[BestSet, StationSetResult]]:
    """The best set of each size and its result; sizes without a measured one are left out."""
    return [(b, t) for b in findings.best if (t := findings.of(b.stations)) and t.mean is not None]


def mean_or_nan(tried: StationSetResult) -> float:
    """The mean of a set; NaN if it was not measured."""
    return math.nan if tried.mean is None else tried.mean


def draw_pareto(figure: Figure, findings: PlacementFindings, label: str) -> None:
    """Draw every set as a point, the best of each size with its interval and name, and circles around tied sets."""
    axes, size_of_mark = figure.subplots(), 6.5 * mark_scale()
    means: dict[int, list[float]] = {}
    for tried in sorted(findings.tried, key=lambda tried: len(tried.stations)):
        if tried.mean is not None:
            means.setdefault(len(tried.stations), []).append(tried.mean)
    best = measured_best(findings)
    positions = {size: n for n, size in enumerate(means)}
    for size, x in positions.items():
        spread = min(0.3, 0.02 * len(means[size]))
        jittered = x + generator(0, "pareto", str(size)).uniform(-spread, spread, len(means[size]))
        dots: dict[str, Any] = {"markersize": 2.6 * mark_scale(), "markeredgewidth": 0.0}
        axes.plot(jittered, means[size], "o", color=FAINT, alpha=0.45, label="every set", **dots)
    front = [(positions[len(b.stations)], mean_or_nan(t)) for b, t in best if b.on_front]
    axes.plot([x for x, _ in front], [y for _, y in front], color=_BEST, drawstyle="steps-post", alpha=0.5)
    names = {b.stations: _wrap(figure, set_name(b.stations), len(positions)) for b, _ in best}
    for b, t in best:
        x, bottom = positions[len(b.stations)], mean_or_nan(t) if t.low is None else t.low
        if t.low is not None and t.high is not None:
            axes.vlines(x, t.low, t.high, color=INK, linewidth=1.3 * mark_scale())
        ties = [mean_or_nan(tied) for tie in b.ties if (tied := findings.of(tie)) and tied.mean is not None]
        edge: dict[str, Any] = {"markersize": size_of_mark, "markeredgewidth": mark_scale()}
        axes.plot([x] * len(ties), ties, "o", color="none", markeredgecolor=_TIED, label="tied with the best", **edge)
        face = _BEST if b.on_front else PAPER
        axes.plot(x, mean_or_nan(t), "D", color=face, markeredgecolor=_BEST, zorder=3, label="best of its size", **edge)
        axes.annotate(
            names[b.stations],
            (x, bottom),
            xytext=(0, -5.0 * mark_scale()),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=note_size(),
            linespacing=1.05,
        )
    axes.set_xticks(list(positions.values()), [_size_label(findings, size) for size in positions])
    axes.set_xlim(-0.6, len(positions) - 0.4)
    axes.set_xlabel("stations")
    axes.set_ylabel(label)
    _leave_space_below(figure, axes, max((1 + name.count("\n") for name in names.values()), default=0))
    axes.grid(False, axis="x")


def _leave_space_below(figure: Figure, axes: Axes, lines: int) -> None:
    """Extend the vertical axis downwards, by the height of a name of so many lines."""
    low, high = axes.get_ylim()
    share = 0.03 + 1.15 * lines * note_size() / (_AXES_SHARE * 72.0 * figure.get_figheight())
    axes.set_ylim(low - share / (1.0 - share) * (high - low), high)


def _wrap(figure: Figure, name: str, sizes: int) -> str:
    """The name in lines that fit between its neighbours."""
    letters = _LETTERS_PER_IN * figure.get_figwidth() / mark_scale() / sizes
    return textwrap.fill(name, max(int(letters), _FEWEST_LETTERS))


def _size_label(findings: PlacementFindings, size: int) -> str:
    """The number of stations, and the rate if it depends on the size of the set."""
    rates = {tried.rate_hz for tried in findings.tried}
    rates_of_size = {tried.rate_hz for tried in findings.tried if len(tried.stations) == size}
    return f"{size}\n{'/'.join(f'{rate:g}' for rate in sorted(rates_of_size))} Hz" if len(rates) > 1 else str(size)


_HEIGHT_MM = 85.0


def placement_figure(folder: Path) -> PrintFigure:
    """Error against the number of stations. BadFile without findings, NothingMeasured when no set has an error."""
    findings = read_placement(folder / FINDINGS)
    if not measured_best(findings):
        raise NothingMeasured(folder, len(findings.failures))

    def draw(figure: Figure) -> None:
        draw_pareto(figure, findings, f"{metric_name(findings.metric)} [{findings.unit}]")
        handles, names = figure.axes[0].get_legend_handles_labels()
        marks = dict(zip(names, handles, strict=True))
        figure.legend(marks.values(), marks.keys(), loc="outside upper left", ncols=len(marks))

    return PrintFigure("placement", _figure_caption(findings), draw, _HEIGHT_MM)


def _figure_caption(findings: PlacementFindings) -> str:
    clips = max(len(measured_errors(tried)) for _, tried in measured_best(findings))
    few = "" if clips >= MIN_UNITS else " Differences cannot be shown with so few clips, so all sets count as tied."
    failed = len(findings.failures)
    return (
        f"Mean {metric_name(findings.metric)} of sets of stations on {count_noun(clips, 'clip')} of {findings.motion}. "
        "Diamonds: the best set of each size with the 95 % interval of its mean, filled if no smaller set is better. "
        f"Circles: sets of the same size that are not significantly worse.{few}"
        + (f" {count_noun(failed, 'cell')} of {findings.planned:,} failed." if failed else "")
    )
