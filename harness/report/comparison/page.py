"""The page of a comparison: outcome, counts of verdicts, charts, tables, and what differs between A and B."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from harness.compare import MIN_UNITS, Comparison, Difference, count_units
from harness.core.number_format import format_change_percent, format_p_value
from harness.report.comparison.charts import interval_charts, slope_chart
from harness.report.comparison.wording import (
    KINDS,
    MARKS,
    MEANINGS,
    clips_of,
    comparison_sentence,
    count_verdicts,
    deciding_parts,
    excerpt_pair,
    format_margin,
    format_mean,
    format_signed,
    groups_vary,
    line_interval,
    listed_issues,
    outcome_title,
    parts_of,
    percent_of_a,
    sort_by_verdict,
)
from harness.report.kit.markup import Markup, join, tag, verdict_badge
from harness.report.kit.page import (
    Badge,
    Block,
    BrowserOnly,
    Bullets,
    DataTable,
    Page,
    Panels,
    Prose,
    Section,
    Stack,
    Tally,
    TerminalOnly,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.kit.text import list_first, truncate

_WIDTH = 160
_MOST_OPEN, _MOST_NAMED, _MOST_CLIPS, _MOST_LISTED, _MOST_PRINTED, _LETTERS = 24, 4, 200, 200, 6, 60
"""Most slope charts that are not folded; most names in a fact; most clips of a table; most items of a list on the page
and in a terminal; most letters of an item there."""
_SLOPES = (
    "Left: a thin line for each clip from A to B, orange where B is worse and blue where it is better; the thick line "
    "is the mean. Right, on its own scale: the difference of each clip and the mean difference with its 95 % interval; "
    "the grey band is the margin. Lower values are better, except for frames per second."
)
_INTERVALS = (
    "The mean difference of each line in per cent of A's mean with its 95 % interval, over the band of its margin. "
    "Triangles: better or worse. Full circles: same. Empty circles: cannot tell."
)
_LINES = (
    "A, B: means over units. Under the difference: its 95 % interval. Of A: its share of A's mean. p: of a test that "
    "flips the signs of the units' differences; p (Holm): corrected for all gated lines, or for the parts of a line."
)
_VERDICTS = (
    "Cells of A and B are paired by scenario, clip, seed, method, inputs, split and noise. Cells of one clip are "
    "averaged first, then clips of one unit. A unit is a performer, or a clip whose performer is not known. Splits and "
    "choices of inputs are never pooled. Behaviours, and known and new performers, are pooled in a line and shown as "
    "its parts.",
    "Each end of the interval is the wider one of Student's t and the studentized bootstrap over units. p comes from a "
    "permutation test that flips the signs of the units' differences. Holm's method corrects it for all gated lines "
    f"that differ in any unit. Fewer than {MIN_UNITS} units cannot show a difference. They can still show that the "
    "sides are the same; the interval is then that of Student's t.",
    "If inputs differ, nothing is compared. The outcome is regressed if one gated line is worse. Otherwise it is "
    "incomplete if cells failed. Otherwise it is not comparable if cells have no partner, coverage differs or a gated "
    "line cannot be decided. Otherwise it is pass.",
)


def write_comparison_page(comparison: Comparison, path: Path) -> Path:
    """Write the page to `path` and return it; its folder is created."""
    return write_page(comparison_page(comparison), path)


def comparison_text(comparison: Comparison) -> str:
    """The page for a terminal; without tables if nothing was compared."""
    return render_text(comparison_page(comparison), _WIDTH)


def comparison_page(comparison: Comparison) -> Page:
    """The page of a comparison."""
    lines = sort_by_verdict([line for line in comparison.differences if line.gated])
    rest = sort_by_verdict([line for line in comparison.differences if not (line.gated or line.part)])
    clips = clips_of(comparison.differences)
    names = [name for name, _, _ in comparison.circumstances]
    parts = deciding_parts(comparison)
    return Page(
        verb="compare",
        name=f"{comparison.b} against {comparison.a}",
        verdict=(outcome_title(comparison.outcome, [comparison]), comparison.outcome),
        headline=comparison_sentence(comparison),
        lead=[
            TerminalOnly([Bullets(_cut(parts, _MOST_PRINTED, "{} more lines: --html"), prefix="")]),
            *([Tally(count_verdicts(lines), MARKS, MEANINGS)] if lines else []),
        ],
        facts={
            "A": comparison.a,
            "B": comparison.b,
            "Clips": f"{len(clips)}: {list_first(clips, _MOST_NAMED)}" if clips else "none",
            "Units": count_units(unit for line in comparison.differences for unit in line.units),
            "Where A and B differ": " ".join(f"{text}." for text in parts[:_MOST_NAMED]),
            "Training data": list_first(comparison.training_notes, _MOST_NAMED),
            "Cells matched": f"{comparison.matched:,}",
            **{
                title: f"{len(texts):,} ({list_first([truncate(text, _LETTERS) for text in texts])})"
                for title, texts in listed_issues(comparison).items()
            },
            "Circumstances": f"differ in {list_first(names, 2 * _MOST_NAMED)}" if names else "the same",
        },
        printed_facts=("A", "B", "Training data", "Cells matched", *listed_issues(comparison)),
        sections=[
            Section("Clip by clip", "slopes", _slopes(lines)),
            Section("Differences and margins", "intervals", _intervals(comparison)),
            Section("All numbers", "figures", _tables(comparison, lines, rest), "gated"),
            Section("What differs", "differs", _what_differs(comparison)),
            Section("How verdicts are made", "verdicts", verdict_notes(lines), terminal=False),
        ],
    )


def _cut(texts: Sequence[str], most: int, what: str = "and {} more") -> list[str]:
    """The first of the texts, and the number of the others."""
    more = len(texts) - most
    return [*texts[:most], *([what.format(f"{more:,}")] if more > 0 else [])]


def _slopes(lines: Sequence[Difference]) -> list[Block]:
    several = len({line.group for line in lines}) > 1
    charted = [(line, partial(slope_chart, line, n)) for n, line in enumerate(lines, start=1) if line.clips]
    panels = [(_panel_heading(line, several), draw) for line, draw in charted]
    shown, rest = panels[:_MOST_OPEN], panels[_MOST_OPEN:]
    more = [BrowserOnly([Panels(rest)], f"{len(rest)} more lines")] if rest else []
    return [BrowserOnly([Prose(_SLOPES)]), Panels(shown), *more] if panels else []


def _panel_heading(line: Difference, several: bool) -> Markup:
    group = tag("small", line.group) if several else None
    title = tag("h3", line.method, tag("small", f"{line.metric} [{line.unit}]"), group)
    return join(title, verdict_badge(line.verdict, MARKS[line.verdict]))


def _intervals(comparison: Comparison) -> list[Block]:
    gated, ungated = ([(None, draw) for draw in interval_charts([comparison], kind)] for kind in (True, False))
    rest = [BrowserOnly([Panels(ungated, broad=True)], "Metrics that are not gated")] if ungated else []
    return [BrowserOnly([Prose(_INTERVALS)]), Panels(gated, broad=True), *rest] if gated or ungated else []


def _tables(comparison: Comparison, lines: Sequence[Difference], rest: Sequence[Difference]) -> list[Block]:
    if not (lines or rest):
        return [BrowserOnly([Prose("Nothing was compared.")])]
    parts = [part for line in lines for part in parts_of(comparison, line)]
    by_metric: dict[str, list[Difference]] = {}
    for line in lines or rest:
        by_metric.setdefault(line.metric, []).append(line)
    return [
        BrowserOnly([lines_table(comparison, lines, "gated lines")]),
        BrowserOnly([lines_table(comparison, parts, "parts of gated lines")], "By behaviour and performers"),
        BrowserOnly([lines_table(comparison, rest, "lines that are not gated")], "Lines that are not gated"),
        BrowserOnly([_clip_table(metric, of) for metric, of in by_metric.items()], "Clip by clip"),
        TerminalOnly(
            [
                lines_table(comparison, lines, "gated lines", with_why=False),
                Bullets(_reasons(lines), prefix=""),
                replace(lines_table(comparison, rest, "", with_why=False), title="not gated"),
            ]
        ),
    ]


def lines_table(comparison: Comparison, lines: Sequence[Difference], label: str, *, with_why: bool = True) -> DataTable:
    """A row for each line; with the reason for its verdict, which the terminal lists apart."""
    several = groups_vary(comparison)
    rows = [
        [
            Stack(line.method, ", ".join(filter(None, _names(line, several)))),
            Badge(line.verdict, MARKS[line.verdict], line.why if with_why else ""),
            format_mean(line, line.mean_a),
            format_mean(line, line.mean_b),
            line_interval(line),
            format_change_percent(percent_of_a(line, line.difference)),
            format_p_value(line.p),
            format_p_value(line.p_holm),
            format_margin(line),
            len(line.units),
        ]
        for line in lines
    ]
    head = ["line", "verdict", "A", "B", "B − A", "of A", "p", "p (Holm)", "margin", "units"]
    return DataTable(head, rows, caption=_LINES, label=label)


def _names(line: Difference, several: bool) -> tuple[str, ...]:
    """Metric, group where it varies, and part of a line."""
    return f"{line.metric} [{line.unit}]", line.group if several else "", line.part.replace("_", " ")


def _reasons(lines: Sequence[Difference]) -> list[str]:
    """Why lines have the verdict "cannot tell", each reason once with its lines."""
    found: dict[str, list[str]] = {}
    for line in lines:
        if line.verdict == "cannot tell":
            found.setdefault(line.why, []).append(f"{line.method} {line.metric}")
    return [f"cannot tell, {why}: {list_first(names)}" for why, names in found.items()]


def _clip_table(metric: str, lines: Sequence[Difference]) -> DataTable:
    """A row for each clip and a column for each line: A, B and their difference."""
    clips = clips_of(lines)
    several = len({line.group for line in lines}) > 1
    head = ["clip", *(f"{line.method}, {line.group}" if several else line.method for line in lines)]
    indices = [{clip: n for n, clip in enumerate(line.clips)} for line in lines]
    rows = [
        [clip, *(_clip_cell(line, at.get(clip)) for line, at in zip(lines, indices, strict=True))]
        for clip in clips[:_MOST_CLIPS]
    ]
    caption = "From A to B, and the difference."
    title, omitted = f"{metric} [{lines[0].unit}]", max(len(clips) - _MOST_CLIPS, 0)
    return DataTable(head, rows, title, caption, f"{metric} by clip", omitted=omitted)


def _clip_cell(line: Difference, at: int | None) -> object:
    if at is None:
        return "–"
    a, b = line.a[at], line.b[at]
    return Stack(f"{format_mean(line, a)} → {format_mean(line, b)}", format_signed(line, b - a))


def _what_differs(comparison: Comparison) -> list[Block]:
    """Circumstances that differ, and issues that prevent a comparison or were allowed."""
    rows = [[name, a, b] for name, a, b in comparison.circumstances]
    table = DataTable(["", "A", "B"], rows, caption="Circumstances that A and B differ in.", label="circumstances")
    issues = [
        Bullets(_cut(texts, _MOST_LISTED), f"{title}: {len(texts):,}")
        for title, texts in listed_issues(comparison).items()
    ]
    nothing = Prose("Nothing: inputs, circumstances and cells are the same.")
    printed = [f"{n}: {' -> '.join(excerpt_pair(a, b, _LETTERS))}" for n, a, b in comparison.circumstances]
    return [
        BrowserOnly([table, *issues] if rows or issues else [nothing]),
        TerminalOnly([Bullets(_cut(printed, _MOST_PRINTED, "{} more circumstances"), prefix="differs: ")]),
    ]


def verdict_notes(lines: Sequence[Difference]) -> list[Block]:
    """How the verdicts of gated lines are made, and the margin of each metric."""
    meanings = [join(verdict_badge(kind, MARKS[kind]), f": {MEANINGS[kind]}.") for kind in KINDS]
    return [*map(Prose, _VERDICTS), Bullets(meanings), _margins_table(lines)]


def _margins_table(lines: Sequence[Difference]) -> DataTable:
    """The margin of each gated metric, absolute and relative to A's mean."""
    rows = []
    for metric in dict.fromkeys(line.metric for line in lines):
        same = [line for line in lines if line.metric == metric]
        ends = [pick(same, key=lambda line: line.margin) for pick in (min, max)]
        absolute = " to ".join(dict.fromkeys(format_margin(line) for line in ends))
        shares = (format_change_percent(percent_of_a(line, line.margin)).lstrip("+") for line in ends)
        rows.append([metric, f"{absolute} {same[0].unit}", " to ".join(dict.fromkeys(shares))])
    caption = "Margins: the smallest change that matters in practice, a share of A's mean but not less than a floor."
    return DataTable(["metric", "margin", "of A's mean"], rows, caption=caption, label="margins")
