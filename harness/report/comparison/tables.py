"""The tables of a comparison's page: every line, every clip, margins, and what the two sides differ in."""

from collections.abc import Sequence
from typing import Any

from harness.compare.comparison import Comparison, Difference, Verdict
from harness.report.comparison.wording import (
    MARKS,
    clips_of,
    format_interval,
    format_mean,
    format_p_value,
    format_percent,
    format_signed,
    groups_vary,
    listed_issues,
    percent_of_a,
)
from harness.report.kit.markup import Markup, details, join, table, tag
from harness.report.run.data import to_file_name

_MOST_CLIPS, _MOST_LISTED, _MOST_OPEN = 200, 200, 12


def verdict_badge(kind: Verdict) -> Markup:
    """As a mark and a word: never by colour alone."""
    mark = tag("span", MARKS[kind], aria_hidden="true", class_="mark")
    return tag("span", mark, kind, class_=f"verdict {to_file_name(kind)}")


def lines_table(comparison: Comparison, lines: Sequence[Difference], label: str) -> Markup:
    """A row for each line, and under its verdict why it is so."""
    varied = groups_vary(comparison)
    head: list[Any] = ["line", "verdict", "A", "B", "B − A", "95 % interval", "p", "margin", "clips"]
    rows = [_row(line, varied) for line in lines]
    caption = (
        "A, B: means over clips; under the difference its share of A's mean. p: of flipping the signs of the clips' "
        "differences, and under it corrected for all gated lines (Holm)."
    )
    return table(caption, head, rows, label=label)


def _row(line: Difference, varied: bool) -> list[Any]:
    name = join(line.method, tag("small", f"{line.metric} [{line.unit}]"), tag("small", line.group) if varied else None)
    return [
        name,
        _stacked(verdict_badge(line.verdict), line.why, "why"),
        format_mean(line, line.mean_a),
        format_mean(line, line.mean_b),
        _stacked(format_signed(line, line.difference), format_percent(percent_of_a(line, line.difference))),
        format_interval(line),
        _stacked(format_p_value(line.p), format_p_value(line.p_holm)),
        format_mean(line, line.margin),
        len(line.clips),
    ]


def _stacked(first: Any, second: str, class_: str = "spread under") -> Markup:
    """One under the other."""
    return join(first, tag("span", second, class_=class_) if second else None)


def clip_tables(lines: Sequence[Difference]) -> Markup:
    """For each metric a row for each clip, a column for each line: A, B and their difference."""
    return join(*(_clip_table(lines, metric) for metric in dict.fromkeys(line.metric for line in lines)))


def _clip_table(lines: Sequence[Difference], metric: str) -> Markup:
    chosen = [line for line in lines if line.metric == metric]
    clips = clips_of(chosen)
    varied = len({line.group for line in chosen}) > 1
    head = ["clip", *(join(line.method, tag("small", line.group) if varied else None) for line in chosen)]
    places = [{clip: n for n, clip in enumerate(line.clips)} for line in chosen]
    rows = [
        [clip, *(_clip_cell(line, at.get(clip)) for line, at in zip(chosen, places, strict=True))]
        for clip in clips[:_MOST_CLIPS]
    ]
    more = f" The first {_MOST_CLIPS} of {len(clips):,} clips." if len(clips) > _MOST_CLIPS else ""
    caption = join(tag("b", f"{metric} [{chosen[0].unit}]"), f": from A to B, and the difference.{more}")
    return table(caption, list[Any](head), rows, label=f"{metric} by clip")


def _clip_cell(line: Difference, at: int | None) -> Any:
    if at is None:
        return "–"
    a, b = line.a[at], line.b[at]
    return _stacked(f"{format_mean(line, a)} → {format_mean(line, b)}", format_signed(line, b - a))


def margins_table(comparison: Comparison) -> Markup:
    """What each line's margin came to."""
    lines = [line for line in comparison.differences if line.gated]
    if not lines:
        return Markup()
    rows: list[list[Any]] = []
    for metric in dict.fromkeys(line.metric for line in lines):
        those = [line for line in lines if line.metric == metric]
        least, most = (pick(those, key=lambda line: line.margin) for pick in (min, max))
        absolute = " to ".join(dict.fromkeys(format_mean(line, line.margin) for line in (least, most)))
        of_a = " to ".join(
            dict.fromkeys(format_percent(percent_of_a(line, line.margin)).lstrip("+") for line in (least, most))
        )
        rows.append([metric, join(absolute, tag("span", f" {those[0].unit}", class_="spread")), of_a])
    caption = "Margins: the change that matters in practice, in proportion to A's mean, but no less than a floor."
    return table(caption, ["metric", "margin", "of A's mean"], rows, label="margins")


def differences_section(comparison: Comparison) -> Markup:
    """Circumstances that differ, and what hinders a comparison or was let pass."""
    parts: list[Any] = []
    if comparison.circumstances:
        rows: list[list[Any]] = [[name, _text_cell(a), _text_cell(b)] for name, a, b in comparison.circumstances]
        caption = "Circumstances: what the comparison is about."
        parts.append(table(caption, ["", _text_cell("A"), _text_cell("B")], rows, label="circumstances"))
    for title, texts in listed_issues(comparison).items():
        items = [tag("li", text) for text in texts[:_MOST_LISTED]]
        more = tag("li", f"and {len(texts) - _MOST_LISTED:,} more") if len(texts) > _MOST_LISTED else None
        content = tag("ul", *items, more, class_="notes")
        heading = f"{title}: {len(texts):,}"
        parts.append(join(tag("h3", heading), content) if len(texts) <= _MOST_OPEN else details(heading, content))
    return join(*parts) if parts else tag("p", "Nothing: same inputs, same circumstances, the same cells.")


def _text_cell(text: str) -> Markup:
    return tag("span", text, class_="words")
