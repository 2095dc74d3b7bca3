"""The page of several results against one reference: a row for each line, a column for each result."""

from collections.abc import Sequence
from pathlib import Path

from harness.compare import Comparison, ComparisonSet, Difference, count_units
from harness.core.number_format import count_noun, format_change_percent
from harness.errors import Outcome
from harness.report.comparison.charts import interval_charts
from harness.report.comparison.page import verdict_notes
from harness.report.comparison.wording import (
    MARKS,
    MEANINGS,
    count_verdicts,
    format_mean,
    line_interval,
    listed_issues,
    outcome_title,
    percent_of_a,
)
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
from harness.report.kit.text import list_first

_WIDTH, _MOST_ISSUES = 160, 12
_CELLS = (
    "A column for each result: its mean over units, the difference to the reference with its 95 % interval, and the "
    "verdict. The mean of the reference is that of the cells which it shares with the first result that has the line."
)
_ISSUES = "A is the reference, B the result that the line begins with."
_GATED = f"gated; {', '.join(f'{mark} {verdict}' for verdict, mark in MARKS.items())}"
_FAMILY = "Holm's method corrects p for the gated lines of all results together."


def write_set_page(comparisons: ComparisonSet, path: Path) -> Path:
    """Write the page to `path` and return it; its folder is created."""
    return write_page(set_page(comparisons), path)


def set_text(comparisons: ComparisonSet) -> str:
    """The page for a terminal."""
    return render_text(set_page(comparisons), _WIDTH)


def set_page(comparisons: ComparisonSet) -> Page:
    """The page of several results against one reference."""
    every = comparisons.comparisons
    gated = [line for each in every for line in each.differences if line.gated]
    issues = [
        f"{each.b}: {title.lower()}: {text}"
        for each in every
        for title, texts in listed_issues(each).items()
        for text in texts[:_MOST_ISSUES]
    ]
    names = [each.b for each in every]
    return Page(
        verb="compare",
        name=f"{list_first(names)} against {comparisons.reference}",
        verdict=(outcome_title(comparisons.outcome, every), comparisons.outcome),
        headline=_headline(comparisons),
        lead=[Tally(count_verdicts(gated), MARKS, MEANINGS)] if gated else [],
        facts={
            "Reference": comparisons.reference,
            "Results": list_first(names, 8),
            "Units": count_units(unit for line in gated for unit in line.units) if gated else "",
        },
        sections=[
            Section("Differences to the reference", "lines", _line_tables(comparisons, gated=True), _GATED),
            Section("Differences and margins", "intervals", _charts(comparisons), terminal=False),
            Section("Lines that are not gated", "more", _line_tables(comparisons, gated=False), "not gated"),
            Section("Can they be compared", "comparable", [_outcomes(every), Bullets(issues, _ISSUES)], "each result"),
            Section("What differs", "differs", [BrowserOnly([_circumstances(comparisons)])]),
            Section("How verdicts are made", "verdicts", [Prose(_FAMILY), *verdict_notes(gated)], terminal=False),
        ],
    )


def _headline(comparisons: ComparisonSet) -> str:
    every, reference = comparisons.comparisons, comparisons.reference
    worse = [each for each in every if each.outcome is Outcome.REGRESSED]
    if worse:
        texts = [f"{each.b} {_describe_worse(each)}" for each in worse]
        some = f"{len(worse)} of {count_noun(len(every), 'result')} {'is' if len(worse) == 1 else 'are'}"
        return f"{some} worse than {reference}: {list_first(texts, 3, '; ')}."
    if comparisons.outcome is Outcome.PASS:
        lines = count_noun(sum(line.gated for each in every for line in each.differences), "gated line")
        return f"None of {count_noun(len(every), 'result')} is worse than {reference} in {lines}."
    undecided = [f"{each.b}: {each.why}" for each in every if each.outcome is not Outcome.PASS]
    reasons = list_first(undecided, 2, "; ").rstrip(".")
    return f"It cannot be decided whether a result is worse than {reference}. {reasons}."


def _describe_worse(comparison: Comparison) -> str:
    gated = [line for line in comparison.differences if line.gated]
    worse = [line for line in gated if line.verdict == "worse"]
    most = max(worse, key=lambda line: abs(percent_of_a(line, line.difference)))
    change = format_change_percent(percent_of_a(most, most.difference))
    return f"in {len(worse)} of {len(gated)} gated lines, most in {most.metric} ({change})"


def _rows_of(comparisons: ComparisonSet, gated: bool) -> dict[tuple[str, str, str], dict[str, Difference]]:
    """(method, inputs and split, metric) -> name of a result -> its line; of different methods without the method."""
    rows: dict[tuple[str, str, str], dict[str, Difference]] = {}
    for each in comparisons.comparisons:
        for line in each.differences:
            if line.gated == gated and not line.part:
                group = line.group.partition(", ")[0] if comparisons.between_methods else line.group
                key = "" if comparisons.between_methods else line.method, group, line.metric
                rows.setdefault(key, {})[each.b] = line
    return rows


def _line_tables(comparisons: ComparisonSet, gated: bool) -> list[Block]:
    rows = _rows_of(comparisons, gated)
    if not rows:
        return [Prose("Nothing was compared.")] if gated else []
    several = len({group for _, group, _ in rows}) > 1
    names = [each.b for each in comparisons.comparisons]
    head = ["line", comparisons.reference, *names]
    tables = []
    for cell in (_shown_cell, _printed_cell):
        body: list[list[object]] = []
        for (method, group, metric), lines in rows.items():
            first = next(iter(lines.values()))
            texts = [text for text in (method, f"{metric} [{first.unit}]", group if several else "") if text]
            title = Stack(texts[0], ", ".join(texts[1:]))
            body.append([title, format_mean(first, first.mean_a), *(cell(lines.get(name)) for name in names)])
        tables.append(DataTable(head, body, caption=_CELLS, label="gated lines" if gated else "further lines"))
    return [BrowserOnly([tables[0]]), TerminalOnly([tables[1]])]


def _shown_cell(line: Difference | None) -> object:
    if line is None:
        return "–"
    lower = f"{format_mean(line, line.mean_b)}, {line_interval(line)}"
    return Badge(line.verdict, MARKS[line.verdict], lower)


def _printed_cell(line: Difference | None) -> object:
    return "–" if line is None else f"{format_mean(line, line.mean_b)} {MARKS[line.verdict]} {line_interval(line)}"


def _charts(comparisons: ComparisonSet) -> list[Block]:
    charts = interval_charts(comparisons.comparisons, True, between_methods=comparisons.between_methods)
    return [Panels([(None, draw) for draw in charts], broad=True)] if charts else []


def _outcomes(every: Sequence[Comparison]) -> DataTable:
    rows = [[each.b, outcome_title(each.outcome, [each]), f"{each.matched:,}", each.why] for each in every]
    return DataTable(["result", "outcome", "cells matched", "reason"], rows, label="outcome of each result")


def _circumstances(comparisons: ComparisonSet) -> DataTable:
    every = comparisons.comparisons
    values: dict[str, dict[str, str]] = {}
    for each in every:
        for name, a, b in each.circumstances:
            values.setdefault(name, {comparisons.reference: a})[each.b] = b
    names = [comparisons.reference, *(each.b for each in every)]
    rows = [[name, *(of.get(side, of[comparisons.reference]) for side in names)] for name, of in values.items()]
    return DataTable(["", *names], rows, caption="Circumstances in which results differ.", label="circumstances")
