"""A comparison as text for the terminal: the verdict in one sentence, an aligned table, then what differs."""

from collections.abc import Sequence

from harness.compare.comparison import Comparison, Difference
from harness.report.comparison.wording import (
    MARKS,
    excerpt_pair,
    format_interval,
    format_mean,
    format_p_value,
    format_percent,
    format_signed,
    groups_vary,
    list_first,
    listed_issues,
    percent_of_a,
    sentence,
    sort_by_verdict,
)
from harness.report.run.text import align_columns

_MOST_LISTED, _LETTERS = 6, 60


def text(comparison: Comparison) -> str:
    """Lines for the terminal; nothing but the sentence and what differs when nothing was compared."""
    gated = [line for line in comparison.differences if line.gated]
    rest = [line for line in comparison.differences if not line.gated]
    lines = [sentence(comparison), f"A: {comparison.a}", f"B: {comparison.b}"]
    for title, found in (("", gated), ("not gated", rest)):
        if found:
            lines += ["", *([title] if title else []), *_table(comparison, found)]
    return "\n".join([*lines, *_reasons(gated), *_differences(comparison)])


def _table(comparison: Comparison, lines: Sequence[Difference]) -> list[str]:
    varied = groups_vary(comparison)
    names = ["verdict", "method", *(["of"] if varied else []), "metric"]
    head = [*names, "clips", "A", "B", "B − A", "95 % interval", "of A", "p", "p (Holm)", "margin", "unit"]
    rows = [_row(line, varied) for line in sort_by_verdict(lines)]
    return align_columns([head, *rows], text_columns=len(names))


def _row(line: Difference, varied: bool) -> list[str]:
    names = [f"{MARKS[line.verdict]} {line.verdict}", line.method, *([line.group] if varied else []), line.metric]
    means = [
        format_mean(line, line.mean_a),
        format_mean(line, line.mean_b),
        format_signed(line, line.difference),
        format_interval(line),
    ]
    chance = [format_percent(percent_of_a(line, line.difference)), format_p_value(line.p), format_p_value(line.p_holm)]
    return [*names, str(len(line.clips)), *means, *chance, format_mean(line, line.margin), line.unit]


def _reasons(lines: Sequence[Difference]) -> list[str]:
    """Why lines are not told, each reason once."""
    found: dict[str, list[str]] = {}
    for line in lines:
        if line.verdict == "cannot tell":
            found.setdefault(line.why, []).append(f"{line.method} {line.metric}")
    return [f"cannot tell, {why}: {list_first(names)}" for why, names in found.items()]


def _differences(comparison: Comparison) -> list[str]:
    """Cells without a partner, inputs and circumstances that differ, in a line each."""
    lines = [f"cells matched: {comparison.matched:,}"]
    for title, found in listed_issues(comparison).items():
        lines.append(f"{title.lower()}: {len(found):,} ({list_first([_shorten(text) for text in found])})")
    for name, a, b in comparison.circumstances[:_MOST_LISTED]:
        lines.append(f"differs: {name}: {' -> '.join(excerpt_pair(a, b, _LETTERS))}")
    if (more := len(comparison.circumstances) - _MOST_LISTED) > 0:
        lines.append(f"differs: {more:,} more circumstances")
    return ["", *lines]


def _shorten(value: str) -> str:
    value = " ".join(str(value).split())
    return value if len(value) <= _LETTERS else f"{value[: _LETTERS - 1]}…"
