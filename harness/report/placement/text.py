"""A placement study as text for the terminal: the recommended set, then rankings, contributions and stability."""

import textwrap

from harness.core.number_format import NOT_MEASURED
from harness.core.text_table import Table
from harness.report.kit.statement_lines import WIDTH
from harness.report.kit.text import last_line
from harness.report.paper.text import claims_lines
from harness.report.placement.wording import (
    TIE_NOTE,
    changes_sentence,
    format_difference,
    format_error,
    format_held_out,
    format_rank_range,
    format_stays,
    format_value,
    format_value_interval,
    list_sets,
    original_candidates,
    plain_name,
    power_sentences,
    ranks_by_condition,
    search_gain_sentence,
    sentence,
    set_name,
    worth_label,
)
from harness.results.placement_findings import MODES, PlacementFindings, PlacementSearch, Ranking

_MOST_ROWS, _MOST_FAILED = 12, 5


def text(findings: PlacementFindings) -> str:
    """The text of a placement study."""
    parts = [[textwrap.fill(sentence(findings), WIDTH), *_setup(findings)], _best(findings)]
    if findings.claims:
        parts.append(["published statements", *claims_lines(findings.claims)])
    parts += [_ranking(findings, ranking) for ranking in findings.rankings if len(ranking.rows) > 1]
    parts += [_search(findings, search) for search in findings.searches]
    parts += [_worth(findings), _stability(findings), _notes_and_failures(findings)]
    return "\n\n".join("\n".join(part) for part in parts if part)


def _setup(findings: PlacementFindings) -> list[str]:
    what = f"{findings.metric} [{findings.unit}] of {', '.join(findings.methods)} on {', '.join(findings.behaviours)}"
    link = f"; {findings.link}" if findings.link else ""
    return [
        textwrap.fill(f"{what}, {findings.motion}, noise {findings.noise}, seed {findings.seed}{link}", WIDTH),
        f"{len(original_candidates(findings))} candidates, {len(findings.tried)} sets, {findings.planned:,} cells, "
        f"{len(findings.failures)} failed; mean over units with 95 % interval",
        textwrap.fill(TIE_NOTE, WIDTH),
        *([textwrap.fill(" ".join(power_sentences(findings.power)), WIDTH)] if findings.power else []),
    ]


def _best(findings: PlacementFindings) -> list[str]:
    """The best set of each size."""
    head = ["stations", "best set", "", "error", "held out", "rate", "best of", "stays best", "ties"]
    rows = []
    for best in findings.best:
        tried = findings.of(best.stations)
        rate = f"{tried.rate_hz:g} Hz" if tried else ""
        front = "" if best.on_front else "a smaller set is better"
        ties = list_sets(best.ties, 2) if best.ties else "none"
        notes = [str(best.of or ""), format_stays(best.stays), ties]
        errors = [format_error(findings, tried), format_held_out(findings, best)]
        rows.append([str(len(best.stations)), set_name(best.stations), front, *errors, rate, *notes])
    used = [i for i in range(len(head)) if any(row[i] for row in rows)]
    columns = [head[i] for i in used], [[row[i] for i in used] for row in rows]
    return Table(*columns, text_columns=used.index(3)).lines() if rows else []


def _ranking(findings: PlacementFindings, ranking: Ranking) -> list[str]:
    title = f"{ranking.mode}: {plain_name(ranking.title)} ({MODES[ranking.mode]})"
    head = ["rank", "stations", "", findings.unit, "difference to the first"]
    rows = []
    for row in ranking.rows[:_MOST_ROWS]:
        tried = findings.of(row.stations)
        difference = "" if row.rank == 1 else format_difference(row.difference, row.low, row.high)
        tie = "tie" if row.tied and row.rank > 1 else ""
        rank = f"{row.rank} ({format_rank_range(row.rank_low, row.rank_high)})"
        rows.append([rank, set_name(row.stations), tie, format_value(tried.mean if tried else None), difference])
    more = len(ranking.rows) - _MOST_ROWS
    return [title, *Table(head, rows, text_columns=3).lines(), *([f"and {more} more"] if more > 0 else [])]


def _search(findings: PlacementFindings, search: PlacementSearch) -> list[str]:
    head = ["step", "stations", "tied steps", findings.unit, "gain"]
    rows = []
    for step in search.steps:
        tried = findings.of(step.stations)
        gain = "" if step.difference is None else format_difference(step.difference, step.low, step.high)
        also = ", ".join(map(plain_name, step.tied))
        mean = format_value(tried.mean if tried else None)
        rows.append([plain_name(step.changed) or "start", set_name(step.stations), also, mean, gain])
    notes = [f"ended: {search.ended}"] if search.ended else []
    notes += [gain] if (gain := search_gain_sentence(search, findings.unit)) else []
    return [
        f"{search.mode}: {plain_name(search.title)} ({MODES[search.mode]})",
        *Table(head, rows, text_columns=3).lines(),
        *notes,
    ]


def _worth(findings: PlacementFindings) -> list[str]:
    """The contribution of each candidate, a column for each way in which it was measured."""
    labels = list(dict.fromkeys(worth_label(findings, worth) for worth in findings.worth))
    if not labels:
        return []
    differences = {
        (w.candidate, worth_label(findings, w)): format_difference(w.difference, w.low, w.high) for w in findings.worth
    }
    rows = [
        [plain_name(place.name), *(differences.get((place.name, label), "") for label in labels)]
        for place in findings.candidates
        if any((place.name, label) in differences for label in labels)
    ]
    title = f"contribution of each candidate [{findings.unit}]: error without it minus error with it"
    return [title, *Table(["candidate", *labels], rows).lines()]


def _stability(findings: PlacementFindings) -> list[str]:
    """The best set of each size under each condition, and how well the rankings of conditions agree."""
    if not findings.conditions:
        return []
    sizes = sorted({int(size) for condition in findings.conditions for size in condition.best})
    head = ["condition", *(f"best of {size}" for size in sizes), "units", "stays best"]
    rows = [
        [
            f"{c.kind}: {c.name}",
            *(set_name(c.best[str(size)]) if str(size) in c.best else "" for size in sizes),
            *(str(c.clips), format_stays(c.stays)),
        ]
        for c in findings.conditions
    ]
    lines = ["stability of the ranking", *Table(head, rows, text_columns=1 + len(sizes)).lines()]
    lines += ["", *_ranks(findings), ""] if findings.compared else []
    own = findings.conditions[0].name
    shown = [pair for pair in findings.agreements if own in (pair.a, pair.b)]
    for pair in shown:
        tau = NOT_MEASURED if pair.tau is None else format_value(pair.tau)
        interval = format_value_interval(pair.low, pair.high)
        within = f" ({interval})" if interval else ""
        line = f"{pair.a} and {pair.b}: the rankings of {pair.sets} sets have Kendall's tau {tau}{within}"
        lines.append(textwrap.fill(f"{line}; {changes_sentence(findings, pair)}", WIDTH, subsequent_indent="  "))
    if len(shown) < len(findings.agreements):
        lines.append(f"pairs of conditions that are on the page alone: {len(findings.agreements) - len(shown)}")
    return lines


def _ranks(findings: PlacementFindings) -> list[str]:
    """The rank of each compared set under each condition."""
    head = ["rank of the set under each condition", *(condition.name for condition in findings.conditions)]
    rows = [
        [set_name(names), *(NOT_MEASURED if rank is None else str(rank) for rank in ranks)]
        for names, ranks in ranks_by_condition(findings, _MOST_ROWS)
    ]
    more = len(findings.compared) - len(rows)
    return [*Table(head, rows).lines(), *([f"and {more} more"] if more > 0 else [])]


def _notes_and_failures(findings: PlacementFindings) -> list[str]:
    lines = [textwrap.fill(f"note: {note}", WIDTH) for note in findings.notes]
    failed = list(findings.failures.items())
    lines += [f"FAILED {cell}: {last_line(traceback)}" for cell, traceback in failed[:_MOST_FAILED]]
    return lines + ([f"and {len(failed) - _MOST_FAILED} more failed"] if len(failed) > _MOST_FAILED else [])
