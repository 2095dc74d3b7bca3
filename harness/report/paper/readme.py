"""The tables that a README shows, between markers: those of each paper and motion are replaced by the last ones."""

import re
from pathlib import Path

from harness.core.files import write_text
from harness.errors import BadFile
from harness.report.paper.text import text_tables
from harness.results.findings import PaperFindings

_NEWLINE = "\n"


def update_readme(readme: Path, findings: PaperFindings) -> None:
    """Put the tables where those of this paper and motion stand, at the end if none do; the rest keeps every byte.

    BadFile when the page cannot be read, or has one marker without the other.
    """
    expected = "a page of text"
    try:
        text = readme.read_bytes().decode("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadFile(readme, f"cannot be read ({error})", expected, "Name results/README.md.") from error
    start, end = _markers(findings)
    section = f"{start}\n{_section(findings)}\n{end}"
    if text.count(start) != text.count(end) or text.count(start) > 1 or text.find(start) > text.find(end):
        why = f"the markers {start} and {end} are not there once each, in this order"
        raise BadFile(readme, why, expected, "Restore them, or remove both: they are then put at the end.")
    if start in text:
        before, _, rest = text.partition(start)
        whole = before + section + rest.partition(end)[2]
    else:
        whole = f"{text}{'' if text.endswith(_NEWLINE) else _NEWLINE}\n{section}\n"
    if whole != text:
        write_text(readme, whole)


def _markers(findings: PaperFindings) -> tuple[str, str]:
    name = re.sub(r"[^\w.]+", "-", f"{findings.paper} {findings.motion}").strip("-")
    return f"<!-- paper {name} -->", f"<!-- end of paper {name} -->"


def _section(findings: PaperFindings) -> str:
    """The command and what it printed, as a block that no text in it can end."""
    made = findings.circumstances
    commit = f"commit {str(made['commit'])[:12]}" if made.get("commit") else "no commit"
    title = f"### {findings.paper}, {findings.motion}"
    by = f"By harness {made.get('harness')}, {commit}{' with changes' if made.get('dirty') else ''}:"
    block = [f"    {line}".rstrip() for line in (findings.command, "", *text_tables(findings).split("\n"))]
    return "\n".join([_escape_markers(title), "", _escape_markers(by), "", *map(_escape_markers, block)])


def _escape_markers(line: str) -> str:
    """On one line, and no marker."""
    return re.sub(r"[\r\n]+", " ", line).replace("<!--", "<! --")
