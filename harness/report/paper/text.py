"""The claims of a paper as text tables: all of them for the terminal, printed statements for results/README.md."""

import textwrap
from collections.abc import Sequence

from harness.core.number_format import count_noun
from harness.core.text_table import Table
from harness.report.paper.side_by_side import printed_statements, statements_lines
from harness.report.paper.verdicts import (
    all_claims,
    format_difference,
    format_interval,
    format_kind,
    format_p,
    sentence,
    shared_differences,
)
from harness.results.findings import Claim, PaperExperiment, PaperFindings

WIDTH = 160
"""Most characters of a line."""
_HEAD = ("claim", "kind", "published", "measured", "difference", "95 % interval", "p (Holm)", "units", "verdict")
_SHRINKABLE = (0, 2, 3)
"""Columns that wrap where lines would be too long."""
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


def claims_lines(claims: Sequence[Claim]) -> list[str]:
    """A table with a row for each claim, and under the row the reason for its verdict."""
    rows = [[_one_line(cell) for cell in _cells(claim)] for claim in claims]
    used = [i for i in range(len(_HEAD)) if i == 0 or any(row[i] for row in rows)]
    table = Table([_HEAD[i] for i in used], [[row[i] for i in used] for row in rows], text_columns=len(used))
    shrinkable = [n for n, i in enumerate(used) if i in _SHRINKABLE]
    lines, *wrapped_rows = table.wrapped_rows(WIDTH - len(_INDENT), shrinkable)
    for row_lines, claim in zip(wrapped_rows, claims, strict=True):
        lines += row_lines
        lines += [_wrap(f"why: {_one_line(claim.why)}", 2 * _INDENT)] if claim.why else []
    return [f"{_INDENT}{line}" for line in lines]


def _cells(claim: Claim) -> tuple[str, ...]:
    clips = str(claim.clips) if claim.clips else ""
    return (
        claim.text,
        format_kind(claim),
        claim.published,
        claim.ours,
        format_difference(claim),
        format_interval(claim),
        format_p(claim),
        clips,
        claim.verdict,
    )


def _wrap(text: str, indent: str = "") -> str:
    return textwrap.fill(_one_line(text), WIDTH, initial_indent=indent, subsequent_indent=indent + _INDENT)


def _one_line(text: str) -> str:
    """The text with every run of white space replaced by one blank."""
    return " ".join(text.split())
