"""The claims of a paper as aligned text, for the terminal and for results/README.md."""

import textwrap
from collections.abc import Sequence

from harness.report.paper.verdicts import all_claims, format_difference, format_interval, sentence, shared_differences
from harness.results.findings import Claim, PaperExperiment, PaperFindings

WIDTH = 160
_HEAD = ("claim", "published", "ours", "difference", "95 % interval", "clips", "verdict")
_SHRINKABLE = (0, 1, 2)
"""Columns that give way where the lines would be longer, the widest first."""
_NARROWEST, _GAP, _INDENT = 12, "  ", "  "


def text_tables(findings: PaperFindings) -> str:
    """What was held against the paper, experiment by experiment, in lines of at most 160 letters."""
    whole = sentence(all_claims(findings))
    head = [findings.reference, f"{findings.paper} on {findings.motion}, seed {findings.seed}. {whole}"]
    parts = [_wrap(line) for line in head]
    shared = shared_differences(findings)
    for experiment in findings.experiments:
        parts += ["", *_experiment(experiment, [text for text in experiment.differences if text not in shared])]
    if shared:
        parts += ["", "Different in several experiments"]
    for text, experiments in shared.items():
        all_of_them = len(experiments) == len(findings.experiments)
        where = "all" if all_of_them else ", ".join(experiment.name for experiment in experiments)
        parts.append(_wrap(f"{text} ({where})", _INDENT))
    return "\n".join(line.rstrip() for part in parts for line in part.split("\n"))


def _experiment(experiment: PaperExperiment, differences: Sequence[str]) -> list[str]:
    lines = [_wrap(f"{experiment.name}: {experiment.title}")]
    lines += (
        claims_lines(experiment.claims) if experiment.claims else [f"{_INDENT}no statement to hold a figure against"]
    )
    lines += [_wrap(f"different here: {text}", _INDENT) for text in differences]
    return lines


def claims_lines(found: Sequence[Claim]) -> list[str]:
    """A row for each claim, and under it why its verdict is what it is."""
    rows = [list(map(_one_line, _HEAD)), *([_one_line(cell) for cell in _cells(claim)] for claim in found)]
    used = [i for i in range(len(_HEAD)) if i == 0 or any(row[i] for row in rows[1:])]
    rows = [[row[i] for i in used] for row in rows]
    widths = _column_widths(rows, [place for place, i in enumerate(used) if i in _SHRINKABLE])
    lines = _align_row(rows[0], widths)
    for row, claim in zip(rows[1:], found, strict=True):
        lines += _align_row(row, widths)
        lines += [_wrap(f"why: {_one_line(claim.why)}", 2 * _INDENT)] if claim.why else []
    return [f"{_INDENT}{line}" for line in lines]


def _cells(claim: Claim) -> tuple[str, ...]:
    clips = str(claim.clips) if claim.clips else ""
    return (
        claim.text,
        claim.published,
        claim.ours,
        format_difference(claim),
        format_interval(claim),
        clips,
        claim.verdict,
    )


def _column_widths(rows: Sequence[Sequence[str]], giving: Sequence[int]) -> list[int]:
    """Of the columns, so that a line fits."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    room = WIDTH - len(_INDENT) - len(_GAP) * (len(widths) - 1)
    while sum(widths) > room:
        widest = max(giving, key=lambda i: widths[i])
        if widths[widest] <= _NARROWEST:
            break
        widths[widest] -= 1
    return widths


def _align_row(row: Sequence[str], widths: Sequence[int]) -> list[str]:
    """One row in as many lines as its longest cell needs."""
    columns = [
        textwrap.wrap(cell, width, subsequent_indent="" if i else _INDENT) or [""]
        for i, (cell, width) in enumerate(zip(row, widths, strict=True))
    ]
    lines = [[column[n] if n < len(column) else "" for column in columns] for n in range(max(map(len, columns)))]
    return [_GAP.join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]


def _wrap(text: str, indent: str = "") -> str:
    return textwrap.fill(_one_line(text), WIDTH, initial_indent=indent, subsequent_indent=indent + _INDENT)


def _one_line(text: str) -> str:
    """On one line."""
    return " ".join(text.split())
