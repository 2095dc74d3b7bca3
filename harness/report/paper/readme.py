"""Updates the table of a paper in a README, which stand between two markers for each paper and motion."""

import re
from pathlib import Path

from harness.core.files import write_text
from harness.core.input_file import MEGABYTE, read_input_file
from harness.errors import BadFile
from harness.report.paper.text import statements_text
from harness.results.findings import PaperFindings

_NEWLINE = "\n"


def update_readme(readme: Path, findings: PaperFindings) -> None:
    """Replace the tables of this paper and motion in `readme`, or append them; no other byte changes.

    BadFile if the file cannot be read, or if the two markers are not there exactly once and in order.
    """
    expected = "a text file with both markers or none"
    data = read_input_file(readme, expected, 16 * MEGABYTE, "Name results/README.md.")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise BadFile(readme, f"cannot be read ({error})", expected, "Name results/README.md.") from error
    start, end = _markers(findings)
    section = f"{start}\n{_section(findings)}\n{end}"
    if text.count(start) != text.count(end) or text.count(start) > 1 or text.find(start) > text.find(end):
        why = f"the markers {start} and {end} do not occur once each in this order"
        raise BadFile(readme, why, expected, "Restore both markers, or remove both to append the tables at the end.")
    if start in text:
        before, _, rest = text.partition(start)
        updated = before + section + rest.partition(end)[2]
    else:
        updated = f"{text}{'' if text.endswith(_NEWLINE) else _NEWLINE}\n{section}\n"
    if updated != text:
        write_text(readme, updated)


def _markers(findings: PaperFindings) -> tuple[str, str]:
    name = re.sub(r"[^\w.]+", "-", f"{findings.paper} {findings.motion}").strip("-")
    return f"<!-- paper {name} -->", f"<!-- end of paper {name} -->"


def _section(findings: PaperFindings) -> str:
    """Title, version, command and tables; no text in them can end the block."""
    versions = findings.circumstances
    commit = f"commit {str(versions['commit'])[:12]}" if versions.get("commit") else "no commit"
    title = f"### {findings.paper}, {findings.motion}"
    changes = " with uncommitted changes" if versions.get("dirty") else ""
    made_by = f"Made by harness {versions.get('harness')}, {commit}{changes}:"
    block = [f"    {line}".rstrip() for line in (findings.command, "", *statements_text(findings).split("\n"))]
    return "\n".join([_escape_markers(title), "", _escape_markers(made_by), "", *map(_escape_markers, block)])


def _escape_markers(line: str) -> str:
    """The line without line breaks, and with no text that could be taken for a marker."""
    return re.sub(r"[\r\n]+", " ", line).replace("<!--", "<! --")
