"""The claims of a paper as text tables: all of them for the terminal, printed statements for results/README.md."""

from collections.abc import Sequence

from harness.core.number_format import count_noun
from harness.report.kit.statement_lines import WIDTH, statement_lines, wrap_lines
from harness.report.paper.side_by_side import printed_statements, statements_lines
from harness.report.paper.verdicts import all_claims, sentence, shared_differences
from harness.results.benchmark_statement import BenchmarkStatement
from harness.results.findings import PaperExperiment, PaperFindings

_INDENT = "  "


def text_tables(findings: PaperFindings) -> str:
    """Every claim with its verdict, experiment by experiment, in lines of at most `WIDTH` characters."""
    summary = sentence(all_claims(findings))
    head = [findings.reference, f"{findings.paper} on {findings.motion}, seed {findings.seed}. {summary}"]
    parts = [_wrap(line) for line in head]
    shared = shared_differences(findings)
    for experiment in findings.experiments:
        parts += ["", *_experiment(experiment, [text for text in experiment.differences if text not in shared])]
    if shared:
        parts += ["", "Differences from the paper in several experiments"]
    for text, experiments in shared.items():
        in_all = len(experiments) == len(findings.experiments)
        where = "all" if in_all else ", ".join(experiment.name for experiment in experiments)
        parts.append(_wrap(f"{text} ({where})", _INDENT))
    return "\n".join(line.rstrip() for part in parts for line in part.split("\n"))


def statements_text(findings: PaperFindings) -> str:
    """The printed statements with the results of both readings, in lines of at most `WIDTH` characters."""
    head = [findings.reference, f"{findings.paper} on {findings.motion}, seed {findings.seed}."]
    lines = [_wrap(line) for line in [*head, sentence(all_claims(findings))]]
    statements = printed_statements(findings)
    others = [claim for claim in all_claims(findings) if claim.kind != "printed"]
    if statements:
        lines += ["", *statements_lines(statements, WIDTH)]
    if others:
        lines += ["", f"{count_noun(len(others), 'further claim')}: derived, repeated or of speed; see the page."]
    return "\n".join(line.rstrip() for part in lines for line in part.split("\n"))


def _experiment(experiment: PaperExperiment, differences: Sequence[str]) -> list[str]:
    lines = [_wrap(f"{experiment.name}: {experiment.title}")]
    lines += (
        claims_lines(experiment.claims) if experiment.claims else [f"{_INDENT}no published statement to compare with"]
    )
    lines += [_wrap(f"difference from the paper: {text}", _INDENT) for text in differences]
    return lines


def claims_lines(claims: Sequence[BenchmarkStatement]) -> list[str]:
    """The table of claims, indented."""
    lines = statement_lines(claims, target="published", width=WIDTH - len(_INDENT))
    return [f"{_INDENT}{line}" for line in lines]


def _wrap(text: str, indent: str = "") -> str:
    return "\n".join(wrap_lines(text, WIDTH, indent))
