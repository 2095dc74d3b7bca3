"""The page of a placement study: advice, body map and curve of errors, tied sets, then every ranking."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from harness.core.number_format import NOT_MEASURED, Interval, count_noun, format_fixed, format_share
from harness.report.kit.chart import clear_plots
from harness.report.kit.document import chart_figure
from harness.report.kit.markup import Markup, tag
from harness.report.kit.page import (
    Block,
    BrowserOnly,
    Bullets,
    Code,
    DataTable,
    Drawing,
    Page,
    Prose,
    Section,
    Stack,
    TerminalOnly,
    json_listing,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.kit.statement_lines import WIDTH
from harness.report.kit.text import describe_motion_source, last_line
from harness.report.paper.page import claims_table
from harness.report.placement.body_map import body_map
from harness.report.placement.charts import (
    contribution_chart,
    pareto_chart,
    ranking_chart,
    search_chart,
    stability_chart,
)
from harness.report.placement.error_curve import curve_points, error_curve
from harness.report.placement.set_bodies import second_method_blocks, tied_sets_blocks
from harness.report.placement.wording import (
    TIE_NOTE,
    changes_sentence,
    contribution_label,
    format_rank_range,
    headline_sentence,
    held_out_error,
    list_sets,
    original_candidates,
    placement_sentence,
    plain_name,
    power_sentences,
    ranks_by_condition,
    search_gain_sentence,
    set_error,
    set_name,
    size_sentences,
    smallest_sufficient_set,
)
from harness.results.files import FINDINGS
from harness.results.findings import (
    MODES,
    MarginalContribution,
    PlacementCondition,
    PlacementFindings,
    PlacementSearch,
    RankAgreement,
    Ranking,
    StationNames,
    read_placement,
)
from harness.results.findings.advice import HalvingRound

_MOST_PRINTED, _MOST_FAILED, _MOST_RANKED = 12, 50, 40
_LEARNT_FROM = {
    "": "",
    "known": "other takes of the performers on whom sets are tested",
    "new": "other performers than those on whom sets are tested",
}
"""Split -> what methods learnt from."""


def write_placement_page(folder: Path) -> Path:
    """Write FOLDER/plots and FOLDER/report.html of the study in `folder`; returns the path of the page.

    BadFile if there are no findings.
    """
    findings = read_placement(folder / FINDINGS)
    plots = clear_plots(folder)
    pictures = [body_map(findings, recommended_set(findings)), *filter(None, [error_curve(findings)])]
    for picture in pictures:
        picture.write(plots)
    widths = ("42rem", "30rem")
    figures = [tag("div", chart_figure(c), style=f"max-width: {w}") for c, w in zip(pictures, widths, strict=False)]
    overview = tag("div", *figures, class_="overview" if len(figures) > 1 else None)
    return write_page(placement_page(findings, overview), folder / "report.html", plots)


def recommended_set(findings: PlacementFindings) -> StationNames:
    """The set that the study recommends; () where nothing was measured."""
    best = findings.advice.best if findings.advice else smallest_sufficient_set(findings)
    return best.stations if best else ()


def placement_text(findings: PlacementFindings) -> str:
    """The page for a terminal."""
    return render_text(placement_page(findings), WIDTH)


def placement_page(findings: PlacementFindings, overview: Markup | None = None) -> Page:
    """The page of a study, with the pictures of its first screen."""
    counts = f"{len(original_candidates(findings))} candidates, {len(findings.tried):,} sets of them"
    ways: dict[tuple[str, tuple[str, ...]], list[MarginalContribution]] = {}
    for contribution in findings.contributions:
        ways.setdefault((contribution.mode, contribution.base), []).append(contribution)
    measured = [rows for rows in ways.values() if any(row.difference is not None for row in rows)]
    drawings = [Drawing(partial(contribution_chart, findings, rows, n)) for n, rows in enumerate(measured, start=1)]
    several = len(findings.conditions) > 1
    headline, answer = headline_sentence(findings), placement_sentence(findings)
    rest = answer.removeprefix(headline).strip()
    recommended, second = recommended_set(findings), second_method_blocks(findings)
    disputed = findings.second is not None and any(
        choice.worse and choice.chosen == recommended for choice in findings.second.choices
    )
    return Page(
        verb="placement",
        name=findings.name,
        headline=headline,
        lead=[
            *([Prose(rest)] if rest else []),
            *(second if disputed else []),
            BrowserOnly([overview or Markup()]),
            Bullets(size_sentences(findings)),
            _best_table(findings),
        ],
        facts={
            "Question": findings.title,
            "Metric": f"{findings.metric} [{findings.unit}], {findings.better} is better",
            "Methods": ", ".join(findings.methods),
            "Motion": f"{', '.join(findings.behaviours)}; {describe_motion_source(findings.motion)}",
            "Noise": findings.noise,
            "Link": findings.link or "the same rate for any number of stations",
            "Worn in any case": set_name(findings.base) if findings.base else "",
            "Costs": ", ".join(f"{plain_name(name)} {cost:g}" for name, cost in findings.station_costs.items()),
            "Learnt from": _LEARNT_FROM[findings.split],
            "Search": search_text(findings),
            "Clips": " ".join(power_sentences(findings.power)) if findings.power else "",
            "Tried": f"{counts}; {findings.planned:,} cells, {len(findings.failures)} failed",
            "Ties": TIE_NOTE,
            "Made by": f"{findings.command} (seed {findings.seed})",
        },
        sections=[
            Section("Tied sets", "ties", tied_sets_blocks(findings, recommended)),
            Section("Second method", "second", [] if disputed else second),
            Section("Sizes compared", "sizes", [_steps_table(findings)]),
            Section("Number of stations", "pareto", [Drawing(partial(pareto_chart, findings))]),
            Section("Published statements", "claims", [claims_table(findings.claims)]),
            Section("Rankings", "rankings", _rankings(findings)),
            Section("Contribution of each candidate", "worth", [*drawings, _contribution_table(findings)]),
            Section("Searches", "paths", [_search(findings, search) for search in findings.searches]),
            Section(
                "Stability of the ranking",
                "stability",
                [*([Drawing(partial(stability_chart, findings))] if several else []), *_conditions(findings)],
            ),
            Section("Further results", "notes", [Bullets(findings.notes, prefix="note: ")]),
            Section("Candidates", "candidates", [_candidates_table(findings)], terminal=False),
            Section("Failed cells", "failures", _failures(findings)),
            Section("Circumstances", "circumstances", _circumstances(findings), terminal=False),
        ],
    )


def search_text(findings: PlacementFindings) -> str:
    """The rounds of a search by halves: "a quick search; 2 stations: 28 sets on 4 units, 14 on 8"; "" without one."""
    by_size: dict[int, list[HalvingRound]] = {}
    for each in findings.rounds:
        by_size.setdefault(each.size, []).append(each)
    rounds = [
        f"{count_noun(size, 'station')}: {of[0].sets:,} sets on {count_noun(of[0].units, 'unit')}"
        + "".join(f", {each.sets:,} on {each.units}" for each in of[1:])
        for size, of in by_size.items()
    ]
    return "; ".join([*([f"a {findings.effort} search"] if findings.effort else []), *rounds])


def _best_table(findings: PlacementFindings) -> DataTable:
    """The best set of each size."""
    held_out = any(best.held_out is not None for best in findings.best)
    validated = not held_out and any(best.cross_validated_error is not None for best in findings.best)
    rows = []
    beaten = [point.stations for point in curve_points(findings) if not point.on_front]
    for best in findings.best:
        tried = findings.of(best.stations)
        rows.append(
            [
                len(best.stations),
                Stack(set_name(best.stations), "a smaller set errs less" if best.stations in beaten else ""),
                set_error(findings, tried),
                *([held_out_error(findings, best)] if held_out else []),
                *([Interval.of(best.cross_validated_error, None, None, findings.unit)] if validated else []),
                f"{tried.rate_hz:g} Hz" if tried else "",
                Stack(
                    best.of or "", f"stays best in {format_share(share)}" if (share := best.selection_stability) else ""
                ),
                list_sets(best.ties, 1) if best.ties else "none",
            ]
        )
    caption = (
        "The best set of each size and its mean error with the 95 % interval over units of statistics. "
        + ("Held out: the error on clips that did not take part in the choice. " if held_out else "")
        + ("Cross-validated: of each unit, the error of the set that the other units choose. " if validated else "")
        + "Best of: the number of sets of this size, and in how many resamples of the units the set stays best. "
        "Ties: other sets of this size that are as good."
    )
    head = [
        "stations",
        "best set",
        "error",
        *(["held out"] if held_out else []),
        *(["cross-validated"] if validated else []),
        "rate",
        "best of",
        "ties",
    ]
    return DataTable(head, rows, caption=caption, label="best sets")


def _steps_table(findings: PlacementFindings) -> DataTable:
    """Each two of the best sets of the asked sizes, compared on held-out units."""
    rows = [
        [
            set_name(step.larger),
            set_name(step.smaller),
            Interval.of(step.difference, step.low, step.high, signed=True),
            step.verdict,
            step.units,
        ]
        for step in findings.size_steps
    ]
    caption = "Positive: the larger set errs less. Paired over units; the verdict is corrected for all pairs of sizes."
    head = ["larger set", "against", f"gain [{findings.unit}]", "larger set is", "units"]
    return DataTable(head, rows, caption=caption, label="sizes compared")


def _rankings(findings: PlacementFindings) -> list[Block]:
    shown = [ranking for ranking in findings.rankings if len(ranking.rows) > 1]
    return [
        Drawing(partial(ranking_chart, findings, ranking, n), _ranking_table(findings, ranking))
        for n, ranking in enumerate(shown, start=1)
    ]


def _ranking_table(findings: PlacementFindings, ranking: Ranking) -> DataTable:
    rows = [
        [
            row.rank,
            set_name(row.stations),
            format_rank_range(row.rank_low, row.rank_high),
            "tie" if row.tied and row.rank > 1 else "",
            set_error(findings, findings.of(row.stations)),
            "" if row.rank == 1 else Interval.of(row.difference, row.low, row.high, signed=True),
            "" if row.step is None else Interval.of(row.step, row.step_low, row.step_high, signed=True),
        ]
        for row in ranking.rows
    ]
    head = [
        *("rank", "stations", "possible ranks", "tie", "error"),
        *(f"difference to the first [{findings.unit}]", "difference to the previous"),
    ]
    title = f"{ranking.mode}: {plain_name(ranking.title)} ({MODES[ranking.mode]})"
    return DataTable(head, rows, title, most_printed=_MOST_PRINTED)


def _contribution_table(findings: PlacementFindings) -> DataTable:
    """The contribution of each candidate, a column for each way in which it was measured."""
    labels = list(dict.fromkeys(contribution_label(findings, contribution) for contribution in findings.contributions))
    found = {
        (w.candidate, contribution_label(findings, w)): Interval.of(w.difference, w.low, w.high, signed=True)
        for w in findings.contributions
    }
    rows = [
        [plain_name(place.name), *(found.get((place.name, label), "") for label in labels)]
        for place in findings.candidates
        if any((place.name, label) in found for label in labels)
    ]
    caption = f"Error without the station minus error with it [{findings.unit}], with 95 % intervals over units."
    return DataTable(["candidate", *labels], rows, caption=caption, label="worth", fold="Numbers of these charts")


def _search(findings: PlacementFindings, search: PlacementSearch) -> Block:
    """The steps of a search; a chart if there is more than one."""
    rows = [
        [
            plain_name(step.changed) or "start",
            set_name(step.stations),
            set_error(findings, findings.of(step.stations)),
            "" if step.difference is None else Interval.of(step.difference, step.low, step.high, signed=True),
            ", ".join(map(plain_name, step.tied)) or "none",
        ]
        for step in search.steps
    ]
    notes = [f"Ended: {search.ended}."] if search.ended else []
    notes += [f"{gain}."] if (gain := search_gain_sentence(search, findings.unit)) else []
    title = f"{search.mode}: {plain_name(search.title)} ({MODES[search.mode]}). {' '.join(notes)}".rstrip()
    table = DataTable(["step", "stations", "error", f"gain [{findings.unit}]", "tied steps"], rows, title)
    fold = f"Numbers of {search.mode}: {plain_name(search.title)}"
    return Drawing(partial(search_chart, findings, search), table, fold) if len(search.steps) > 1 else table


def _conditions(findings: PlacementFindings) -> list[Block]:
    """The best set of each size under each condition, and the agreement of each pair of conditions."""
    if not findings.conditions:
        return []
    sizes = sorted({int(size) for condition in findings.conditions for size in condition.best})
    rows = [
        [
            Stack(c.name, f"{c.kind}, {count_noun(c.clips, 'unit')}{_stability_note(c)}"),
            *(set_name(c.best[str(size)]) if str(size) in c.best else "" for size in sizes),
        ]
        for c in findings.conditions
    ]
    head = ["condition", *(count_noun(n, "station") for n in sizes)]
    own = findings.conditions[0].name
    printed = [pair for pair in findings.agreements if own in (pair.a, pair.b)]
    more = len(findings.agreements) - len(printed)
    note = [Prose(f"Pairs of conditions that are on the page alone: {more}.")] if more else []
    return [
        DataTable(head, rows, caption="The best set of each size.", label="elsewhere"),
        _ranks_table(findings),
        BrowserOnly([_agreement_table(findings, findings.agreements)], "All pairs of conditions"),
        TerminalOnly([_agreement_table(findings, printed), *note]),
    ]


def _agreement_table(findings: PlacementFindings, pairs: Sequence[RankAgreement]) -> DataTable:
    rows = [
        [
            f"{pair.a} and {pair.b}",
            Interval.of(pair.tau, pair.low, pair.high),
            f"{pair.sets:,}",
            changes_sentence(findings, pair),
        ]
        for pair in pairs
    ]
    caption = (
        "A change of order is significant if the change of the difference between the two sets is: sign flips over "
        "units, corrected for all pairs of sets (Holm 1979)."
    )
    return DataTable(["pair", "Kendall's tau", "sets", "changes of order"], rows, caption=caption, label="agreement")


def _ranks_table(findings: PlacementFindings) -> DataTable:
    """The rank of each compared set under each condition."""
    rows = [
        [set_name(names), *(NOT_MEASURED if rank is None else rank for rank in ranks)]
        for names, ranks in ranks_by_condition(findings, _MOST_RANKED)
    ]
    caption = "Rank of each set by its mean error under each condition."
    head = ["rank of the set under each condition", *(condition.name for condition in findings.conditions)]
    return DataTable(
        head,
        rows,
        caption=caption,
        label="ranks",
        most_printed=_MOST_PRINTED,
        omitted=len(findings.compared) - len(rows),
    )


def _stability_note(condition: PlacementCondition) -> str:
    if condition.selection_stability is None:
        return ""
    return f"; the best set stays best in {format_share(condition.selection_stability)} of resamples"


def _candidates_table(findings: PlacementFindings) -> DataTable:
    rows = [
        [
            *(plain_name(place.name), place.bone, format_fixed(place.along, 2), format_fixed(place.around_deg, 0)),
            *(format_fixed(1e3 * place.stand_off_m, 0), place.side, plain_name(place.moved_from)),
        ]
        for place in findings.candidates
    ]
    head = ["candidate", "bone", "along", "around [deg]", "off the skin [mm]", "side", "moved from"]
    caption = "Along: from 0 at the bone's joint to 1 at its far end. Around: see `harness.body.mounts`."
    return DataTable(head, rows, caption=caption, label="candidates", fold=f"All {count_noun(len(rows), 'candidate')}")


def _failures(findings: PlacementFindings) -> list[Block]:
    shown = list(findings.failures.items())[:_MOST_FAILED]
    more = len(findings.failures) - len(shown)
    return [
        Bullets([f"{cell}: {last_line(why)}" for cell, why in shown], prefix="FAILED "),
        *(Code(why, f"Message of {cell}") for cell, why in shown),
        *([Prose(f"And {more:,} more.")] if more else []),
    ]


def _circumstances(findings: PlacementFindings) -> list[Block]:
    versions = findings.circumstances
    more = [json_listing(versions, "All versions and circumstances")] if versions else []
    return [Code(findings.command), *more]
