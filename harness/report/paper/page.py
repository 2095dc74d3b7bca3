"""The page of a reproduced paper: count of verdicts, every claim, then each experiment with figures and tables."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote

from harness.core.files import to_json_types
from harness.report.kit.document import Section, chart_figure, document
from harness.report.kit.markup import Markup, bullet_list, details, inline_code, join, tag
from harness.report.kit.statement_lines import MARKS
from harness.report.kit.style import Chart
from harness.report.kit.text import describe_motion_source
from harness.report.kit.verdict_badge import tally_list
from harness.report.paper.claims import anchor, claims_table
from harness.report.paper.figure_table import figure_table
from harness.report.paper.side_by_side import printed_statements, statements_table
from harness.report.paper.table import paper_table
from harness.report.paper.verdicts import MEANINGS, all_claims, count_verdicts, sentence, shared_differences
from harness.results.findings import BarChart, LineChart, PaperExperiment, PaperFindings


@dataclass(frozen=True)
class PaperContent:
    """Everything that the page of a paper shows."""

    findings: PaperFindings
    charts: Mapping[str, Sequence[Chart | None]]
    """Experiment -> its charts, None for a figure without values; empty where matplotlib is missing."""
    pages: Mapping[str, str]
    """Folder of a run -> its page or folder, relative to the study's folder; only those that exist."""
    missing: Sequence[str]
    """Parts that are not on the page, and why."""


def paper_page(content: PaperContent) -> str:
    """The HTML of the page."""
    findings = content.findings
    claims = all_claims(findings)
    facts = {
        "Paper": findings.reference,
        "Motion": describe_motion_source(findings.motion),
        "Made by": f"{findings.command} (seed {findings.seed})",
    }
    statements = printed_statements(findings)
    experiments = [(e.title, anchor(e), _experiment(content, e)) for e in findings.experiments]
    sections: list[Section] = [
        ("Printed statements", "statements", statements_table(statements) if statements else Markup()),
        ("All claims", "claims", claims_table(findings)),
        *experiments,
        ("Differences from the paper in several experiments", "throughout", _common_differences(findings)),
        ("Databases and clips", "databases", join(*map(paper_table, findings.tables))),
        ("Circumstances", "circumstances", _circumstances(findings)),
    ]
    return document(
        title=f"{findings.paper} on {findings.motion}: harness paper",
        kicker=f"harness paper · {findings.paper} · {findings.motion}",
        heading=sentence(claims),
        facts=facts,
        missing=content.missing,
        sections=sections,
        lead=tally_list(count_verdicts([c for c in claims if c.kind == "printed"]), MARKS, MEANINGS)
        if claims
        else None,
    )


def _experiment(content: PaperContent, experiment: PaperExperiment) -> Markup:
    """Question, verdicts, differences from the paper, figures, tables, notes and runs."""
    counts = ", ".join(f"{count} {kind}" for kind, count in count_verdicts(list(experiment.claims)).items() if count)
    verdicts = (
        tag("p", tag("a", "Claims of this experiment", href="#claims"), ": ", tag("b", counts), ".") if counts else None
    )
    charts = content.charts.get(experiment.name) or [None] * len(experiment.figures)
    figures = [_figure(figure, chart) for figure, chart in zip(experiment.figures, charts, strict=True)]
    shared = shared_differences(content.findings)
    differences: list[Any] = [inline_code(text) for text in experiment.differences if text not in shared]
    if len(differences) < len(experiment.differences):
        differences.append(join("Also the ", tag("a", "differences of several experiments", href="#throughout"), "."))
    return join(
        tag("p", inline_code(experiment.question)),
        verdicts,
        _titled_list("Differences from the paper", differences),
        *figures,
        *map(paper_table, experiment.tables),
        _titled_list("Further results", [inline_code(note) for note in experiment.notes]),
        _titled_list("Runs", [_run(content, name) for name in experiment.runs]),
    )


def _figure(figure: BarChart | LineChart, chart: Chart | None) -> Markup:
    """The chart with its numbers folded below, or the numbers alone."""
    data = paper_table(figure_table(figure))
    return join(chart_figure(chart, 3), details("Numbers of this figure", data)) if chart else data


def _common_differences(findings: PaperFindings) -> Markup:
    """Differences from the paper that several experiments share, a list for each group of experiments."""
    groups: dict[tuple[str, ...], list[Markup]] = {}
    titles = {anchor(experiment): experiment.title for experiment in findings.experiments}
    for text, experiments in shared_differences(findings).items():
        groups.setdefault(tuple(map(anchor, experiments)), []).append(inline_code(text))
    parts = []
    for anchors, items in groups.items():
        links = [join("; " if n else "", tag("a", titles[name], href=f"#{name}")) for n, name in enumerate(anchors)]
        where = "In all experiments:" if len(anchors) == len(findings.experiments) else join("In ", *links, ":")
        parts.append(join(tag("p", where), bullet_list(items)))
    return join(*parts)


def _titled_list(title: str, items: Sequence[Any]) -> Markup | None:
    return join(tag("h3", title), bullet_list(items)) if items else None


def _run(content: PaperContent, name: str) -> Any:
    """The name of a run, as a link if its page or folder exists."""
    return tag("a", name, href=f"./{quote(content.pages[name])}") if name in content.pages else name


def _circumstances(findings: PaperFindings) -> Markup:
    """The command that repeats the study, and the versions with which the page was made."""
    circumstances = findings.circumstances
    titles = {"harness": "harness", "commit": "commit", "dirty": "uncommitted changes", "python": "python"}
    facts: dict[str, Any] = {
        "seed": findings.seed,
        **{title: circumstances[name] for name, title in titles.items() if name in circumstances},
    }
    rows = [join(tag("dt", name), tag("dd", _format_fact(value))) for name, value in facts.items()]
    text = json.dumps(to_json_types(circumstances), indent=2, ensure_ascii=False)
    return join(
        tag("pre", tag("code", findings.command)),
        tag("dl", *rows, class_="facts"),
        details("All versions and circumstances", tag("pre", text)) if circumstances else None,
    )


def _format_fact(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "unknown" if value is None else str(value)


def run_link(folder: Path, name: str) -> str | None:
    """The page of a run, or its folder, relative to `folder`; None if it is missing or lies outside `folder`."""
    path = PurePosixPath(name)
    run = folder / path
    if not path.parts or not run.is_dir() or not run.resolve().is_relative_to(folder.resolve()):
        return None
    return f"{path}/report.html" if (run / "report.html").is_file() else f"{path}/"
