"""The tables of a comparison's page: every line, every clip, margins, and what the two sides differ in."""

from collections.abc import Sequence
from typing import Any

from harness.compare.comparison import Comparison, Difference, Verdict
from harness.report.comparison.wording import (
    MARKS,
    clips_of,
    groups_vary,
    interval,
    lists,
    mean,
    p_value,
    percent,
    share,
    signed,
)
from harness.report.kit.markup import Markup, folded, joined, table, tag
from harness.report.run.data import file_name

_MOST_CLIPS, _MOST_LISTED, _MOST_OPEN = 200, 200, 12


def verdict(kind: Verdict) -> Markup:
    """As a mark and a word: never by colour alone."""
    mark = tag("span", MARKS[kind], aria_hidden="true", class_="mark")
    return tag("span", mark, kind, class_=f"verdict {file_name(kind)}")


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
    name = joined(
        line.method, tag("small", f"{line.metric} [{line.unit}]"), tag("small", line.group) if varied else None
    )
    return [
        name,
        _two(verdict(line.verdict), line.why, "why"),
        mean(line, line.mean_a),
        mean(line, line.mean_b),
        _two(signed(line, line.difference), percent(share(line, line.difference))),
        interval(line),
        _two(p_value(line.p), p_value(line.p_holm)),
        mean(line, line.margin),
        len(line.clips),
    ]


def _two(first: Any, second: str, class_: str = "spread under") -> Markup:
    """One under the other."""
    return joined(first, tag("span", second, class_=class_) if second else None)


def by_clip(lines: Sequence[Difference]) -> Markup:
    """For each metric a row for each clip, a column for each line: A, B and their difference."""
    return joined(*(_metric(lines, metric) for metric in dict.fromkeys(line.metric for line in lines)))


def _metric(lines: Sequence[Difference], metric: str) -> Markup:
    chosen = [line for line in lines if line.metric == metric]
    clips = clips_of(chosen)
    varied = len({line.group for line in chosen}) > 1
    head = ["clip", *(joined(line.method, tag("small", line.group) if varied else None) for line in chosen)]
    places = [{clip: n for n, clip in enumerate(line.clips)} for line in chosen]
    rows = [
        [clip, *(_clip(line, at.get(clip)) for line, at in zip(chosen, places, strict=True))]
        for clip in clips[:_MOST_CLIPS]
    ]
    more = f" The first {_MOST_CLIPS} of {len(clips):,} clips." if len(clips) > _MOST_CLIPS else ""
    caption = joined(tag("b", f"{metric} [{chosen[0].unit}]"), f": from A to B, and the difference.{more}")
    return table(caption, list[Any](head), rows, label=f"{metric} by clip")


def _clip(line: Difference, at: int | None) -> Any:
    if at is None:
        return "–"
    a, b = line.a[at], line.b[at]
    return _two(f"{mean(line, a)} → {mean(line, b)}", signed(line, b - a))


def margins(comparison: Comparison) -> Markup:
    """What each line's margin came to."""
    lines = [line for line in comparison.differences if line.gated]
    if not lines:
        return Markup()
    rows: list[list[Any]] = []
    for metric in dict.fromkeys(line.metric for line in lines):
        those = [line for line in lines if line.metric == metric]
        least, most = (pick(those, key=lambda line: line.margin) for pick in (min, max))
        absolute = " to ".join(dict.fromkeys(mean(line, line.margin) for line in (least, most)))
        of_a = " to ".join(dict.fromkeys(percent(share(line, line.margin)).lstrip("+") for line in (least, most)))
        rows.append([metric, joined(absolute, tag("span", f" {those[0].unit}", class_="spread")), of_a])
    caption = "Margins: the change that matters in practice, in proportion to A's mean, but no less than a floor."
    return table(caption, ["metric", "margin", "of A's mean"], rows, label="margins")


def apart(comparison: Comparison) -> Markup:
    """Circumstances that differ, and what hinders a comparison or was let pass."""
    parts: list[Any] = []
    if comparison.circumstances:
        rows: list[list[Any]] = [[name, _value(a), _value(b)] for name, a, b in comparison.circumstances]
        caption = "Circumstances: what the comparison is about."
        parts.append(table(caption, ["", _value("A"), _value("B")], rows, label="circumstances"))
    for title, texts in lists(comparison).items():
        items = [tag("li", text) for text in texts[:_MOST_LISTED]]
        more = tag("li", f"and {len(texts) - _MOST_LISTED:,} more") if len(texts) > _MOST_LISTED else None
        content = tag("ul", *items, more, class_="notes")
        heading = f"{title}: {len(texts):,}"
        parts.append(joined(tag("h3", heading), content) if len(texts) <= _MOST_OPEN else folded(heading, content))
    return joined(*parts) if parts else tag("p", "Nothing: same inputs, same circumstances, the same cells.")


def _value(text: str) -> Markup:
    return tag("span", text, class_="words")
