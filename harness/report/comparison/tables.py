"""Tables of a comparison's page: lines, clips, margins, and differences between the two sides."""

from collections.abc import Sequence
from typing import Any

from harness.compare.comparison import Comparison, Difference
from harness.core.number_format import format_change_percent, format_p_value
from harness.core.text_table import Table
from harness.report.comparison.wording import (
    MARKS,
    clips_of,
    format_interval,
    format_mean,
    format_signed,
    groups_vary,
    listed_issues,
    percent_of_a,
)
from harness.report.kit.markup import Markup, bullet_list, details, join, tag
from harness.report.kit.table import html_table, stacked_cell
from harness.report.kit.verdict_badge import verdict_badge

_MOST_CLIPS, _MOST_LISTED, _MOST_OPEN = 200, 200, 12


def lines_table(comparison: Comparison, lines: Sequence[Difference], label: str) -> Markup:
    """A row for each line, with the reason under its verdict."""
    varied = groups_vary(comparison)
    head: list[Any] = ["line", "verdict", "A", "B", "B − A", "95 % interval", "p", "margin", "units"]
    rows = [_row(line, varied) for line in lines]
    caption = (
        "A, B: means over units. Under the difference: its share of A's mean. p: of a test that flips the signs of the "
        "units' differences; under it p corrected for all gated lines, or for the parts of a line (Holm)."
    )
    return html_table(Table(head, rows), caption, label=label)


def _row(line: Difference, varied: bool) -> list[Any]:
    name = join(
        line.method,
        tag("small", f"{line.metric} [{line.unit}]"),
        tag("small", line.group) if varied else None,
        tag("small", line.part.replace("_", " ")) if line.part else None,
    )
    return [
        name,
        stacked_cell(verdict_badge(line.verdict, MARKS[line.verdict]), line.why, "why"),
        format_mean(line, line.mean_a),
        format_mean(line, line.mean_b),
        stacked_cell(format_signed(line, line.difference), format_change_percent(percent_of_a(line, line.difference))),
        format_interval(line),
        stacked_cell(format_p_value(line.p), format_p_value(line.p_holm)),
        format_mean(line, line.margin),
        len(line.units),
    ]


def clip_tables(lines: Sequence[Difference]) -> Markup:
    """For each metric a table with a row for each clip and a column for each line: A, B and their difference."""
    return join(*(_clip_table(lines, metric) for metric in dict.fromkeys(line.metric for line in lines)))


def _clip_table(lines: Sequence[Difference], metric: str) -> Markup:
    chosen = [line for line in lines if line.metric == metric]
    clips = clips_of(chosen)
    varied = len({line.group for line in chosen}) > 1
    head = ["clip", *(join(line.method, tag("small", line.group) if varied else None) for line in chosen)]
    indices = [{clip: n for n, clip in enumerate(line.clips)} for line in chosen]
    rows = [
        [clip, *(_clip_cell(line, at.get(clip)) for line, at in zip(chosen, indices, strict=True))]
        for clip in clips[:_MOST_CLIPS]
    ]
    more = f" The first {_MOST_CLIPS} of {len(clips):,} clips." if len(clips) > _MOST_CLIPS else ""
    caption = join(tag("b", f"{metric} [{chosen[0].unit}]"), f": from A to B, and the difference.{more}")
    return html_table(Table(head, rows), caption, label=f"{metric} by clip")


def _clip_cell(line: Difference, at: int | None) -> Any:
    if at is None:
        return "–"
    a, b = line.a[at], line.b[at]
    return stacked_cell(f"{format_mean(line, a)} → {format_mean(line, b)}", format_signed(line, b - a))


def margins_table(comparison: Comparison) -> Markup:
    """The margin of each gated metric, absolute and relative to A's mean."""
    lines = [line for line in comparison.differences if line.gated]
    if not lines:
        return Markup()
    rows: list[list[Any]] = []
    for metric in dict.fromkeys(line.metric for line in lines):
        same_metric = [line for line in lines if line.metric == metric]
        least, most = (pick(same_metric, key=lambda line: line.margin) for pick in (min, max))
        absolute = " to ".join(dict.fromkeys(format_mean(line, line.margin) for line in (least, most)))
        of_a = " to ".join(
            dict.fromkeys(format_change_percent(percent_of_a(line, line.margin)).lstrip("+") for line in (least, most))
        )
        rows.append([metric, join(absolute, tag("span", f" {same_metric[0].unit}", class_="spread")), of_a])
    caption = "Margins: the smallest change that matters in practice, a share of A's mean but not less than a floor."
    return html_table(Table(["metric", "margin", "of A's mean"], rows), caption, label="margins")


def differences_section(comparison: Comparison) -> Markup:
    """Circumstances that differ, and issues that prevent a comparison or were allowed."""
    parts: list[Any] = []
    if comparison.circumstances:
        rows: list[list[Any]] = [[name, _text_cell(a), _text_cell(b)] for name, a, b in comparison.circumstances]
        table = Table(["", _text_cell("A"), _text_cell("B")], rows)
        parts.append(html_table(table, "Circumstances that A and B differ in.", label="circumstances"))
    for title, texts in listed_issues(comparison).items():
        more = [f"and {len(texts) - _MOST_LISTED:,} more"] if len(texts) > _MOST_LISTED else []
        content = bullet_list([*texts[:_MOST_LISTED], *more])
        heading = f"{title}: {len(texts):,}"
        parts.append(join(tag("h3", heading), content) if len(texts) <= _MOST_OPEN else details(heading, content))
    return join(*parts) if parts else tag("p", "Nothing: inputs, circumstances and cells are the same.")


def _text_cell(text: str) -> Markup:
    return tag("span", text, class_="words")
