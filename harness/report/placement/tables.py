"""Tables of a placement page: best sets, sizes compared, rankings, contributions, searches and candidates."""

from functools import partial

from harness.core.number_format import Interval, count_noun, format_fixed, format_share
from harness.report.kit.page import Block, DataTable, Drawing, Stack
from harness.report.placement.charts import ranking_chart, search_chart
from harness.report.placement.error_curve import curve_points
from harness.report.placement.wording import (
    contribution_label,
    format_rank_range,
    held_out_error,
    list_sets,
    plain_name,
    search_gain_sentence,
    set_error,
    set_name,
)
from harness.results.findings import MODES, PlacementFindings, PlacementSearch, Ranking

MOST_PRINTED = 12
"""Most rows of a table on the terminal."""


def best_table(findings: PlacementFindings) -> DataTable:
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


def steps_table(findings: PlacementFindings) -> DataTable:
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


def ranking_blocks(findings: PlacementFindings) -> list[Block]:
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
    return DataTable(head, rows, title, most_printed=MOST_PRINTED)


def contribution_table(findings: PlacementFindings) -> DataTable:
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


def search_block(findings: PlacementFindings, search: PlacementSearch) -> Block:
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


def candidates_table(findings: PlacementFindings) -> DataTable:
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
