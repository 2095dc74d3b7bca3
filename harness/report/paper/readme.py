"""Updates the tables of a paper in a README, which stand between two markers for each paper and motion."""

import re
from pathlib import Path

from harness.report.kit.marked_block import describe_code, replace_block
from harness.report.paper.page import statements_text
from harness.results.findings import PaperFindings


def update_readme(readme: Path, findings: PaperFindings) -> None:
    """Replace the tables of this paper and motion in `readme`, or append them; raises what `replace_block` raises."""
    name = re.sub(r"[^\w.]+", "-", f"{findings.paper} {findings.motion}").strip("-")
    title, made_by = f"### {findings.paper}, {findings.motion}", describe_code(findings.circumstances)
    block = [f"    {line}".rstrip() for line in (findings.command, "", *statements_text(findings).split("\n"))]
    replace_block(readme, f"paper {name}", [title, "", f"Made by {made_by}:", "", *block])
