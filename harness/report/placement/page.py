"""The page of a placement study: advice, body map and curve of errors, tied sets, then every ranking."""

from functools import partial
from pathlib import Path

from harness.core.number_format import count_noun
from harness.report.kit.chart import clear_plots
from harness.report.kit.document import chart_figure
from harness.report.kit.markup import Markup, tag
from harness.report.kit.page import (
    Block,
    BrowserOnly,
    Bullets,
    Code,
    Drawing,
    Page,
    Prose,
    Section,
    json_listing,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.kit.statement_lines import WIDTH
from harness.report.kit.text import describe_motion_source, last_line
from harness.report.paper.page import claims_table
from harness.report.placement.answer import headline_sentence, placement_sentence, recommended_set
from harness.report.placement.body_map import body_map
from harness.report.placement.charts import contribution_chart, pareto_chart
from harness.report.placement.conditions import condition_blocks
from harness.report.placement.error_curve import error_curve
from harness.report.placement.power_wording import power_sentences
from harness.report.placement.question_answer import disputed_choice, size_sentences
from harness.report.placement.set_bodies import second_method_blocks, tied_sets_blocks
from harness.report.placement.tables import (
    best_table,
    candidates_table,
    contribution_table,
    ranking_blocks,
    search_block,
    steps_table,
)
from harness.report.placement.wording import TIE_NOTE, original_candidates, plain_name, set_name
from harness.results.files import FINDINGS
from harness.results.findings import MarginalContribution, PlacementFindings, read_placement
from harness.results.findings.advice import HalvingRound

_MOST_FAILED = 50
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
    headline, answer = headline_sentence(findings), placement_sentence(findings)
    rest = answer.removeprefix(headline).strip()
    second, disputed = second_method_blocks(findings), disputed_choice(findings) is not None
    return Page(
        verb="placement",
        name=findings.name,
        headline=headline,
        lead=[
            *([Prose(rest)] if rest else []),
            *(second if disputed else []),
            BrowserOnly([overview or Markup()]),
            Bullets(size_sentences(findings)),
            best_table(findings),
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
            Section("Tied sets", "ties", tied_sets_blocks(findings, recommended_set(findings))),
            Section("Second method", "second", [] if disputed else second),
            Section("Sizes compared", "sizes", [steps_table(findings)]),
            Section("Number of stations", "pareto", [Drawing(partial(pareto_chart, findings))]),
            Section("Published statements", "claims", [claims_table(findings.claims)]),
            Section("Rankings", "rankings", ranking_blocks(findings)),
            Section("Contribution of each candidate", "worth", [*drawings, contribution_table(findings)]),
            Section("Searches", "paths", [search_block(findings, search) for search in findings.searches]),
            Section("Stability of the ranking", "stability", condition_blocks(findings)),
            Section("Further results", "notes", [Bullets(findings.notes, prefix="note: ")]),
            Section("Candidates", "candidates", [candidates_table(findings)], terminal=False),
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
        f"{count_noun(size, 'station')}: {count_noun(of[0].sets, 'set')} on {count_noun(of[0].units, 'unit')}"
        + "".join(f", {each.sets:,} on {each.units}" for each in of[1:])
        for size, of in by_size.items()
    ]
    return "; ".join([*([f"a {findings.effort} search"] if findings.effort else []), *rounds])


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
