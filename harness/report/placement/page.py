"""The page of a placement study: recommended set, body map, error by number of stations, then every ranking."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from harness.core.files import to_json_types
from harness.core.number_format import count_noun, format_fixed
from harness.core.text_table import Table
from harness.report.kit.document import Section, chart_figure, document
from harness.report.kit.markup import Markup, bullet_list, details, inline_code, join, tag
from harness.report.kit.style import Chart
from harness.report.kit.table import NOT_MEASURED_CELL, html_table, stacked_cell
from harness.report.kit.text import describe_motion_source, last_line
from harness.report.paper.claims import claims_list
from harness.report.placement.wording import (
    TIE_NOTE,
    changes_sentence,
    format_difference,
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
from harness.results.placement_findings import (
    MODES,
    BestSet,
    PlacementCondition,
    PlacementFindings,
    PlacementSearch,
    Ranking,
    StationSetResult,
)

_MOST_FAILED, _MOST_RANKED = 50, 40


@dataclass(frozen=True)
class PlacementContent:
    """Everything that the page of a placement study shows."""

    findings: PlacementFindings
    charts: Mapping[str, Sequence[Chart]]
    """Section -> its charts (see `placement.charts.charts`, and "body"); empty without matplotlib."""
    missing: Sequence[str]
    """Parts that are not on the page, and why."""


def placement_page(content: PlacementContent) -> str:
    """The HTML of the page."""
    findings = content.findings
    counts = f"{len(original_candidates(findings))} candidates, {len(findings.tried):,} sets of them"
    facts = {
        "Question": findings.title,
        "Metric": f"{findings.metric} [{findings.unit}], {findings.better} is better",
        "Methods": ", ".join(findings.methods),
        "Motion": f"{', '.join(findings.behaviours)}; {describe_motion_source(findings.motion)}",
        "Noise": findings.noise,
        "Link": findings.link or "the same rate for any number of stations",
        **({"Clips": " ".join(power_sentences(findings.power))} if findings.power else {}),
        "Tried": f"{counts}; {findings.planned:,} cells, {len(findings.failures)} failed",
        "Made by": f"{findings.command} (seed {findings.seed})",
    }
    sections: list[Section] = [
        ("Body map", "body", _chart_figures(content, "body")),
        ("Number of stations", "pareto", _chart_figures(content, "pareto")),
        ("Published statements", "claims", claims_list(findings.claims)),
        ("Rankings", "rankings", _rankings(content)),
        ("Contribution of each candidate", "worth", join(_chart_figures(content, "worth"), _worth(findings))),
        (
            "Searches",
            "paths",
            join(_chart_figures(content, "paths"), *map(partial(_search_table, findings), findings.searches)),
        ),
        ("Stability of the ranking", "stability", join(_chart_figures(content, "stability"), _conditions(findings))),
        ("Further results", "notes", _notes(findings)),
        ("Candidates", "candidates", _candidates(findings)),
        ("Failed cells", "failures", _failures(findings)),
        ("Circumstances", "circumstances", _circumstances(findings)),
    ]
    return document(
        title=f"{findings.name}: harness placement",
        kicker=f"harness placement · {findings.name}",
        heading=sentence(findings),
        facts=facts,
        missing=content.missing,
        sections=sections,
        lead=_best(findings),
    )


def _chart_figures(content: PlacementContent, section: str) -> Markup:
    charts = content.charts.get(section, ())
    return join(*(chart_figure(chart, 3 if len(charts) > 1 else 0) for chart in charts))


def _best(findings: PlacementFindings) -> Markup | None:
    """The best set of each size."""
    if not findings.best:
        return None
    has_held_out = any(best.held_out is not None for best in findings.best)
    rows = []
    for best in findings.best:
        tried = findings.of(best.stations)
        name = (
            set_name(best.stations)
            if best.on_front
            else join(set_name(best.stations), tag("small", "a smaller set is better"))
        )
        stays = f"stays best in {format_stays(best.stays)}" if best.stays else ""
        held_out = [_held_out(findings, best)] if has_held_out else []
        rate, of = f"{tried.rate_hz:g} Hz" if tried else "", stacked_cell(best.of or "", stays)
        ties = _text_cell(list_sets(best.ties) if best.ties else "none")
        rows.append([len(best.stations), _text_cell(name), _error(findings, tried), *held_out, rate, of, ties])
    caption = (
        "The best set of each size and its mean error with the 95 % interval over units of statistics. "
        + ("Held out: the error on clips that did not take part in the choice. " if has_held_out else "")
        + "Best of: the number of sets of this size, and in how many resamples of the units the set stays best. "
        f"Ties: other sets of this size that are as good. {TIE_NOTE}"
    )
    head = ["stations", _text_cell("best set"), "error", *(["held out"] if has_held_out else []), "rate", "best of"]
    return html_table(Table([*head, _text_cell("ties")], rows), caption, label="best sets")


def _held_out(findings: PlacementFindings, best: BestSet) -> Markup:
    """The mean on held-out clips, and its interval below."""
    return _mean_cell(findings, best.held_out, best.held_out_low, best.held_out_high)


def _error(findings: PlacementFindings, tried: StationSetResult | None) -> Markup:
    """The mean of a set, and its interval below."""
    return _mean_cell(findings, tried.mean, tried.low, tried.high) if tried else NOT_MEASURED_CELL


def _mean_cell(findings: PlacementFindings, mean: float | None, low: float | None, high: float | None) -> Markup:
    if mean is None:
        return NOT_MEASURED_CELL
    return stacked_cell(f"{format_value(mean)} {findings.unit}".rstrip(), format_value_interval(low, high))


def _rankings(content: PlacementContent) -> Markup:
    """Each ranking as a chart with its numbers folded, or the numbers alone."""
    findings = content.findings
    charts = list(content.charts.get("rankings", ()))
    shown = [ranking for ranking in findings.rankings if len(ranking.rows) > 1]
    parts = []
    for n, ranking in enumerate(shown):
        numbers = _ranking(findings, ranking)
        has_chart = n < len(charts)
        parts.append(
            join(chart_figure(charts[n], 3), details("Numbers of this chart", numbers)) if has_chart else numbers
        )
    return join(*parts)


def _ranking(findings: PlacementFindings, ranking: Ranking) -> Markup:
    rows = []
    for row in ranking.rows:
        tried = findings.of(row.stations)
        difference = "" if row.rank == 1 else format_difference(row.difference, row.low, row.high)
        tie = "tie" if row.tied and row.rank > 1 else ""
        name = _text_cell(set_name(row.stations))
        step = "" if row.rank == 1 or row.step is None else format_difference(row.step, row.step_low, row.step_high)
        rank = format_rank_range(row.rank_low, row.rank_high)
        rows.append([row.rank, name, rank, tie, _error(findings, tried), difference, step])
    caption = join(tag("b", f"{ranking.mode}: {plain_name(ranking.title)}"), f" ({MODES[ranking.mode]}).")
    head = [
        "rank",
        _text_cell("stations"),
        "possible ranks",
        "",
        "error",
        f"difference to the first [{findings.unit}]",
        "difference to the previous",
    ]
    return html_table(Table(head, rows), caption, label=f"{ranking.mode}: {ranking.title}")


def _worth(findings: PlacementFindings) -> Markup | None:
    """The contribution of each candidate, a column for each way in which it was measured."""
    labels = list(dict.fromkeys(worth_label(findings, worth) for worth in findings.worth))
    if not labels:
        return None
    differences = {
        (w.candidate, worth_label(findings, w)): format_difference(w.difference, w.low, w.high) for w in findings.worth
    }
    rows = [
        [plain_name(place.name), *(differences.get((place.name, label), "") for label in labels)]
        for place in findings.candidates
        if any((place.name, label) in differences for label in labels)
    ]
    table = Table(["candidate", *map(_text_cell, labels)], rows)
    caption = f"Error without the station minus error with it [{findings.unit}], with 95 % intervals over units."
    return details("Numbers of these charts", html_table(table, caption, label="worth"))


def _search_table(findings: PlacementFindings, search: PlacementSearch) -> Markup:
    rows = []
    for step in search.steps:
        gain = "" if step.difference is None else format_difference(step.difference, step.low, step.high)
        ties = _text_cell(", ".join(map(plain_name, step.tied)) or "none")
        error = _error(findings, findings.of(step.stations))
        rows.append([plain_name(step.changed) or "start", _text_cell(set_name(step.stations)), error, gain, ties])
    head = ["step", _text_cell("stations"), "error", f"gain [{findings.unit}]", _text_cell("tied steps")]
    notes = f" Ended: {search.ended}." if search.ended else ""
    notes += f" {held_out}." if (held_out := search_gain_sentence(search, findings.unit)) else ""
    title = f"{search.mode}: {plain_name(search.title)}"
    caption = join(tag("b", title), f" ({MODES[search.mode]}).{notes}")
    return details(f"Numbers of {title}", html_table(Table(head, rows), caption, label=f"{search.mode} {search.title}"))


def _conditions(findings: PlacementFindings) -> Markup:
    """The best set of each size under each condition, and the agreement of each pair of conditions."""
    if not findings.conditions:
        return Markup()
    sizes = sorted({int(size) for condition in findings.conditions for size in condition.best})
    rows = [
        [
            join(c.name, tag("small", f"{c.kind}, {count_noun(c.clips, 'unit')}{_stability_note(c)}")),
            *(_text_cell(set_name(c.best[str(size)])) if str(size) in c.best else "" for size in sizes),
        ]
        for c in findings.conditions
    ]
    head = ["condition", *(_text_cell(count_noun(n, "station")) for n in sizes)]
    best = html_table(Table(head, rows), "The best set of each size.", label="elsewhere")
    pairs = [
        [
            _text_cell(f"{pair.a} and {pair.b}"),
            *(format_value(pair.tau), format_value_interval(pair.low, pair.high), f"{pair.sets:,}"),
            _text_cell(changes_sentence(findings, pair)),
        ]
        for pair in findings.agreements
    ]
    head = [_text_cell("pair"), "Kendall's tau", "95 % interval", "sets", _text_cell("changes of order")]
    caption = (
        "A change of order is significant if the change of the difference between the two sets is: sign flips over "
        "clips, corrected for all pairs of sets (Holm 1979)."
    )
    agreement = html_table(Table(head, pairs), caption, label="agreement")
    ranks = _ranks(findings)
    return join(best, ranks, details("All pairs of conditions", agreement) if pairs else None)


def _ranks(findings: PlacementFindings) -> Markup | None:
    """The rank of each compared set under each condition."""
    rows = [
        [_text_cell(set_name(names)), *(NOT_MEASURED_CELL if rank is None else rank for rank in ranks)]
        for names, ranks in ranks_by_condition(findings, _MOST_RANKED)
    ]
    if not rows:
        return None
    head = [_text_cell("stations"), *(condition.name for condition in findings.conditions)]
    more = len(findings.compared) - len(rows)
    caption = "Rank of each set by its mean error under each condition." + (f" {more:,} more sets." if more else "")
    return html_table(Table(head, rows), caption, label="ranks")


def _stability_note(condition: PlacementCondition) -> str:
    if condition.stays is None:
        return ""
    return f"; the best set stays best in {format_stays(condition.stays)} of resamples"


def _notes(findings: PlacementFindings) -> Markup:
    return bullet_list([inline_code(note) for note in findings.notes])


def _candidates(findings: PlacementFindings) -> Markup:
    rows = []
    for place in findings.candidates:
        along, off = format_fixed(place.along, 2), format_fixed(1e3 * place.stand_off_m, 0)
        moved = plain_name(place.moved_from)
        rows.append(
            [plain_name(place.name), place.bone, along, format_fixed(place.around_deg, 0), off, place.side, moved]
        )
    head = ["candidate", "bone", "along", "around [deg]", "off the skin [mm]", "side", "moved from"]
    caption = "Along: from 0 at the bone's joint to 1 at its far end. Around: see `harness.body.mounts`."
    table = html_table(Table(head, rows), inline_code(caption), label="candidates")
    return details(f"All {count_noun(len(rows), 'candidate')}", table)


def _failures(findings: PlacementFindings) -> Markup:
    if not findings.failures:
        return Markup()
    shown = list(findings.failures.items())[:_MOST_FAILED]
    items = [join(tag("b", cell), details(last_line(why), tag("pre", why))) for cell, why in shown]
    more = len(findings.failures) - len(shown)
    return join(bullet_list(items), tag("p", f"And {more:,} more.") if more else None)


def _circumstances(findings: PlacementFindings) -> Markup:
    text = json.dumps(to_json_types(findings.circumstances), indent=2, ensure_ascii=False)
    return join(
        tag("pre", tag("code", findings.command)),
        details("All versions and circumstances", tag("pre", text)) if findings.circumstances else None,
    )


def _text_cell(text: Any) -> Markup:
    """A cell that is aligned left and wraps."""
    return tag("span", text, class_="words", style="min-width: 9em; max-width: 24em")
