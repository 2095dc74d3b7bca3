"""Errors over time of the cells of one condition, by series, and the series that a figure highlights."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from harness.compare.ranking import MethodRanking
from harness.errors import BadInput, UnknownName
from harness.report.figures.conditions import ConditionSet, RunCondition
from harness.report.figures.selection import FigureSelection
from harness.report.kit.highlights import CONTROL, Highlights, choose_highlights, find_series
from harness.report.run.data import Row, RunData, Trace, last_varied, read_traces
from harness.results.manifest import Manifest
from harness.results.storage import read_summary


def choose_condition(run: ConditionSet, selection: FigureSelection) -> RunCondition:
    """The condition of a figure that shows one: the last varied values, causal methods, known performers.

    It has the chosen clip, if any. UnknownName for a clip that no condition has.
    """
    chosen = run.conditions
    if selection.clip:
        chosen = tuple(each for each in chosen if selection.clip in each.clips)
        if not chosen:
            clips = dict.fromkeys(clip for each in run.conditions for clip in each.clips)
            raise UnknownName("clip of the run", selection.clip, clips)
    last = chosen[-1].varied
    return next(each for each in chosen if each.varied == last and each.group.lag == chosen[0].group.lag)


def rank_highlights(condition: RunCondition, selection: FigureSelection) -> Highlights:
    """The series with the lowest mean joint angle error, and the control.

    UnknownName for a control that the condition lacks, BadInput when the methods share no clip.
    """
    ranking: MethodRanking | None = condition.rank()
    if ranking is None:
        raise BadInput("The methods share no measured clip.", "Choose methods with --methods.")
    leader, *others = ranking.values
    if selection.control and not find_series(others, selection.control):
        raise UnknownName("control among the methods shown", selection.control, others)
    return choose_highlights([leader, *others], selection.control or CONTROL)


def read_series(
    folder: Path, condition: RunCondition, keep: Callable[[str, Row], bool]
) -> Mapping[str, Sequence[Trace]]:
    """Series -> traces of the cells of a condition that `keep` accepts by series and row; in the condition's order.

    BadFile for a damaged cell.
    """
    summary = read_summary(folder)
    run = RunData(folder, Manifest.read(folder / "manifest.json"), last_varied(summary), (), summary)
    rows = [row for row in condition.cells if keep(condition.series_of(row), row)]
    found: dict[str, list[Trace]] = {}
    for row, trace in zip(rows, read_traces(run, rows), strict=True):
        found.setdefault(condition.series_of(row), []).append(trace)
    return found
