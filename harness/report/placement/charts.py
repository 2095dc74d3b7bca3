"""The charts of a placement study: error against number of stations, rankings with ties, worth, paths, stability."""

import itertools
import math
import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from harness.core.seeds import generator
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Chart, hide_frame
from harness.report.placement.wording import (
    TIE_NOTE,
    format_error,
    format_rank_range,
    format_signed,
    format_value,
    plain_name,
    search_gain_sentence,
    set_name,
    worth_label,
)
from harness.report.run.charts import draw_chart
from harness.report.run.data import to_file_name
from harness.results.placement_findings import (
    MarginalContribution,
    PlacementFindings,
    PlacementSearch,
    RankAgreement,
    Ranking,
    StationSetResult,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_BEST, _OTHER = COLOURS[1], COLOURS[0]
_ROW_IN, _FRAME_IN, _MOST_ROWS, _LETTERS = 0.24, 0.9, 20, 96
"""Height of a row, of what is around rows; rows that are shown; letters under all best sets together."""


def pareto_chart(findings: PlacementFindings) -> Chart:
    """Every set as a point, the best of each size joined, ties ringed, the rate under the number of stations."""
    means: dict[int, list[float]] = {}
    for tried in sorted(findings.tried, key=lambda tried: len(tried.stations)):
        if tried.mean is not None:
            means.setdefault(len(tried.stations), []).append(tried.mean)
    best = [(b, t) for b in findings.best if (t := findings.of(b.stations)) and t.mean is not None]
    places = {size: place for place, size in enumerate(means)}
    letters = max(_LETTERS // len(places), 8)

    def draw(canvas: "Figure") -> None:
        axes = canvas.subplots()
        for size, place in places.items():
            wide = min(0.3, 0.02 * len(means[size]))
            across = place + generator(0, "pareto", str(size)).uniform(-wide, wide, len(means[size]))
            axes.plot(across, means[size], "o", color=FAINT, markersize=2.6, alpha=0.45, markeredgewidth=0.0)
        front = [(places[len(b.stations)], _mean_or_nan(t)) for b, t in best if b.on_front]
        axes.plot([x for x, _ in front], [y for _, y in front], color=_BEST, drawstyle="steps-post", alpha=0.5)
        for b, t in best:
            place, bottom = places[len(b.stations)], _mean_or_nan(t) if t.low is None else t.low
            if t.low is not None and t.high is not None:
                axes.vlines(place, t.low, t.high, color=INK, linewidth=1.3)
            ties = [_mean_or_nan(also) for tie in b.ties if (also := findings.of(tie)) and also.mean is not None]
            axes.plot([place] * len(ties), ties, "o", color="none", markeredgecolor=_OTHER, markersize=6.5)
            face = _BEST if b.on_front else PAPER
            axes.plot(place, _mean_or_nan(t), "o", color=face, markeredgecolor=_BEST, markersize=6.5, zorder=3)
            name = textwrap.fill(set_name(b.stations), letters)
            axes.annotate(
                name,
                (place, bottom),
                xytext=(0, -5),
                textcoords="offset points",
                ha="center",
                va="top",
                fontsize=8.5,
                linespacing=1.05,
            )
        axes.set_xticks(list(places.values()), [_size_label(findings, size) for size in places])
        axes.set_xlim(-0.6, len(places) - 0.4)
        axes.set_xlabel("trackers worn")
        axes.set_ylabel(f"{findings.metric} [{findings.unit}]")
        low, high = axes.get_ylim()
        axes.set_ylim(low - 0.16 * (high - low), high)  # room for names below
        axes.grid(False, axis="x")

    rates = {t.rate_hz for t in findings.tried}
    rate = f" Under each number the rate that the line carries ({findings.link})." if len(rates) > 1 else ""
    said = "; ".join(f"{len(b.stations)}: {set_name(b.stations)}, {format_error(findings, t)}" for b, t in best)
    return draw_chart(
        "pareto",
        "Error against the number of trackers",
        "Grey: every set tried. Blue: the best of its size with the 95 % interval of its mean; filled where no smaller "
        f"set errs less. Ringed: ties with it.{rate}",
        f"Error against the number of trackers; the best set of each size is {said}.",
        draw,
        4.2,
        raster=True,
    )


def _mean_or_nan(tried: StationSetResult) -> float:
    """Its mean, of sets that were measured."""
    return math.nan if tried.mean is None else tried.mean


def _size_label(findings: PlacementFindings, size: int) -> str:
    """The number of stations, and the rate where sizes differ in it."""
    rates = {tried.rate_hz for tried in findings.tried}
    here = {tried.rate_hz for tried in findings.tried if len(tried.stations) == size}
    return f"{size}\n{'/'.join(f'{rate:g}' for rate in sorted(here))} Hz" if len(rates) > 1 else str(size)


def ranking_chart(findings: PlacementFindings, found: Ranking, number: int) -> Chart:
    """How far each set is behind the first, paired, and which ranks its interval leaves it."""
    rows = found.rows[:_MOST_ROWS]

    def draw(canvas: "Figure") -> None:
        axes = canvas.subplots()
        axes.axvline(0.0, color=INK, linewidth=0.8)
        for place, row in enumerate(rows):
            if row.difference is None:
                continue
            colour = _BEST if row.tied else FAINT
            if row.low is not None and row.high is not None:
                axes.hlines(place, row.low, row.high, color=colour, linewidth=1.6)
            axes.plot(row.difference, place, "o", color=colour, markersize=6.0)
            axes.annotate(
                format_rank_range(row.rank_low, row.rank_high),
                (1.01, place),
                xycoords=("axes fraction", "data"),
                va="center",
                fontsize=8.5,
                color=INK if row.tied else FAINT,
                annotation_clip=False,
            )
        axes.annotate("ranks", (1.01, 1.0), (0, 4), "axes fraction", "offset points", fontsize=8.5, color=FAINT)
        _label_rows(axes, [set_name(row.stations) for row in rows])
        axes.set_xlabel(f"behind the first [{findings.unit}], paired over clips")

    more = f" The first {len(rows)} of {len(found.rows)}." if len(rows) < len(found.rows) else ""
    first, ties = found.rows[0], sum(row.tied for row in found.rows) - 1
    return draw_chart(
        f"ranking_{number}_{to_file_name(found.mode)}",
        f"{found.mode}: {plain_name(found.title)}",
        f"Mean paired difference to the first and its 95 % interval. Blue: a tie. {TIE_NOTE} On the right the ranks that "
        f"are left to each.{more}",
        f"{found.title}: {set_name(first.stations)} first, {ties} tied with it.",
        draw,
        _FRAME_IN + _ROW_IN * len(rows),
    )


def worth_chart(findings: PlacementFindings, found: Sequence[MarginalContribution], number: int) -> Chart:
    """What each candidate is worth in one mode, the most first."""
    rows = sorted((w for w in found if w.difference is not None), key=lambda w: -(w.difference or 0.0))[:40]
    title = worth_label(findings, found[0])

    def draw(canvas: "Figure") -> None:
        axes = canvas.subplots()
        for place, row in enumerate(rows):
            sure = row.low is not None and row.high is not None and not row.low <= 0.0 <= row.high
            colour = _BEST if sure and (row.difference or 0.0) > 0.0 else _OTHER if sure else FAINT
            axes.barh(place, row.difference or 0.0, 0.62, color=colour, alpha=0.85 if sure else 0.55)
            if row.low is not None and row.high is not None:
                axes.hlines(place, row.low, row.high, color=INK, linewidth=1.2)
        axes.axvline(0.0, color=INK, linewidth=0.8)
        _label_rows(axes, [plain_name(row.candidate) for row in rows])
        axes.set_xlabel(f"error without it less error with it [{findings.unit}]")

    said = ", ".join(f"{plain_name(row.candidate)} {format_signed(row.difference)}" for row in rows)
    return draw_chart(
        f"worth_{number}_{to_file_name(found[0].mode)}",
        f"{title[0].upper()}{title[1:]}",
        "Blue: wearing it helps; orange: it harms; grey: nothing shows either. Whiskers: 95 % interval over clips.",
        f"Worth of candidates {title}: {said}.",
        draw,
        _FRAME_IN + _ROW_IN * len(rows),
    )


def search_chart(findings: PlacementFindings, found: PlacementSearch) -> Chart:
    """The error after each step, and what the step was."""
    steps = [(step, findings.of(step.stations)) for step in found.steps]
    known = [(n, step, tried) for n, (step, tried) in enumerate(steps) if tried and tried.mean is not None]

    def draw(canvas: "Figure") -> None:
        axes = canvas.subplots()
        axes.plot(
            [_mean_or_nan(tried) for *_, tried in known], [n for n, *_ in known], color=_BEST, linewidth=1.2, alpha=0.6
        )
        for n, step, tried in known:
            sure = step.low is not None and step.low > 0.0
            if tried.low is not None and tried.high is not None:
                axes.hlines(n, tried.low, tried.high, color=FAINT, linewidth=1.0)
            face = _BEST if sure or n == 0 else PAPER
            axes.plot(_mean_or_nan(tried), n, "o", color=face, markeredgecolor=_BEST, markersize=6.5, zorder=3)
        _label_rows(axes, [_step_label(step.changed, step.tied) or "start" for _, step, _ in known])
        axes.set_yticks([n for n, *_ in known])
        axes.set_xlabel(f"{findings.metric} [{findings.unit}]")

    said = "; ".join(f"{step.changed or 'start'}: {format_value(tried.mean)}" for _, step, tried in known)
    ended = f" It ended: {found.ended}." if found.ended else ""
    ended += f" {held}." if (held := search_gain_sentence(found, findings.unit)) else ""
    return draw_chart(
        f"path_{to_file_name(found.mode)}_{to_file_name(found.title)}",
        f"{found.mode}: {plain_name(found.title)}",
        "From above, a step a row: what was changed, and in brackets what nothing shows to be worse. Filled: the step "
        f"helps, by its paired 95 % interval. Grey: the interval of the mean.{ended}",
        f"{found.mode}, {found.title}: {said} {findings.unit}.",
        draw,
        _FRAME_IN + 1.3 * _ROW_IN * len(known),
    )


def _step_label(changed: str, ties: Sequence[str]) -> str:
    also = ", ".join(map(plain_name, ties[:2])) + (f", {len(ties) - 2} more" if len(ties) > 2 else "")
    return plain_name(changed) + (f" (or {also})" if also else "")


def stability_chart(findings: PlacementFindings) -> Chart:
    """How alike conditions rank the sets: a square for each pair."""
    names = [condition.name for condition in findings.conditions]
    found = {frozenset((pair.a, pair.b)): pair for pair in findings.agreements}

    def draw(canvas: "Figure") -> None:
        from matplotlib import colormaps
        from matplotlib.patches import Rectangle

        axes, colours = canvas.subplots(), colormaps["Blues"]
        for (row, a), (column, b) in itertools.product(enumerate(names), repeat=2):
            if column > row:
                continue
            tau = 1.0 if a == b else _tau(found.get(frozenset((a, b))))
            if tau is None:
                axes.text(column, row, "–", ha="center", va="center", color=FAINT)
                continue
            shade = colours(0.08 + 0.77 * float(np.clip(tau, 0.0, 1.0)))
            axes.add_patch(Rectangle((column - 0.48, row - 0.46), 0.96, 0.92, facecolor=shade, linewidth=0.0))
            ink = "#ffffff" if tau > 0.55 else "#1a1a1a"
            axes.text(column, row, format_value(tau), ha="center", va="center", color=ink, fontsize=9)
        axes.set_xlim(-0.5, max(len(names) - 0.5, 5.5))
        axes.set_ylim(len(names) - 0.5, -0.5)
        hide_frame(axes)
        axes.set_yticks(range(len(names)), [f"{c.name} ({c.kind})" for c in findings.conditions])
        axes.set_xticks(range(len(names)), names, rotation=25, ha="right", rotation_mode="anchor")

    said = ", ".join(f"{pair.a} and {pair.b} {_tau_text(pair)}" for pair in findings.agreements)
    return draw_chart(
        "stability",
        "How stable the ranking is",
        f"Kendall's tau-b between the orders of {len(findings.compared)} sets: 1 is the same order, 0 none in common.",
        f"Kendall's tau between conditions: {said}.",
        draw,
        1.1 + 0.36 * len(names),
    )


def _tau(pair: RankAgreement | None) -> float | None:
    return pair.tau if pair else None


def _tau_text(pair: RankAgreement) -> str:
    return "not measured" if pair.tau is None else format_value(pair.tau)


def _label_rows(axes: "Axes", names: Sequence[str]) -> None:
    """Rows from above, each with its name."""
    axes.set_yticks(range(len(names)), names)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)
    axes.margins(x=0.06)


def charts(findings: PlacementFindings) -> dict[str, list[Chart]]:
    """Section of the page -> its charts; sections without a figure are empty."""
    modes: dict[tuple[str, tuple[str, ...]], list[MarginalContribution]] = {}
    for each in findings.worth:
        modes.setdefault((each.mode, each.base), []).append(each)
    measured = any(tried.mean is not None for tried in findings.tried) and findings.best
    shown = [rows for rows in modes.values() if any(row.difference is not None for row in rows)]
    return {
        "pareto": [pareto_chart(findings)] if measured else [],
        "rankings": [
            ranking_chart(findings, r, n) for n, r in enumerate(findings.rankings, start=1) if len(r.rows) > 1
        ],
        "worth": [worth_chart(findings, rows, n) for n, rows in enumerate(shown, start=1)],
        "paths": [search_chart(findings, search) for search in findings.searches if len(search.steps) > 1],
        "stability": [stability_chart(findings)] if len(findings.conditions) > 1 else [],
    }
