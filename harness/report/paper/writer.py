"""Writes the page of a reproduced paper from its findings."""

from pathlib import Path

from harness.core.files import write_text
from harness.report.kit.chart import clear_plots
from harness.report.paper.charts import charts
from harness.report.paper.page import PaperContent, paper_page, run_link
from harness.results.findings import read_findings
from harness.results.folder_kind import FINDINGS


def write_paper_page(folder: Path) -> Path:
    """Write FOLDER/plots and FOLDER/report.html of the study in `folder`; returns the path of the page.

    BadFile if there are no findings.
    """
    findings = read_findings(folder / FINDINGS)
    plots = clear_plots(folder)
    pictures = charts(findings)
    for chart in (chart for figures in pictures.values() for chart in figures if chart):
        chart.write(plots)
    runs = (name for experiment in findings.experiments for name in experiment.runs)
    pages = {name: target for name in runs if (target := run_link(folder, name))}
    path = folder / "report.html"
    write_text(path, paper_page(PaperContent(findings, pictures, pages)))
    return path
