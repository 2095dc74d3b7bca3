"""The page of a comparison: outcome, counts of verdicts, charts, tables, and what differs between A and B."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.compare.comparison import Comparison, Difference
from harness.compare.paired_statistics import MIN_UNITS
from harness.compare.units import count_units
from harness.report.comparison.tables import clip_tables, differences_section, lines_table, margins_table
from harness.report.comparison.wording import (
    KINDS,
    MARKS,
    MEANINGS,
    OUTCOME_TITLES,
    clips_of,
    count_verdicts,
    deciding_parts,
    listed_issues,
    parts_of,
    sentence,
    sort_by_verdict,
)
from harness.report.kit.document import Section, chart_image, chart_panel, document
from harness.report.kit.markup import Markup, bullet_list, details, join, tag
from harness.report.kit.style import Chart
from harness.report.kit.text import list_first, to_file_name
from harness.report.kit.verdict_badge import tally_list, verdict_badge

_MOST_OPEN, _MOST_NAMED = 24, 4
"""Most slope charts that are not folded; most names in a fact."""


@dataclass(frozen=True)
class ComparisonCharts:
    """The charts of the page."""

    slopes: Sequence[Chart] = ()
    """Slope chart of each gated line, in the order of `sort_by_verdict`."""
    gated: Sequence[Chart] = ()
    """Interval chart of each metric, for gated lines."""
    ungated: Sequence[Chart] = ()
    """Interval chart of each metric, for lines that are not gated."""


def comparison_page(comparison: Comparison, pictures: ComparisonCharts) -> str:
    """The HTML of the page."""
    lines = sort_by_verdict([line for line in comparison.differences if line.gated])
    rest = sort_by_verdict([line for line in comparison.differences if not (line.gated or line.part)])
    word = tag("span", OUTCOME_TITLES[comparison.outcome], class_=f"big {to_file_name(comparison.outcome.word)}")
    sections: list[Section] = [
        ("Clip by clip", "slopes", _slope_section(lines, pictures.slopes)),
        ("Differences and margins", "intervals", _interval_section(pictures)),
        ("All numbers", "figures", _tables_section(comparison, lines, rest)),
        ("What differs", "differs", differences_section(comparison)),
        ("How verdicts are made", "verdicts", _verdict_section(comparison)),
    ]
    return document(
        title=f"{comparison.b} against {comparison.a}: harness compare",
        kicker=f"harness compare · {comparison.b} against {comparison.a}",
        heading=join(word, sentence(comparison)),
        facts=_facts(comparison),
        sections=sections,
        lead=tally_list(count_verdicts(lines), MARKS, MEANINGS) if lines else None,
    )


def _facts(comparison: Comparison) -> Mapping[str, str]:
    clips = clips_of(comparison.differences)
    names = [name for name, _, _ in comparison.circumstances]
    facts = {
        "A, the reference": comparison.a,
        "B": comparison.b,
        "Clips": f"{len(clips)}: {list_first(clips, _MOST_NAMED)}" if clips else "none",
        "Units": count_units(unit for line in comparison.differences for unit in line.units),
        "Where A and B differ": " ".join(f"{text}." for text in deciding_parts(comparison)[:_MOST_NAMED]),
        "Training data": list_first(comparison.training_notes, _MOST_NAMED),
        "Cells matched": f"{comparison.matched:,}",
        **{
            title: f"{len(texts):,}: {list_first(texts, _MOST_NAMED)}"
            for title, texts in listed_issues(comparison).items()
        },
        "Circumstances": f"differ in {list_first(names, 2 * _MOST_NAMED)}" if names else "the same",
    }
    return {title: text for title, text in facts.items() if text}


def _slope_section(lines: Sequence[Difference], charts: Sequence[Chart]) -> Markup:
    if not charts:
        return Markup()
    text = (
        "Left: a thin line for each clip from A to B, orange where B is worse and blue where it is better; the thick "
        "line is the mean. Right, on its own scale: the difference of each clip and the mean difference with its 95 % "
        "interval; the grey band is the margin. Lower values are better, except for frames per second."
    )
    varied = len({line.group for line in lines}) > 1
    charted = [line for line in lines if line.clips]
    panels = [_panel(line, chart, varied) for line, chart in zip(charted, charts, strict=True)]
    rest = panels[_MOST_OPEN:]
    more = details(f"{len(rest)} more lines", tag("div", *rest, class_="panels")) if rest else None
    return join(tag("p", text), tag("div", *panels[:_MOST_OPEN], class_="panels"), more)


def _panel(line: Difference, chart: Chart, varied: bool) -> Markup:
    group = tag("small", line.group) if varied else None
    badge = verdict_badge(line.verdict, MARKS[line.verdict])
    head = tag("h3", line.method, tag("small", f"{line.metric} [{line.unit}]"), group)
    return tag("figure", head, badge, chart_image(chart), tag("figcaption", chart.caption), class_="panel")


def _interval_section(pictures: ComparisonCharts) -> Markup:
    if not (pictures.gated or pictures.ungated):
        return Markup()
    text = (
        "The mean difference of each line in per cent of A's mean with its 95 % interval, over the band of its margin. "
        "Triangles: better or worse. Full circles: same. Empty circles: cannot tell."
    )
    rest = details("Metrics that are not gated", _grid(pictures.ungated)) if pictures.ungated else None
    return join(tag("p", text), _grid(pictures.gated), rest)


def _grid(charts: Sequence[Chart]) -> Markup:
    return tag("div", *map(chart_panel, charts), class_="panels broad")


def _tables_section(comparison: Comparison, lines: Sequence[Difference], rest: Sequence[Difference]) -> Markup:
    if not (lines or rest):
        return tag("p", "Nothing was compared.")
    return join(
        lines_table(comparison, lines, "gated lines") if lines else None,
        details("By behaviour and performers", lines_table(comparison, parts, "parts of gated lines"))
        if (parts := [part for line in lines for part in parts_of(comparison, line)])
        else None,
        details("Lines that are not gated", lines_table(comparison, rest, "lines that are not gated"))
        if rest
        else None,
        details("Clip by clip", clip_tables(lines or rest)),
    )


def _verdict_section(comparison: Comparison) -> Markup:
    meanings = bullet_list([join(verdict_badge(kind, MARKS[kind]), ": ", MEANINGS[kind], ".") for kind in KINDS])
    texts: list[Any] = [
        "Cells of A and B are paired by scenario, clip, seed, method, inputs, split and noise. Cells of one clip are "
        "averaged first, then clips of one unit. A unit is a performer, or a clip whose performer is not known. "
        "Splits and choices of inputs are never pooled. Behaviours, and known and new performers, are pooled in a line "
        "and shown as its parts.",
        "Each end of the interval is the wider one of Student's t and the studentized bootstrap over units. p comes "
        "from a permutation test that flips the signs of the units' differences. Holm's method corrects it for all "
        f"gated lines that differ in any unit. Fewer than {MIN_UNITS} units cannot show a difference. They can still "
        "show that the sides are the same; the interval is then that of Student's t.",
        "If inputs differ, nothing is compared. The outcome is regressed if one gated line is worse. Otherwise it is "
        "incomplete if cells failed. Otherwise it is not comparable if cells have no partner, coverage differs or a "
        "gated line cannot be decided. Otherwise it is pass.",
    ]
    return join(*(tag("p", text) for text in texts), meanings, margins_table(comparison))
