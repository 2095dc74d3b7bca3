"""The kinds of figures that `harness plot` draws, and the files of figures and tables for papers."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from harness.core.files import require_writable, write_output
from harness.errors import BadInput, UnknownName
from harness.report.figures.conditions import ConditionSet, read_conditions
from harness.report.figures.frame_figures import distribution_figure, over_time_figure
from harness.report.figures.mean_figures import joints_figure, ranking_figure
from harness.report.figures.print_figure import FigureSelection, PrintFigure, draw_figure
from harness.report.figures.table import DEFAULT_METRICS, ResultsTable, build_side_by_side_table, build_table
from harness.report.figures.table_formats import format_table
from harness.report.placement.pareto import placement_figure
from harness.results.files import require_kind


@dataclass(frozen=True)
class FigureKind:
    """One kind of figure."""

    text: str
    width_mm: int
    """Default width."""
    choices: tuple[str, ...] = ()
    """Fields of `FigureSelection` that it uses."""
    of_run: Callable[[ConditionSet, FigureSelection], PrintFigure] | None = None
    """Plans the figure of a run; None for that of a placement study."""


_WHAT = "a figure or a table"
_RANKING = "mean error of each method with its interval, and the difference to the lowest"
_TIME = "error over time on one clip: the leader and a control in colour, the others grey"
_CHOICES = ("methods", "condition")
KINDS = {
    "ranking": FigureKind(_RANKING, 85, (*_CHOICES, "metric"), ranking_figure),
    "time": FigureKind(_TIME, 170, (*_CHOICES, "metric", "clip", "control"), over_time_figure),
    "joints": FigureKind(
        "error at each bone of the leader and of a control", 85, (*_CHOICES, "clip", "control"), joints_figure
    ),
    "cdf": FigureKind(
        "distribution of the errors of single frames", 85, (*_CHOICES, "metric", "clip"), distribution_figure
    ),
    "placement": FigureKind("error against the number of stations, of a placement study", 170),
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
    fitting = [name for name, each in KINDS.items() if (each.of_run is not None) == (source == "run")]
    kind = kind or fitting[0]
    if kind not in fitting:
        this, other = ("a run", "a placement study") if source == "run" else ("a placement study", "a run")
        raise BadInput(f"--kind {kind} with {folder}, {this}.", f"It is for {other}. Choose {', '.join(fitting)}.")
    unused = [name for name, value in vars(selection).items() if value != getattr(FigureSelection(), name)]
    if unused := [name for name in unused if name not in KINDS[kind].choices]:
        raise BadInput(f"--{unused[0]} with --kind {kind}.", "It does not use that: leave it out.")
    plan = KINDS[kind].of_run
    if plan is None:
        return kind, placement_figure(folder)
    return kind, plan(read_conditions(folder).select(selection.condition, selection.methods), selection)


FOLDER = "figures"
"""Folder of figures inside that of the results."""


@dataclass(frozen=True)
class WrittenFigure:
    """A figure that was written."""

    path: Path
    kind: str
    width_mm: float
    height_mm: float
    caption: str
    """Sentences for the caption in a paper."""


def write_figure(
    folder: Path,
    kind: str = "",
    selection: FigureSelection | None = None,
    *,
    width_mm: int | None = None,
    out: Path | None = None,
    force: bool = False,
) -> WrittenFigure:
    """Draw the results in `folder` as one of KINDS and write the figure to `out`, or FOLDER/figures/NAME.pdf.

    The format is that of the suffix of `out`, otherwise PDF. The width is 85 or 170 mm, by default what suits the kind.
    UnknownName for a kind, format, metric, method, condition or clip that does not exist. BadInput for choices that do
    not fit each other or the folder, for a file that exists (unless `force`) and for one that cannot be written.
    BadFile for a folder without results, NothingMeasured for one without a measured cell.
    """
    fmt = (out.suffix.lower().removeprefix(".") if out else "") or "pdf"
    if out is not None:
        require_writable(out, _WHAT, force=force)
    kind, figure = plan_figure(folder, kind, selection or FigureSelection())
    path = out or folder / FOLDER / f"{figure.name}.{fmt}"
    require_writable(path, _WHAT, force=force)
    width_mm = width_mm or KINDS[kind].width_mm
    data, height_mm = draw_figure(figure, fmt, width_mm)
    write_output(path, data, _WHAT, force=force)
    return WrittenFigure(path, kind, float(width_mm), height_mm, figure.caption)


@dataclass(frozen=True)
class FormattedTable:
    """A table of results and its text."""

    table: ResultsTable
    text: str


def write_results_table(
    results: Path | Sequence[tuple[str, Path | str]],
    fmt: str,
    *,
    metrics: Sequence[str] = DEFAULT_METRICS,
    methods: Sequence[str] = (),
    condition: str = "",
    by_behaviour: bool = False,
    out: Path | None = None,
    force: bool = False,
) -> FormattedTable:
    """The table of results in one of TABLE_FORMATS; it is written to `out`, if given.

    `results` are the folder of a run or baseline (see `build_table`), or the names and folders of several (see
    `build_side_by_side_table`).

    UnknownName for another format; BadInput for a file that exists (unless `force`) or cannot be written.
    """
    if out is not None:
        require_writable(out, _WHAT, force=force)
    build: Callable[..., ResultsTable] = build_table if isinstance(results, Path) else build_side_by_side_table
    table = build(results, metrics, methods=methods, condition=condition, by_behaviour=by_behaviour)
    text = format_table(table, fmt)
    if out is not None:
        write_output(out, text, _WHAT, force=force)
    return FormattedTable(table, text)
