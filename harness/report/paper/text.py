"""The claims of a paper as aligned text, for the terminal and for results/README.md."""

import textwrap
from collections.abc import Sequence

from harness.report.paper.verdicts import claims, common, difference, interval, sentence
from harness.results.findings import Claim, Experiment, Findings

WIDTH = 160
_HEAD = ("claim", "published", "ours", "difference", "95 % interval", "clips", "verdict")
_WRAPPED = (0, 1, 2)
"""Columns that give way where the lines would be longer, the widest first."""
_NARROWEST, _GAP, _INDENT = 12, "  ", "  "


def text_tables(findings: Findings) -> str:
    """What was held against the paper, experiment by experiment, in lines of at most 160 letters."""
    whole = sentence(claims(findings))
    head = [findings.reference, f"{findings.paper} on {findings.motion}, seed {findings.seed}. {whole}"]
    parts = [_wrapped(line) for line in head]
    shared = common(findings)
    for experiment in findings.experiments:
        parts += ["", *_experiment(experiment, [text for text in experiment.differences if text not in shared])]
    if shared:
        parts += ["", "Different in several experiments"]
    for text, experiments in shared.items():
        all_of_them = len(experiments) == len(findings.experiments)
        where = "all" if all_of_them else ", ".join(experiment.name for experiment in experiments)
        parts.append(_wrapped(f"{text} ({where})", _INDENT))
    return "\n".join(line.rstrip() for part in parts for line in part.split("\n"))


def _experiment(experiment: Experiment, differences: Sequence[str]) -> list[str]:
    lines = [_wrapped(f"{experiment.name}: {experiment.title}")]
    lines += (
        claims_text(experiment.claims) if experiment.claims else [f"{_INDENT}no statement to hold a figure against"]
    )
    lines += [_wrapped(f"different here: {text}", _INDENT) for text in differences]
    return lines


def claims_text(found: Sequence[Claim]) -> list[str]:
    """A row for each claim, and under it why its verdict is what it is."""
    rows = [list(map(_plain, _HEAD)), *([_plain(cell) for cell in _cells(claim)] for claim in found)]
    used = [i for i in range(len(_HEAD)) if i == 0 or any(row[i] for row in rows[1:])]
    rows = [[row[i] for i in used] for row in rows]
    widths = _widths(rows, [place for place, i in enumerate(used) if i in _WRAPPED])
    lines = _aligned(rows[0], widths)
    for row, claim in zip(rows[1:], found, strict=True):
        lines += _aligned(row, widths)
        lines += [_wrapped(f"why: {_plain(claim.why)}", 2 * _INDENT)] if claim.why else []
    return [f"{_INDENT}{line}" for line in lines]


def _cells(claim: Claim) -> tuple[str, ...]:
    clips = str(claim.clips) if claim.clips else ""
    return claim.text, claim.published, claim.ours, difference(claim), interval(claim), clips, claim.verdict


def _widths(rows: Sequence[Sequence[str]], giving: Sequence[int]) -> list[int]:
    """Of the columns, so that a line fits."""
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    room = WIDTH - len(_INDENT) - len(_GAP) * (len(widths) - 1)
    while sum(widths) > room:
        widest = max(giving, key=lambda i: widths[i])
        if widths[widest] <= _NARROWEST:
            break
        widths[widest] -= 1
    return widths


def _aligned(row: Sequence[str], widths: Sequence[int]) -> list[str]:
    """One row in as many lines as its longest cell needs."""
    columns = [
        textwrap.wrap(cell, width, subsequent_indent="" if i else _INDENT) or [""]
        for i, (cell, width) in enumerate(zip(row, widths, strict=True))
    ]
    lines = [[column[n] if n < len(column) else "" for column in columns] for n in range(max(map(len, columns)))]
    return [_GAP.join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]


def _wrapped(text: str, indent: str = "") -> str:
    return textwrap.fill(_plain(text), WIDTH, initial_indent=indent, subsequent_indent=indent + _INDENT)


def _plain(text: str) -> str:
    """On one line."""
    return " ".join(text.split())
