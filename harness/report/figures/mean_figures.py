"""The figures of means: `ranking`, a panel for each condition, and `joints`, errors at each bone next to a control."""

from collections.abc import Mapping

import numpy as np

from harness.compare import count_clips, mean_interval
from harness.core.arrays import Floats
from harness.core.number_format import count_noun
from harness.errors import BadInput
from harness.report.figures.conditions import (
    RANKING_METRICS,
    ConditionSet,
    RunCondition,
    check_metric,
    choose_condition,
    describe_absent,
    rank_highlights,
    read_series,
)
from harness.report.figures.print_figure import MM_PER_IN, WIDTHS_MM, FigureSelection, PrintFigure
from harness.report.kit.axes import label_rows
from harness.report.kit.error_lines import Highlights
from harness.report.kit.ranking import RankingPanel, draw_ranking, explain_marks
from harness.report.kit.style import COLOURS, INK, PAPER, Axes, Figure, mark_scale
from harness.report.kit.text import metric_name
from harness.report.run.joint_errors import BONE_ROWS, means_by_unit
from harness.results import PRIMARY_METRIC
from harness.score import DEFINITIONS

_HEIGHT_MM = 60.0
"""Height before the rows are counted."""


def ranking_figure(run: ConditionSet, selection: FigureSelection) -> PrintFigure:
    """The ranking of every selected condition, by the statistics of `harness compare`."""
    metric = selection.metric
    check_metric(metric, RANKING_METRICS, "metric that ranks methods")
    ranked = [(each, ranking) for each in run.conditions if (ranking := each.rank(metric))]
    panels = [RankingPanel(each.name, ranking) for each, ranking in ranked]
    if not panels:
        raise BadInput(f"No clip of {run.folder} has {metric} of every method.", "Choose methods with --methods.")
    unit = DEFINITIONS[metric].unit
    return PrintFigure(
        "ranking" if metric == PRIMARY_METRIC else f"ranking_{metric}",
        _ranking_caption(run, metric, [each for each, _ in ranked], panels),
        lambda figure: draw_ranking(figure, panels, metric_name(metric), unit),
        _HEIGHT_MM,
    )


def _ranking_caption(run: ConditionSet, metric: str, shown: list[RunCondition], panels: list[RankingPanel]) -> str:
    counts = list(
        dict.fromkeys(count_clips(panel.ranking.clips, of.sampling) for of, panel in zip(shown, panels, strict=True))
    )
    fewer = any(len(panel.ranking.clips) < len(each.clips) for each, panel in zip(shown, panels, strict=True))
    clips = " and ".join(counts) + (" that all methods were measured on" if fewer else "")
    sentences = [f"Mean {metric_name(metric)} on {clips}.", explain_marks(panels)]
    unranked = len(run.conditions) - len(panels)
    sentences += [f"In {count_noun(unranked, 'condition')} the methods share no clip."] if unranked else []
    expected = (name for each in shown for name in each.series)
    absent = describe_absent(expected, (name for panel in panels for name in panel.ranking.values))
    return " ".join(sentences) + absent + run.missing_note


_PANELS = ("rotation error [deg]", "position error of the far end [mm]")
_ROW_MM, _FRAME_MM = 3.2, 18.0
"""Height of a row, and of axis and legend [mm]."""


def joints_figure(run: ConditionSet, selection: FigureSelection) -> PrintFigure:
    """Mean error at each bone in one condition, or on one of its clips; a wide figure shows positions too."""
    condition = choose_condition(run, selection)
    highlights = rank_highlights(condition, selection)
    shown = [name for name in (highlights.leader, highlights.control) if name]
    traces = read_series(run.folder, condition, lambda name, row: name in shown and selection.clip in ("", row["clip"]))
    means = {name: found for name, of in traces.items() if len((found := means_by_unit(of, condition.sampling))[0])}
    if highlights.leader not in means:
        raise BadInput(f"{highlights.leader} was not measured on {selection.clip}.", "Choose another clip with --clip.")
    count = len(means[highlights.leader][0])
    clips = {trace.clip for trace in traces[highlights.leader]}
    where = (selection.clip or count_clips(clips, condition.sampling)) + (
        f", {condition.name}" if condition.name else ""
    )
    against = f" Diamonds: {highlights.control}, the control." if highlights.control in means else ""
    leader = f"{highlights.leader}, the method with the lowest mean joint angle error"
    return PrintFigure(
        "joints",
        f"Mean error of {leader}, at each bone on {where}. "
        "Rotation error: geodesic error of the rotation relative to the parent bone."
        f"{' Whiskers: 95 % interval over units.' if count > 1 else ''}{against}{run.missing_note}",
        lambda figure: _draw_joints(figure, means, highlights),
        _FRAME_MM + _ROW_MM * len(BONE_ROWS),
    )


def _draw_joints(figure: Figure, means: Mapping[str, tuple[Floats, Floats]], highlights: Highlights) -> None:
    panels = _PANELS if figure.get_figwidth() * MM_PER_IN > WIDTHS_MM[0] + 1.0 else _PANELS[:1]
    grid = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
    for part, (axes, label) in enumerate(zip(grid, panels, strict=True)):
        _draw_bars(axes, means[highlights.leader][part], highlights.leader + highlights.role(highlights.leader))
        if highlights.control is not None and highlights.control in means:
            control = means[highlights.control][part].mean(axis=0)
            style = {"markersize": 3.6 * mark_scale(), "color": PAPER, "markeredgecolor": COLOURS[0]}
            name = highlights.control + highlights.role(highlights.control)
            axes.plot(control, np.arange(len(control)), "D", label=name, **style)
        axes.set_xlabel(label)
        axes.set_xlim(left=0.0)
        axes.grid(False, axis="y")
        axes.tick_params(axis="y", length=0)
    label_rows(grid[0], list(BONE_ROWS.values()))
    handles, names = grid[0].get_legend_handles_labels()
    order = sorted(range(len(names)), key=lambda n: not names[n].startswith(highlights.leader))
    figure.legend([handles[n] for n in order], [names[n] for n in order], loc="outside upper left", ncols=len(panels))


def _draw_bars(axes: Axes, values: Floats, label: str) -> None:
    """A bar for the mean of each column of (units, 22) values, and its interval."""
    rows = np.arange(values.shape[1])
    axes.barh(rows, values.mean(axis=0), 0.68, color=COLOURS[4], label=label)
    if len(values) > 1:
        low, high = np.transpose([mean_interval(column) for column in values.T])
        axes.hlines(rows, np.maximum(low, 0.0), high, color=INK, linewidth=1.0 * mark_scale())
