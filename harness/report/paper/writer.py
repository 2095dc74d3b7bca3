"""Writes the page of a reproduced paper from its findings."""

from importlib.util import find_spec
from pathlib import Path

from harness.core.files import write_text
from harness.report.kit.chart import clear_plots
from harness.report.paper.charts import charts
from harness.report.paper.page import PaperContent, paper_page, run_link
from harness.results.findings import read_findings
from harness.results.folder_kind import FINDINGS


def write_paper_page(folder: Path) -> Path:
    """Write FOLDER/plots and FOLDER/report.html of the study in `folder`; returns the path of the page.

    Without matplotlib the page has tables instead of figures and says why. BadFile if there are no findings.
    """
    findings = read_findings(folder / FINDINGS)
    plots = clear_plots(folder)
    drawable = find_spec("matplotlib") is not None
    pictures = charts(findings) if drawable else {}
    for chart in (chart for figures in pictures.values() for chart in figures if chart):
        chart.write(plots)
    runs = (name for experiment in findings.experiments for name in experiment.runs)
    pages = {name: target for name in runs if (target := run_link(folder, name))}
    any_figure = any(experiment.figures for experiment in findings.experiments)
    missing = [] if drawable or not any_figure else ["Figures: matplotlib is not installed; tables show their numbers"]
    path = folder / "report.html"
    write_text(path, paper_page(PaperContent(findings, pictures, pages, missing)))
    return path
