"""The report of a paper rerun, written from its findings alone."""

from importlib.util import find_spec
from pathlib import Path

from harness.core.files import write_text
from harness.report.paper.charts import charts
from harness.report.paper.page import PaperContent, paper_page, run_link
from harness.results.findings import read_findings

FINDINGS = "findings.json"
"""In the folder of a study."""


def write_paper_page(folder: Path) -> Path:
    """Write FOLDER/plots and FOLDER/report.html of the study in `folder`; returns the page.

    Without matplotlib the page has the figures' numbers instead and says why. BadFile when there are no findings.
    """
    findings = read_findings(folder / FINDINGS)
    plots = folder / "plots"
    plots.mkdir(exist_ok=True)
    for old in (*plots.glob("*.svg"), *plots.glob("*.png")):
        old.unlink()
    drawable = find_spec("matplotlib") is not None
    pictures = charts(findings) if drawable else {}
    for chart in (chart for found in pictures.values() for chart in found if chart):
        chart.write(plots)
    runs = (name for experiment in findings.experiments for name in experiment.runs)
    pages = {name: target for name in runs if (target := run_link(folder, name))}
    any_figure = any(experiment.figures for experiment in findings.experiments)
    missing = [] if drawable or not any_figure else ["Figures: matplotlib is not installed; their numbers are tables"]
    path = folder / "report.html"
    write_text(path, paper_page(PaperContent(findings, pictures, pages, missing)))
    return path
