"""The report of a placement study, written from its findings alone."""

from importlib.util import find_spec
from pathlib import Path

from harness.core.files import write_text
from harness.report.kit.style import Chart
from harness.report.placement.body_map import draw_body_map, select_body_maps
from harness.report.placement.charts import charts
from harness.report.placement.page import PlacementContent, placement_page
from harness.results.placement_findings import PlacementFindings, read_placement

FINDINGS = "findings.json"
"""In the folder of a study."""


def write_placement_page(folder: Path) -> Path:
    """Write FOLDER/plots and FOLDER/report.html of the study in `folder`; returns the page.

    What cannot be drawn here is said on the page, which then has tables instead. BadFile when there are no findings.
    """
    findings = read_placement(folder / FINDINGS)
    plots = folder / "plots"
    plots.mkdir(exist_ok=True)
    for old in (*plots.glob("*.svg"), *plots.glob("*.png")):
        old.unlink()
    shown, missing = _draw_charts(findings)
    for chart in (chart for found in shown.values() for chart in found):
        chart.write(plots)
    path = folder / "report.html"
    write_text(path, placement_page(PlacementContent(findings, shown, missing)))
    return path


def _draw_charts(findings: PlacementFindings) -> tuple[dict[str, list[Chart]], list[str]]:
    """Section -> charts, and what is missing."""
    if find_spec("matplotlib") is None:
        return {}, ["Figures: matplotlib is not installed (extra viz); their numbers are tables"]
    pictures = [
        draw_body_map(findings.candidates, shown, unit=findings.unit, number=number)
        for number, shown in enumerate(select_body_maps(findings.worth), start=1)
    ]
    gaps = dict.fromkeys(f"The body in colours: {reason}" for chart, reason in pictures if chart is None)
    return {"body": [chart for chart, _ in pictures if chart], **charts(findings)}, list(gaps)
