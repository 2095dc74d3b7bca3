"""A comparison as text for the terminal: the outcome in one sentence, tables of lines, then what differs."""

from collections.abc import Sequence

from harness.compare.comparison import Comparison, Difference
from harness.core.number_format import format_change_percent, format_p_value
from harness.core.text_table import Table
from harness.report.comparison.wording import (
    MARKS,
    deciding_parts,
    excerpt_pair,
    format_interval,
    format_mean,
    format_signed,
    groups_vary,
    listed_issues,
    percent_of_a,
    sentence,
    sort_by_verdict,
)
from harness.report.kit.text import list_first, shorten

_MOST_LISTED, _LETTERS = 6, 60


def text(comparison: Comparison) -> str:
    """The text of a comparison; without tables if nothing was compared."""
    gated = [line for line in comparison.differences if line.gated]
    rest = [line for line in comparison.differences if not (line.gated or line.part)]
    lines = [sentence(comparison), *_first(deciding_parts(comparison)), f"A: {comparison.a}", f"B: {comparison.b}"]
    lines += [f"note: {note}" for note in comparison.training_notes]
    for title, group in (("", gated), ("not gated", rest)):
        if group:
            lines += ["", *([title] if title else []), *_table(comparison, group)]
    return "\n".join([*lines, *_reasons(gated), *_differences(comparison)])


def _first(texts: Sequence[str]) -> list[str]:
    more = len(texts) - _MOST_LISTED
    return [*texts[:_MOST_LISTED], *([f"{more} more lines: --html"] if more > 0 else [])]


def _table(comparison: Comparison, lines: Sequence[Difference]) -> list[str]:
    varied = groups_vary(comparison)
    names = ["verdict", "method", *(["of"] if varied else []), "metric"]
    head = [*names, "units", "A", "B", "B − A", "95 % interval", "of A", "p", "p (Holm)", "margin", "unit"]
    rows = [_row(line, varied) for line in sort_by_verdict(lines)]
    return Table(head, rows, text_columns=len(names)).lines()


def _row(line: Difference, varied: bool) -> list[str]:
    names = [f"{MARKS[line.verdict]} {line.verdict}", line.method, *([line.group] if varied else []), line.metric]
    means = [
        format_mean(line, line.mean_a),
        format_mean(line, line.mean_b),
        format_signed(line, line.difference),
        format_interval(line),
    ]
    chance = [
        format_change_percent(percent_of_a(line, line.difference)),
        format_p_value(line.p),
        format_p_value(line.p_holm),
    ]
    return [*names, str(len(line.units)), *means, *chance, format_mean(line, line.margin), line.unit]


def _reasons(lines: Sequence[Difference]) -> list[str]:
    """Why lines have the verdict "cannot tell", each reason once with its lines."""
    lines_by_reason: dict[str, list[str]] = {}
    for line in lines:
        if line.verdict == "cannot tell":
            lines_by_reason.setdefault(line.why, []).append(f"{line.method} {line.metric}")
    return [f"cannot tell, {why}: {list_first(names)}" for why, names in lines_by_reason.items()]


def _differences(comparison: Comparison) -> list[str]:
    """A line for each issue and for each circumstance that differs."""
    lines = [f"cells matched: {comparison.matched:,}"]
    for title, texts in listed_issues(comparison).items():
        lines.append(f"{title.lower()}: {len(texts):,} ({list_first([shorten(text, _LETTERS) for text in texts])})")
    for name, a, b in comparison.circumstances[:_MOST_LISTED]:
        lines.append(f"differs: {name}: {' -> '.join(excerpt_pair(a, b, _LETTERS))}")
    if (more := len(comparison.circumstances) - _MOST_LISTED) > 0:
        lines.append(f"differs: {more:,} more circumstances")
    return ["", *lines]
