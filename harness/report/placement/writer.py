"""Writes the page of a placement study from its findings."""

from pathlib import Path

from harness.core.files import write_text
from harness.report.kit.chart import clear_plots
from harness.report.kit.style import Chart
from harness.report.placement.body_map import draw_body_map, select_body_maps
from harness.report.placement.charts import charts
from harness.report.placement.page import PlacementContent, placement_page
from harness.results.folder_kind import FINDINGS
from harness.results.placement_findings import PlacementFindings, read_placement


def write_placement_page(folder: Path) -> Path:
    """Write FOLDER/plots and FOLDER/report.html of the study in `folder`; returns the path of the page.

    Without a body map the page says why. BadFile if there are no findings.
    """
    findings = read_placement(folder / FINDINGS)
    plots = clear_plots(folder)
    shown, missing = _draw_charts(findings)
    for chart in (chart for section in shown.values() for chart in section):
        chart.write(plots)
    path = folder / "report.html"
    write_text(path, placement_page(PlacementContent(findings, shown, missing)))
    return path


def _draw_charts(findings: PlacementFindings) -> tuple[dict[str, list[Chart]], list[str]]:
    """Section -> charts; and the charts that are missing, with the reason."""
    pictures = [
        draw_body_map(findings.candidates, shown, unit=findings.unit, number=number)
        for number, shown in enumerate(select_body_maps(findings.worth), start=1)
    ]
    missing = dict.fromkeys(f"The body map: {reason}" for chart, reason in pictures if chart is None)
    return {"body": [chart for chart, _ in pictures if chart], **charts(findings)}, list(missing)
