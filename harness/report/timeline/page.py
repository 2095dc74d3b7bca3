"""The page of a timeline: the changes found, a chart for each metric, and the entries."""

import math
import shlex
from collections.abc import Mapping
from functools import partial
from pathlib import Path

from harness.compare import compare_runs, count_needed
from harness.compare.timeline import CHANGE_LEVEL, MIN_ENTRIES, ChangePoint, Timeline, TimelineSeries
from harness.core.number_format import Interval, count_noun, format_change_percent, format_number, format_p_value
from harness.report.comparison.page import write_comparison_page
from harness.report.comparison.wording import MARKS
from harness.report.kit.markup import join, tag
from harness.report.kit.page import (
    Badge,
    Block,
    BrowserOnly,
    DataTable,
    Drawing,
    Page,
    Prose,
    Section,
    Stack,
    TerminalOnly,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.kit.style import COLOURS
from harness.report.kit.text import list_first, metric_label, to_file_name, truncate
from harness.report.timeline.chart import timeline_chart

_WIDTH, _MOST_PAGES, _MOST_PRINTED = 160, 8, 40
_ORDERS = {"commit": "the dates of their commits", "date": "the dates of their runs", "given": "the command line"}
_CAPTION = (
    "Where: the entries before and after the change. Change: mean of the entries up to the next change minus that of "
    "those before, with its 95 % interval over units. p: corrected for all series (Holm)."
)
_HOW = (
    "A series is one metric of one method over entries that can be compared. Its values are means over units, of the "
    "cells that all its entries have. Where inputs differ between neighbours, new series begin. Times are compared on "
    "one processor only, so that their series also begin anew with another processor.",
    "Binary segmentation (Scott and Knott 1974) looks for the entries between which the mean changes. p is that of the "
    "largest change among all splits and windows. Where enough units differ, it comes from flips of the signs of the "
    "units' paired differences. Otherwise, and for times, it comes from the noise of the entries, and holds for these "
    "units only.",
    f"A change is shown if p is at most {CHANGE_LEVEL:g} after Holm's correction over all series, and if it exceeds "
    "the margin of `harness compare`; for times 25 %. A single slow run is no change of a time. A machine that is busy "
    "for several runs in a row can still look like a change of the time.",
)
Links = Mapping[tuple[int, int], str]
"""Numbers of two entries -> the page that compares them, relative to that of the timeline."""


def write_timeline_page(timeline: Timeline, path: Path) -> Path:
    """Write the page to `path`, and beside it the comparisons of the entries at the largest changes; returns `path`."""
    folder, links = path.with_name(f"{path.stem}_comparisons"), dict[tuple[int, int], str]()
    for series, change in sort_changes(timeline):
        before, after = pair = entries_at(series, change)
        if pair not in links and len(links) < _MOST_PAGES:
            sides = timeline.entries[before], timeline.entries[after]
            name = f"{to_file_name(sides[0].name)}-{to_file_name(sides[1].name)}.html"
            write_comparison_page(compare_runs(sides[0].where, sides[1].where), folder / name)
            links[pair] = f"{folder.name}/{name}"
    return write_page(timeline_page(timeline, links), path)


def timeline_text(timeline: Timeline) -> str:
    """The page for a terminal."""
    return render_text(timeline_page(timeline), _WIDTH)


def timeline_page(timeline: Timeline, links: Links | None = None) -> Page:
    """The page of a timeline."""
    entries, first, last = timeline.entries, timeline.entries[0], timeline.entries[-1]
    metrics = list(dict.fromkeys(series.metric for series in timeline.series))
    drawings = [_drawing(timeline, metric, n) for n, metric in enumerate(metrics)]
    lead = [BrowserOnly(drawings[:1])] if drawings else []
    breaks = [f"{entry.name}: {entry.break_why}" for entry in entries if entry.break_why]
    processors = dict.fromkeys(entry.processor for entry in entries if entry.processor)
    undecided = _undecided(timeline)
    return Page(
        verb="timeline",
        name=f"{first.name} to {last.name}",
        headline=_headline(timeline),
        lead=lead,
        facts={
            "Entries": f"{len(entries)}, in the order of {_ORDERS[timeline.order]}",
            "New series begin at": list_first(breaks, 4, "; "),
            "Machines": f"{len(processors)}; times are compared on one only" if len(processors) > 1 else "",
            "Cannot tell": undecided,
        },
        sections=[
            Section("Changes", "changes", _changes(timeline, links or {})),
            Section("Other metrics", "time", [TerminalOnly(drawings[:1]), *drawings[1:]], "over time"),
            Section("Entries", "entries", [BrowserOnly([_entries(timeline)])]),
            Section("How changes are found", "how", [*map(Prose, _HOW)], terminal=False),
        ],
    )


def sort_changes(timeline: Timeline) -> list[tuple[TimelineSeries, ChangePoint]]:
    """The changes with their series, the largest relative ones first."""
    found = [(series, change) for series in timeline.series for change in series.changes]
    return sorted(found, key=lambda item: -abs(_percent(*item)))


def _percent(series: TimelineSeries, change: ChangePoint) -> float:
    percent = series.percent(change)
    return 0.0 if math.isnan(percent) else percent


def entries_at(series: TimelineSeries, change: ChangePoint) -> tuple[int, int]:
    """Numbers of the entries before and after a change."""
    return series.entries[change.at - 1], series.entries[change.at]


def _headline(timeline: Timeline) -> str:
    found = sort_changes(timeline)
    over = f"in {len(timeline.series)} series over {len(timeline.entries)} entries"
    if not timeline.series:
        return "No two entries can be compared."
    if not found:
        return f"No change {over}."
    groups: dict[tuple[str, str, int], list[str]] = {}
    for series, change in found:
        text = f"{series.metric} {format_change_percent(series.percent(change))}"
        groups.setdefault((series.method, series.verdict(change), entries_at(series, change)[1]), []).append(text)
    texts = [
        f"{method} {verdict} at {timeline.entries[at].name} ({list_first(changes, 1)})"
        for (method, verdict, at), changes in groups.items()
    ]
    return f"{count_noun(len(found), 'change')} {over}: {list_first(texts, 3, '; ')}."


def _undecided(timeline: Timeline) -> str:
    """Why changes of some series cannot be found."""
    needed = count_needed(len(timeline.series), CHANGE_LEVEL)
    short = [each for each in timeline.series if len(each.entries) < MIN_ENTRIES]
    few = [each for each in short if each.units < needed or each.metric.startswith("step_")]
    if not few:
        return ""
    names = list_first([f"{each.method} {each.metric}" for each in few])
    return f"{len(few)} series with fewer than {MIN_ENTRIES} entries and {needed} units: {names}"


def _changes(timeline: Timeline, links: Links) -> list[Block]:
    rows, printed = list[list[object]](), list[list[object]]()
    for series, change in sort_changes(timeline):
        pair = entries_at(series, change)
        before, after = (timeline.entries[at] for at in pair)
        verdict = series.verdict(change)
        interval = Interval.of(change.difference, change.low, change.high, signed=True)
        command = shlex.join(["harness", "compare", before.where, after.where])
        cells: list[object] = [
            Stack(series.method, f"{series.metric} [{series.unit}]"),
            Badge(verdict, MARKS["worse" if verdict == "worse" else "better"]),
            f"{before.name} → {after.name}",
            interval,
            format_change_percent(series.percent(change)),
            format_p_value(change.p),
        ]
        link = tag("a", "clip by clip", href=links[pair]) if pair in links else None
        rows.append([*cells, join(link, tag("br") if link else None, tag("code", command))])
        printed.append([*cells, command])
    head = ["series", "verdict", "where", "change", "relative", "p", "comparison"]
    nothing = [Prose("No change was found.")] if timeline.series else []
    table = DataTable(head, rows, caption=_CAPTION, label="changes")
    return [BrowserOnly([table]), TerminalOnly([DataTable(head, printed)])] if rows else [BrowserOnly(nothing)]


def _drawing(timeline: Timeline, metric: str, number: int) -> Drawing:
    of_it = [series for series in timeline.series if series.metric == metric]
    several = len({series.group for series in of_it}) > 1
    rows = [
        [
            Stack(series.method, series.group if several else ""),
            f"{timeline.entries[series.entries[0]].name} to {timeline.entries[series.entries[-1]].name}",
            format_number(series.means[0], series.unit),
            format_number(series.means[-1], series.unit),
            format_change_percent(100.0 * (series.means[-1] / series.means[0] - 1.0) if series.means[0] else math.nan),
            series.units,
            len(series.changes),
        ]
        for series in of_it
    ]
    head = ["series", "entries", "first", "last", "from first to last", "units", "changes"]
    title = f"{metric} [{of_it[0].unit}]"
    numbers = DataTable(head, rows, title, label=title, most_printed=_MOST_PRINTED)
    names = [truncate(entry.name, 14) for entry in timeline.entries]
    draw = partial(timeline_chart, f"timeline_{number}", metric_label(metric), names, of_it, _colours(timeline))
    return Drawing(draw, numbers)


def _colours(timeline: Timeline) -> dict[str, str]:
    """The colour of each method that has one: of all methods, or of those that changed where there are many."""
    methods = list(dict.fromkeys(series.method for series in timeline.series))
    if len(methods) > len(COLOURS):
        methods = [method for method in methods if any(s.changes for s in timeline.series if s.method == method)]
    return dict(zip(methods, COLOURS, strict=False))


def _entries(timeline: Timeline) -> DataTable:
    rows = [
        [entry.name, entry.commit[:10], entry.commit_date[:10], entry.date[:10], entry.processor, entry.break_why]
        for entry in timeline.entries
    ]
    head = ["entry", "commit", "of", "run", "processor", "new series, because"]
    return DataTable(head, rows, caption="In the order of the charts.", fold=f"{len(rows)} entries")
