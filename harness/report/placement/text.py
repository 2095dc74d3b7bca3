"""A placement study as text for the terminal: what to wear first, then every ranking, and how far it can be trusted."""

import textwrap

from harness.report.paper.text import WIDTH, claims_lines
from harness.report.placement.wording import (
    TIE_NOTE,
    format_difference,
    format_error,
    format_held_out,
    format_percent,
    format_rank_range,
    format_value,
    list_sets,
    original_candidates,
    plain_name,
    search_gain_sentence,
    sentence,
    set_name,
    worth_label,
)
from harness.report.run.text import align_columns
from harness.results.placement_findings import MODES, PlacementFindings, PlacementSearch, Ranking

_MOST_ROWS, _MOST_FAILED = 12, 5


def text(findings: PlacementFindings) -> str:
    """Lines for the terminal."""
    parts = [[textwrap.fill(sentence(findings), WIDTH), *_setup(findings)], _best(findings)]
    if findings.claims:
        parts.append(["what papers say", *claims_lines(findings.claims)])
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
        f"{len(findings.failures)} failed; mean over clips with its 95 % interval",
        textwrap.fill(TIE_NOTE, WIDTH),
    ]


def _best(findings: PlacementFindings) -> list[str]:
    """The best set of each size."""
    head = ["trackers", "best set", "", "error", "held out", "rate", "best of", "stays best", "as good"]
    rows = []
    for best in findings.best:
        tried = findings.of(best.stations)
        rate = f"{tried.rate_hz:g} Hz" if tried else ""
        front = "" if best.on_front else "fewer do better"
        ties = list_sets(best.ties, 2) if best.ties else "none"
        kept = [str(best.of or ""), format_percent(best.stays), ties]
        errors = [format_error(findings, tried), format_held_out(findings, best)]
        rows.append([str(len(best.stations)), set_name(best.stations), front, *errors, rate, *kept])
    used = [i for i in range(len(head)) if any(row[i] for row in rows)]
    lines = [[row[i] for i in used] for row in (head, *rows)]
    return align_columns(lines, text_columns=used.index(3)) if rows else []


def _ranking(findings: PlacementFindings, ranking: Ranking) -> list[str]:
    title = f"{ranking.mode}: {plain_name(ranking.title)} ({MODES[ranking.mode]})"
    head = ["rank", "stations", "", findings.unit, "behind the first"]
    rows = []
    for row in ranking.rows[:_MOST_ROWS]:
        tried = findings.of(row.stations)
        behind = "" if row.rank == 1 else format_difference(row.difference, row.low, row.high)
        tie = "tie" if row.tied and row.rank > 1 else ""
        rank = f"{row.rank} ({format_rank_range(row.rank_low, row.rank_high)})"
        rows.append([rank, set_name(row.stations), tie, format_value(tried.mean if tried else None), behind])
    more = len(ranking.rows) - _MOST_ROWS
    return [title, *align_columns([head, *rows], text_columns=3), *([f"and {more} more"] if more > 0 else [])]


def _search(findings: PlacementFindings, search: PlacementSearch) -> list[str]:
    head = ["step", "stations", "or as well", findings.unit, "gain"]
    rows = []
    for step in search.steps:
        tried = findings.of(step.stations)
        gain = "" if step.difference is None else format_difference(step.difference, step.low, step.high)
        also = ", ".join(map(plain_name, step.tied))
        mean = format_value(tried.mean if tried else None)
        rows.append([plain_name(step.changed) or "start", set_name(step.stations), also, mean, gain])
    ended = [f"ended: {search.ended}"] if search.ended else []
    ended += [held] if (held := search_gain_sentence(search, findings.unit)) else []
    return [
        f"{search.mode}: {plain_name(search.title)} ({MODES[search.mode]})",
        *align_columns([head, *rows], text_columns=3),
        *ended,
    ]


def _worth(findings: PlacementFindings) -> list[str]:
    """What each candidate is worth in every mode."""
    ways = list(dict.fromkeys(worth_label(findings, worth) for worth in findings.worth))
    if not ways:
        return []
    found = {
        (w.candidate, worth_label(findings, w)): format_difference(w.difference, w.low, w.high) for w in findings.worth
    }
    rows = [
        [plain_name(place.name), *(found.get((place.name, one), "") for one in ways)]
        for place in findings.candidates
        if any((place.name, one) in found for one in ways)
    ]
    title = f"what each is worth [{findings.unit}]: error without it less error with it"
    return [title, *align_columns([["candidate", *ways], *rows], text_columns=1)]


def _stability(findings: PlacementFindings) -> list[str]:
    """How alike conditions rank the sets, and what is best in each."""
    if not findings.conditions:
        return []
    sizes = sorted({int(size) for condition in findings.conditions for size in condition.best})
    head = ["condition", *(f"best of {size}" for size in sizes), "clips", "stays best"]
    rows = [
        [
            f"{c.kind}: {c.name}",
            *(set_name(c.best[str(size)]) if str(size) in c.best else "" for size in sizes),
            *(str(c.clips), format_percent(c.stays)),
        ]
        for c in findings.conditions
    ]
    lines = ["elsewhere", *align_columns([head, *rows], text_columns=1 + len(sizes))]
    for pair in findings.agreements:
        tau = "not measured" if pair.tau is None else format_value(pair.tau)
        within = "" if pair.low is None else f" ({format_value(pair.low)} to {format_value(pair.high)})"
        lines.append(f"{pair.a} and {pair.b} rank {pair.sets} sets alike by Kendall's tau {tau}{within}")
    return lines


def _notes_and_failures(findings: PlacementFindings) -> list[str]:
    lines = [textwrap.fill(f"note: {note}", WIDTH) for note in findings.notes]
    failed = list(findings.failures.items())
    lines += [f"FAILED {cell}: {(why.strip().splitlines() or [''])[-1]}" for cell, why in failed[:_MOST_FAILED]]
    return lines + ([f"and {len(failed) - _MOST_FAILED} more failed"] if len(failed) > _MOST_FAILED else [])
