"""The figure `placement`: error of every set of stations against their number, with the best of each size and ties."""

from pathlib import Path
from typing import TYPE_CHECKING

from harness.compare.paired_statistics import MIN_UNITS
from harness.core.number_format import count_noun
from harness.errors import NothingMeasured
from harness.report.kit.metric_labels import metric_name
from harness.report.kit.print_figure import PrintFigure
from harness.report.placement.pareto import draw_pareto, measured_best
from harness.report.placement.wording import measured_errors
from harness.results.folder_kind import FINDINGS
from harness.results.placement_findings import PlacementFindings, read_placement

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEIGHT_MM = 85.0


def placement_figure(folder: Path) -> PrintFigure:
    """Error against the number of stations. BadFile without findings, NothingMeasured when no set has an error."""
    findings = read_placement(folder / FINDINGS)
    if not measured_best(findings):
        raise NothingMeasured(folder, len(findings.failures))

    def draw(figure: "Figure") -> None:
        draw_pareto(figure, findings, f"{metric_name(findings.metric)} [{findings.unit}]")
        handles, names = figure.axes[0].get_legend_handles_labels()
        marks = dict(zip(names, handles, strict=True))
        figure.legend(marks.values(), marks.keys(), loc="outside upper left", ncols=len(marks))

    return PrintFigure("placement", _caption(findings), draw, _HEIGHT_MM)


def _caption(findings: PlacementFindings) -> str:
    clips = max(len(measured_errors(tried)) for _, tried in measured_best(findings))
    few = "" if clips >= MIN_UNITS else " Differences cannot be shown with so few clips, so all sets count as tied."
    failed = len(findings.failures)
    return (
        f"Mean {metric_name(findings.metric)} of sets of stations on {count_noun(clips, 'clip')} of {findings.motion}. "
        "Diamonds: the best set of each size with the 95 % interval of its mean, filled if no smaller set is better. "
        f"Circles: sets of the same size that are not significantly worse.{few}"
        + (f" {count_noun(failed, 'cell')} of {findings.planned:,} failed." if failed else "")
    )
