"""The page of a comparison: the verdict, how many lines have which, slopes, intervals, every figure, what differs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.compare.comparison import Comparison, Difference
from harness.compare.paired_statistics import MIN_CLIPS
from harness.report.comparison.tables import clip_tables, differences_section, lines_table, margins_table, verdict_badge
from harness.report.comparison.wording import (
    KINDS,
    MEANINGS,
    OUTCOME_TITLES,
    clips_of,
    count_verdicts,
    list_first,
    listed_issues,
    sentence,
    sort_by_verdict,
)
from harness.report.kit.document import Section, data_uri, document
from harness.report.kit.markup import Markup, details, join, tag
from harness.report.kit.style import Chart
from harness.report.run.data import to_file_name

_MOST_OPEN, _MOST_NAMED = 24, 4
"""Pictures of slopes that are shown at once; names in a fact."""


@dataclass(frozen=True)
class ComparisonCharts:
    """The charts of the page; none where nothing can draw."""

    slopes: Sequence[Chart] = ()
    """Of each gated line, in the order of `sort_by_verdict`."""
    gated: Sequence[Chart] = ()
    """Intervals, a chart for each metric."""
    ungated: Sequence[Chart] = ()
    """The same for lines that are not gated."""


def comparison_page(comparison: Comparison, pictures: ComparisonCharts, missing: Sequence[str]) -> str:
    """The whole file."""
    lines = sort_by_verdict([line for line in comparison.differences if line.gated])
    rest = sort_by_verdict([line for line in comparison.differences if not line.gated])
    word = tag("span", OUTCOME_TITLES[comparison.outcome], class_=f"big {to_file_name(comparison.outcome.word)}")
    sections: list[Section] = [
        ("Clip by clip", "slopes", _slope_section(lines, pictures.slopes)),
        ("Differences and margins", "intervals", _interval_section(pictures)),
        ("Every figure", "figures", _tables_section(comparison, lines, rest)),
        ("What differs", "differs", differences_section(comparison)),
        ("How verdicts are made", "verdicts", _verdict_section(comparison)),
    ]
    return document(
        title=f"{comparison.b} against {comparison.a}: harness compare",
        kicker=f"harness compare · {comparison.b} against {comparison.a}",
        heading=join(word, sentence(comparison)),
        facts=_facts(comparison),
        missing=missing,
        sections=sections,
        lead=_tally(lines) if lines else None,
    )


def _facts(comparison: Comparison) -> Mapping[str, str]:
    found = clips_of(comparison.differences)
    names = [name for name, _, _ in comparison.circumstances]
    facts = {
        "A, the reference": comparison.a,
        "B": comparison.b,
        "Clips": f"{len(found)}: {list_first(found, _MOST_NAMED)}" if found else "none",
        "Cells matched": f"{comparison.matched:,}",
        **{
            title: f"{len(texts):,}: {list_first(texts, _MOST_NAMED)}"
            for title, texts in listed_issues(comparison).items()
        },
        "Circumstances": f"differ in {list_first(names, 2 * _MOST_NAMED)}" if names else "the same",
    }
    return {title: text for title, text in facts.items() if text}


def _tally(lines: Sequence[Difference]) -> Markup:
    items = [
        tag("li", tag("b", count), verdict_badge(kind), tag("span", MEANINGS[kind], class_="meaning"))
        for kind, count in count_verdicts(lines).items()
    ]
    return tag("ul", *items, class_="tally")


def _slope_section(lines: Sequence[Difference], charts: Sequence[Chart]) -> Markup:
    if not charts:
        return Markup()
    text = (
        "Left, a thin line for each clip from A to B, orange where B is worse and blue where it is better; the thick "
        "line is the mean. Right, on a scale of its own, the difference of each clip and their mean with its 95 % "
        "interval; the grey band is the margin. All but frames per second are better when they are lower."
    )
    varied = len({line.group for line in lines}) > 1
    drawn = [line for line in lines if line.clips]
    panels = [_panel(line, chart, varied) for line, chart in zip(drawn, charts, strict=True)]
    rest = panels[_MOST_OPEN:]
    more = details(f"{len(rest)} more lines", tag("div", *rest, class_="panels")) if rest else None
    return join(tag("p", text), tag("div", *panels[:_MOST_OPEN], class_="panels"), more)


def _panel(line: Difference, chart: Chart, varied: bool) -> Markup:
    group = tag("small", line.group) if varied else None
    head = tag("h3", line.method, tag("small", f"{line.metric} [{line.unit}]"), group)
    return tag(
        "figure", head, verdict_badge(line.verdict), _image(chart), tag("figcaption", chart.caption), class_="panel"
    )


def _interval_section(pictures: ComparisonCharts) -> Markup:
    if not (pictures.gated or pictures.ungated):
        return Markup()
    text = (
        "The mean difference of each line in percent of A's mean with its 95 % interval, over the band of its margin. "
        "Full circles are the same, triangles better or worse, empty circles cannot tell."
    )
    rest = details("Metrics that are not gated", _grid(pictures.ungated)) if pictures.ungated else None
    return join(tag("p", text), _grid(pictures.gated), rest)


def _grid(charts: Sequence[Chart]) -> Markup:
    figures = [tag("figure", tag("h3", chart.title), _image(chart), class_="panel") for chart in charts]
    return tag("div", *figures, class_="panels broad")


def _image(chart: Chart) -> Markup:
    return tag("img", src=data_uri(chart.for_screen().encode(), "image/svg+xml"), alt=chart.alt)


def _tables_section(comparison: Comparison, lines: Sequence[Difference], rest: Sequence[Difference]) -> Markup:
    if not (lines or rest):
        return tag("p", "Nothing was compared.")
    return join(
        lines_table(comparison, lines, "gated lines") if lines else None,
        details("Lines that are not gated", lines_table(comparison, rest, "lines that are not gated"))
        if rest
        else None,
        details("Clip by clip", clip_tables(lines or rest)),
    )


def _verdict_section(comparison: Comparison) -> Markup:
    items = [tag("li", verdict_badge(kind), ": ", MEANINGS[kind], ".") for kind in KINDS]
    texts: list[Any] = [
        "Cells of A and B are paired by scenario, clip, seed, method, inputs, split and noise. Cells of one clip "
        "are averaged first: the clip is the unit, for clips are what another study would draw anew. Known and new "
        "performers, protocols and choices of inputs are never pooled.",
        "The interval is the bias-corrected and accelerated bootstrap over clips, its level expanded for small "
        "numbers of them. p is that of a permutation test that flips the signs of the clips' differences, corrected "
        "for all gated lines that differ in any clip by Holm's method. With fewer than "
        f"{MIN_CLIPS} clips nothing is told.",
        "Where inputs differ nothing is compared. One gated line that is worse makes the outcome regressed; else "
        "failed cells make it incomplete; else cells without a partner, unequal coverage or a gated line that cannot "
        "be told make it not comparable; else it passes.",
    ]
    return join(*(tag("p", text) for text in texts), tag("ul", *items, class_="notes"), margins_table(comparison))
