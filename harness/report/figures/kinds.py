"""The kinds of figures that `harness plot` draws: what each shows, of which results, and what can be chosen."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from harness.errors import BadInput, UnknownName
from harness.report.figures.conditions import ConditionSet, read_conditions
from harness.report.figures.distribution import distribution_figure
from harness.report.figures.joints import joints_figure
from harness.report.figures.over_time import over_time_figure
from harness.report.figures.placement import placement_figure
from harness.report.figures.ranking import ranking_figure
from harness.report.figures.selection import FigureSelection
from harness.report.kit.print_figure import PrintFigure
from harness.results.folder_kind import require_kind

_FROM_RUN: dict[str, Callable[[ConditionSet, FigureSelection], PrintFigure]] = {
    "ranking": ranking_figure,
    "time": over_time_figure,
    "joints": joints_figure,
    "cdf": distribution_figure,
}


@dataclass(frozen=True)
class FigureKind:
    """One kind of figure."""

    text: str
    source: Literal["run", "placement"]
    width_mm: int
    """Default width."""
    choices: frozenset[str]
    """Fields of `FigureSelection` that it uses."""


KINDS = {
    "ranking": FigureKind(
        "mean error of each method with its interval, and the difference to the lowest",
        "run",
        85,
        frozenset({"metric", "methods", "condition"}),
    ),
    "time": FigureKind(
        "error over time on one clip: the leader and a control in colour, the others grey",
        "run",
        170,
        frozenset({"metric", "methods", "condition", "clip", "control"}),
    ),
    "joints": FigureKind(
        "error at each bone of the leader and of a control",
        "run",
        85,
        frozenset({"methods", "condition", "clip", "control"}),
    ),
    "cdf": FigureKind(
        "distribution of the errors of single frames",
        "run",
        85,
        frozenset({"metric", "methods", "condition", "clip"}),
    ),
    "placement": FigureKind(
        "error against the number of stations, of a placement study", "placement", 170, frozenset()
    ),
}
"""Kind -> what it shows."""


def plan_figure(folder: Path, kind: str, selection: FigureSelection) -> tuple[str, PrintFigure]:
    """The kind and the figure of the results in a folder; without a kind `ranking`, or `placement` for a study.

    UnknownName for a kind, metric, method, condition or clip that does not exist. BadInput for a kind that does not fit
    the folder, and for choices that the kind does not use. NothingMeasured when no cell has an error.
    """
    if kind and kind not in KINDS:
        raise UnknownName("kind of figure", kind, KINDS)
    source = require_kind(folder, "run", "placement")
    kind = kind or next(name for name, each in KINDS.items() if each.source == source)
    if KINDS[kind].source != source:
        fitting = ", ".join(name for name, each in KINDS.items() if each.source == source)
        names = {"run": "a run", "placement": "a placement study"}
        raise BadInput(
            f"--kind {kind} with {folder}, {names[source]}.",
            f"It is for {names[KINDS[kind].source]}. Choose {fitting}.",
        )
    unused = [name for name, value in vars(selection).items() if value != getattr(FigureSelection(), name)]
    if unused := [name for name in unused if name not in KINDS[kind].choices]:
        raise BadInput(f"--{unused[0]} with --kind {kind}.", "It does not use that: leave it out.")
    if kind not in _FROM_RUN:
        return kind, placement_figure(folder)
    run = read_conditions(folder).select(selection.condition, selection.methods)
    return kind, _FROM_RUN[kind](run, selection)
