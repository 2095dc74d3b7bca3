"""Writes a figure or a table for a paper from the folder of a run or a placement study."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from harness.core.fault_report import is_system_fault
from harness.core.files import write_bytes
from harness.errors import BadInput
from harness.report.figures.kinds import KINDS, plan_figure
from harness.report.figures.selection import FigureSelection
from harness.report.figures.table import DEFAULT_METRICS, ResultsTable, build_table
from harness.report.figures.table_formats import format_table
from harness.report.kit.print_figure import draw_figure

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
        _check_output(out, force)
    kind, figure = plan_figure(folder, kind, selection or FigureSelection())
    path = out or folder / FOLDER / f"{figure.name}.{fmt}"
    _check_output(path, force)
    drawn = draw_figure(figure, fmt, width_mm or KINDS[kind].width_mm)
    _write_output(path, drawn.data)
    return WrittenFigure(path, kind, drawn.width_mm, drawn.height_mm, figure.caption)


@dataclass(frozen=True)
class FormattedTable:
    """A table of results and its text."""

    table: ResultsTable
    text: str


def write_results_table(
    folder: Path,
    fmt: str,
    *,
    metrics: Sequence[str] = DEFAULT_METRICS,
    methods: Sequence[str] = (),
    condition: str = "",
    by_behaviour: bool = False,
    out: Path | None = None,
    force: bool = False,
) -> FormattedTable:
    """The table of the run in `folder` (see `build_table`) in one of TABLE_FORMATS; it is written to `out`, if given.

    UnknownName for another format; BadInput for a file that exists (unless `force`) or cannot be written.
    """
    if out is not None:
        _check_output(out, force)
    table = build_table(folder, metrics, methods=methods, condition=condition, by_behaviour=by_behaviour)
    text = format_table(table, fmt)
    if out is not None:
        _write_output(out, text.encode())
    return FormattedTable(table, text)


def _check_output(path: Path, force: bool) -> None:
    """BadInput when a file exists that is not to be replaced, or a folder has its name."""
    if path.is_dir():
        raise BadInput(f"{path} is a folder.", "Name a file with --out.")
    if path.exists() and not force:
        raise BadInput(f"{path} exists.", "Name another file with --out, or replace it with --force.")


def _write_output(path: Path, data: bytes) -> None:
    """Write a file atomically and create its folder; BadInput when its place cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, data)
    except OSError as error:
        if is_system_fault(error):
            raise
        raise BadInput(f"{path} cannot be written ({error.strerror}).", "Name another file with --out.") from error
