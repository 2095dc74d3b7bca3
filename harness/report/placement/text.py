"""A placement study as text for the terminal: what to wear first, then every ranking, and how far it can be trusted."""

import textwrap

from harness.report.paper.text import WIDTH, claims_text
from harness.report.placement.wording import (
    TIES,
    difference,
    error,
    figure,
    given,
    held_out,
    listed,
    named,
    plain_name,
    ranks,
    saved,
    sentence,
    share,
    way,
)
from harness.report.run.text import aligned
from harness.results.placement_findings import MODES, PlacementFindings, Ranking, Search

_MOST_ROWS, _MOST_FAILED = 12, 5


def text(findings: PlacementFindings) -> str:
    """Lines for the terminal."""
    parts = [[textwrap.fill(sentence(findings), WIDTH), *_about(findings)], _best(findings)]
    if findings.claims:
        parts.append(["what papers say", *claims_text(findings.claims)])
    parts += [_ranking(findings, ranking) for ranking in findings.rankings if len(ranking.rows) > 1]
    parts += [_search(findings, search) for search in findings.searches]
    parts += [_worth(findings), _stability(findings), _rest(findings)]
    return "\n\n".join("\n".join(part) for part in parts if part)


def _about(findings: PlacementFindings) -> list[str]:
    what = f"{findings.metric} [{findings.unit}] of {', '.join(findings.methods)} on {', '.join(findings.behaviours)}"
    link = f"; {findings.link}" if findings.link else ""
    return [
        textwrap.fill(f"{what}, {findings.motion}, noise {findings.noise}, seed {findings.seed}{link}", WIDTH),
        f"{len(given(findings))} candidates, {len(findings.tried)} sets, {findings.planned:,} cells, "
        f"{len(findings.failures)} failed; mean over clips with its 95 % interval",
        textwrap.fill(TIES, WIDTH),
    ]


def _best(findings: PlacementFindings) -> list[str]:
    """The best set of each size."""
    head = ["trackers", "best set", "", "error", "held out", "rate", "best of", "stays best", "as good"]
    rows = []
    for best in findings.best:
        tried = findings.of(best.stations)
        rate = f"{tried.rate_hz:g} Hz" if tried else ""
        front = "" if best.on_front else "fewer do better"
        ties = listed(best.ties, 2) if best.ties else "none"
        kept = [str(best.of or ""), share(best.stays), ties]
        errors = [error(findings, tried), held_out(findings, best)]
        rows.append([str(len(best.stations)), named(best.stations), front, *errors, rate, *kept])
    used = [i for i in range(len(head)) if any(row[i] for row in rows)]
    lines = [[row[i] for i in used] for row in (head, *rows)]
    return aligned(lines, text_columns=used.index(3)) if rows else []


def _ranking(findings: PlacementFindings, ranking: Ranking) -> list[str]:
    title = f"{ranking.mode}: {plain_name(ranking.title)} ({MODES[ranking.mode]})"
    head = ["rank", "stations", "", findings.unit, "behind the first"]
    rows = []
    for row in ranking.rows[:_MOST_ROWS]:
        tried = findings.of(row.stations)
        behind = "" if row.rank == 1 else difference(row.difference, row.low, row.high)
        tie = "tie" if row.tied and row.rank > 1 else ""
        rank = f"{row.rank} ({ranks(row.rank_low, row.rank_high)})"
        rows.append([rank, named(row.stations), tie, figure(tried.mean if tried else None), behind])
    more = len(ranking.rows) - _MOST_ROWS
    return [title, *aligned([head, *rows], text_columns=3), *([f"and {more} more"] if more > 0 else [])]


def _search(findings: PlacementFindings, search: Search) -> list[str]:
    head = ["step", "stations", "or as well", findings.unit, "gain"]
    rows = []
    for step in search.steps:
        tried = findings.of(step.stations)
        gain = "" if step.difference is None else difference(step.difference, step.low, step.high)
        also = ", ".join(map(plain_name, step.tied))
        mean = figure(tried.mean if tried else None)
        rows.append([plain_name(step.changed) or "start", named(step.stations), also, mean, gain])
    ended = [f"ended: {search.ended}"] if search.ended else []
    ended += [held] if (held := saved(search, findings.unit)) else []
    return [
        f"{search.mode}: {plain_name(search.title)} ({MODES[search.mode]})",
        *aligned([head, *rows], text_columns=3),
        *ended,
    ]


def _worth(findings: PlacementFindings) -> list[str]:
    """What each candidate is worth in every mode."""
    ways = list(dict.fromkeys(way(findings, worth) for worth in findings.worth))
    if not ways:
        return []
    found = {(w.candidate, way(findings, w)): difference(w.difference, w.low, w.high) for w in findings.worth}
    rows = [
        [plain_name(place.name), *(found.get((place.name, one), "") for one in ways)]
        for place in findings.candidates
        if any((place.name, one) in found for one in ways)
    ]
    title = f"what each is worth [{findings.unit}]: error without it less error with it"
    return [title, *aligned([["candidate", *ways], *rows], text_columns=1)]


def _stability(findings: PlacementFindings) -> list[str]:
    """How alike conditions rank the sets, and what is best in each."""
    if not findings.conditions:
        return []
    sizes = sorted({int(size) for condition in findings.conditions for size in condition.best})
    head = ["condition", *(f"best of {size}" for size in sizes), "clips", "stays best"]
    rows = [
        [
            f"{c.kind}: {c.name}",
            *(named(c.best[str(size)]) if str(size) in c.best else "" for size in sizes),
            *(str(c.clips), share(c.stays)),
        ]
        for c in findings.conditions
    ]
    lines = ["elsewhere", *aligned([head, *rows], text_columns=1 + len(sizes))]
    for pair in findings.agreements:
        tau = "not measured" if pair.tau is None else figure(pair.tau)
        within = "" if pair.low is None else f" ({figure(pair.low)} to {figure(pair.high)})"
        lines.append(f"{pair.a} and {pair.b} rank {pair.sets} sets alike by Kendall's tau {tau}{within}")
    return lines


def _rest(findings: PlacementFindings) -> list[str]:
    lines = [textwrap.fill(f"note: {note}", WIDTH) for note in findings.notes]
    failed = list(findings.failures.items())
    lines += [f"FAILED {cell}: {(why.strip().splitlines() or [''])[-1]}" for cell, why in failed[:_MOST_FAILED]]
    return lines + ([f"and {len(failed) - _MOST_FAILED} more failed"] if len(failed) > _MOST_FAILED else [])
