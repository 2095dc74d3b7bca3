"""Charts of a placement study: error by number of stations, rankings with ties, contributions, searches, stability."""

import itertools
from collections.abc import Sequence

import numpy as np

from harness.core.number_format import Interval
from harness.report.kit.axes import label_rows
from harness.report.kit.chart import draw_chart
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Chart, Figure, hide_frame
from harness.report.kit.text import list_first, to_file_name
from harness.report.placement.contribution_significance import SIGNIFICANCE_NOTE, significant_candidates
from harness.report.placement.pareto import draw_pareto, mean_or_nan, measured_best
from harness.report.placement.wording import (
    TIE_NOTE,
    contribution_label,
    format_rank_range,
    plain_name,
    search_gain_sentence,
    set_error,
    set_name,
)
from harness.results.findings import MarginalContribution, PlacementFindings, PlacementSearch, Ranking

_BEST, _OTHER = COLOURS[1], COLOURS[0]
_WIDTH_IN, _ROW_IN, _FRAME_IN, _MOST_ROWS = 7.4, 0.24, 0.9, 20
"""Width of a chart, heights of a row and of the frame [in]; most rows of a ranking."""


def pareto_chart(findings: PlacementFindings) -> Chart | None:
    """Error against the number of stations: every set as a point, the best of each size joined, ties circled.

    None without a measured set.
    """
    best = measured_best(findings)
    if not best:
        return None
    rates = {t.rate_hz for t in findings.tried}
    rate = f" Below each number: the rate that the link can carry ({findings.link})." if len(rates) > 1 else ""
    values = "; ".join(f"{len(b.stations)}: {set_name(b.stations)}, {set_error(findings, t)}" for b, t in best)
    return draw_chart(
        "pareto",
        "Error against the number of stations",
        "Grey: every set that was tried. Blue: the best set of each size with the 95 % interval of its mean; filled if "
        f"no smaller set is better. Circles: sets tied with it.{rate}",
        f"Error against the number of stations; the best set of each size is {values}.",
        lambda figure: draw_pareto(figure, findings, f"{findings.metric} [{findings.unit}]"),
        4.2,
        width_in=_WIDTH_IN,
        raster=True,
    )


def ranking_chart(findings: PlacementFindings, ranking: Ranking, number: int) -> Chart:
    """Paired difference of each set to the first one, and the ranks that remain possible."""
    rows = ranking.rows[:_MOST_ROWS]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        axes.axvline(0.0, color=INK, linewidth=0.8)
        for y, row in enumerate(rows):
            if row.difference is None:
                continue
            colour = _BEST if row.tied else FAINT
            if row.low is not None and row.high is not None:
                axes.hlines(y, row.low, row.high, color=colour, linewidth=1.6)
            axes.plot(row.difference, y, "o", color=colour, markersize=6.0)
            axes.annotate(
                format_rank_range(row.rank_low, row.rank_high),
                (1.01, y),
                xycoords=("axes fraction", "data"),
                va="center",
                color=INK if row.tied else FAINT,
                annotation_clip=False,
            )
        axes.annotate("ranks", (1.01, 1.0), (0, 4), "axes fraction", "offset points", color=FAINT)
        label_rows(axes, [set_name(row.stations) for row in rows])
        axes.margins(x=0.06)
        axes.set_xlabel(f"difference to the first [{findings.unit}], paired over units")

    more = f" Shown: the first {len(rows)} of {len(ranking.rows)}." if len(rows) < len(ranking.rows) else ""
    first, ties = ranking.rows[0], sum(row.tied for row in ranking.rows) - 1
    return draw_chart(
        f"ranking_{number}_{to_file_name(ranking.mode)}",
        f"{ranking.mode}: {plain_name(ranking.title)}",
        f"Mean paired difference to the first set with its 95 % interval. Blue: tied sets. {TIE_NOTE} Right: the ranks "
        f"that remain possible.{more}",
        f"{ranking.title}: {set_name(first.stations)} is first, {ties} sets are tied with it.",
        draw,
        _FRAME_IN + _ROW_IN * len(rows),
        width_in=_WIDTH_IN,
    )


def contribution_chart(findings: PlacementFindings, shown: Sequence[MarginalContribution], number: int) -> Chart:
    """The contribution of each candidate in one mode, the largest first."""
    rows = sorted((w for w in shown if w.difference is not None), key=lambda w: -(w.difference or 0.0))[:40]
    title, told = contribution_label(findings, shown[0]), significant_candidates(shown)

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for y, row in enumerate(rows):
            significant = row.candidate in told
            colour = _BEST if significant and (row.difference or 0.0) > 0.0 else _OTHER if significant else FAINT
            axes.barh(y, row.difference or 0.0, 0.62, color=colour, alpha=0.85 if significant else 0.55)
            if row.low is not None and row.high is not None:
                axes.hlines(y, row.low, row.high, color=INK, linewidth=1.2)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        label_rows(axes, [plain_name(row.candidate) for row in rows])
        axes.margins(x=0.06)
        axes.set_xlabel(f"error without it minus error with it [{findings.unit}]")

    gains = [Interval.of(row.difference, None, None, signed=True).number for row in rows]
    values = ", ".join(f"{plain_name(row.candidate)} {gain}" for row, gain in zip(rows, gains, strict=True))
    return draw_chart(
        f"worth_{number}_{to_file_name(shown[0].mode)}",
        f"{title[0].upper()}{title[1:]}",
        f"Blue: sets with the station err less; orange: they err more. {SIGNIFICANCE_NOTE} "
        "Whiskers: 95 % interval over units, not corrected.",
        f"Contribution of candidates, {title}: {values}.",
        draw,
        _FRAME_IN + _ROW_IN * len(rows),
        width_in=_WIDTH_IN,
    )


def search_chart(findings: PlacementFindings, search: PlacementSearch) -> Chart:
    """The error after each step of a search, and what the step changed."""
    steps = [(step, findings.of(step.stations)) for step in search.steps]
    measured = [(step, tried) for step, tried in steps if tried and tried.mean is not None]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        means = [mean_or_nan(tried) for _, tried in measured]
        axes.plot(means, range(len(measured)), color=_BEST, linewidth=1.2, alpha=0.6)
        for n, (step, tried) in enumerate(measured):
            significant = step.low is not None and step.low > 0.0
            if tried.low is not None and tried.high is not None:
                axes.hlines(n, tried.low, tried.high, color=FAINT, linewidth=1.0)
            face = _BEST if significant or not step.changed else PAPER
            axes.plot(mean_or_nan(tried), n, "o", color=face, markeredgecolor=_BEST, markersize=6.5, zorder=3)
        label_rows(axes, [_step_label(step.changed, step.tied) or "start" for step, _ in measured])
        axes.margins(x=0.06)
        axes.set_xlabel(f"{findings.metric} [{findings.unit}]")

    values = "; ".join(f"{step.changed or 'start'}: {set_error(findings, tried).number}" for step, tried in measured)
    notes = f" Ended: {search.ended}." if search.ended else ""
    notes += f" {gain}." if (gain := search_gain_sentence(search, findings.unit)) else ""
    return draw_chart(
        f"path_{to_file_name(search.mode)}_{to_file_name(search.title)}",
        f"{search.mode}: {plain_name(search.title)}",
        "One row for each step, from the top: the change, with tied changes in brackets. Filled: the paired 95 % "
        f"interval of the improvement excludes zero. Grey lines: interval of the mean.{notes}",
        f"{search.mode}, {search.title}: {values}.",
        draw,
        _FRAME_IN + 1.3 * _ROW_IN * len(measured),
        width_in=_WIDTH_IN,
    )


def _step_label(changed: str, ties: Sequence[str]) -> str:
    others = list_first(list(map(plain_name, ties)), 2)
    return plain_name(changed) + (f" (or {others})" if others else "")


def stability_chart(findings: PlacementFindings) -> Chart:
    """Agreement of the rankings under each pair of conditions, as a matrix."""
    names = [condition.name for condition in findings.conditions]
    taus = {frozenset((pair.a, pair.b)): pair.tau for pair in findings.agreements}

    def draw(figure: Figure) -> None:
        from matplotlib import colormaps
        from matplotlib.patches import Rectangle

        axes, colours = figure.subplots(), colormaps["Blues"]
        for (row, a), (column, b) in itertools.product(enumerate(names), repeat=2):
            if column > row:
                continue
            tau = 1.0 if a == b else taus.get(frozenset((a, b)))
            if tau is None:
                axes.text(column, row, "–", ha="center", va="center", color=FAINT)
                continue
            shade = colours(0.08 + 0.77 * float(np.clip(tau, 0.0, 1.0)))
            axes.add_patch(Rectangle((column - 0.48, row - 0.46), 0.96, 0.92, facecolor=shade, linewidth=0.0))
            ink = "#ffffff" if tau > 0.55 else "#1a1a1a"
            axes.text(column, row, Interval(tau).number, ha="center", va="center", color=ink)
        axes.set_xlim(-0.5, max(len(names) - 0.5, 5.5))
        axes.set_ylim(len(names) - 0.5, -0.5)
        hide_frame(axes)
        axes.set_yticks(range(len(names)), [f"{c.name} ({c.kind})" for c in findings.conditions])
        axes.set_xticks(range(len(names)), names, rotation=25, ha="right", rotation_mode="anchor")

    values = ", ".join(
        f"{pair.a} and {pair.b} {Interval.of(pair.tau, pair.low, pair.high).number}" for pair in findings.agreements
    )
    return draw_chart(
        "stability",
        "Stability of the ranking",
        f"Kendall's tau-b between the rankings of {len(findings.compared)} sets: 1 is the same order, 0 no agreement.",
        f"Kendall's tau between conditions: {values}.",
        draw,
        1.1 + 0.36 * len(names),
        width_in=_WIDTH_IN,
    )
