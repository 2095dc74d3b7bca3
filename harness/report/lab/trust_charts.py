"""The charts of a trust study: pairs on both sides, ranks, differences against margins, and energy distances."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from harness.core.number_format import Interval, format_fixed
from harness.report.kit.axes import draw_interval, label_rows
from harness.report.kit.chart import add_legend, draw_chart
from harness.report.kit.style import COLOURS, FAINT, GRID, INK, PAPER, Chart, Figure, series_colour
from harness.report.kit.text import metric_label, metric_name
from harness.results.findings import (
    Equivalence,
    EquivalenceVerdict,
    ErrorDistance,
    PairAgreement,
    SideDifference,
    TrustFindings,
)
from harness.score import DEFINITIONS

_ROW_IN, _PAIR_IN, _FRAME_IN, _RANK_IN = 0.3, 0.46, 0.85, 4.2
_DEVICE: Mapping[str, Any] = {"color": COLOURS[1], "marker": "o"}
_SIMULATION: Mapping[str, Any] = {"color": COLOURS[0], "marker": "s", "markerfacecolor": PAPER}
_VERDICT_STYLES: Mapping[EquivalenceVerdict, dict[str, Any]] = {
    "beyond the margin": {"color": COLOURS[0], "marker": "D"},
    "cannot tell": {"color": FAINT, "marker": "o", "markerfacecolor": PAPER},
    "equivalent": {"color": INK, "marker": "o"},
}
_MOST_PAIRS = 40
_MOST_MARGINS = 6.0
"""Differences are drawn up to so many margins."""


def metric_title(metric: str) -> str:
    """The metric with its unit; a metric that has no definition by its name."""
    return metric_label(metric) if metric in DEFINITIONS else metric


def interval_title(findings: TrustFindings) -> str:
    """Name of the intervals: those of two one-sided tests at the level of the plan."""
    return f"{100.0 * (1.0 - 2.0 * findings.level):g} % interval"


def pair_title(pair: PairAgreement) -> str:
    """The two arms of a pair."""
    return f"{pair.a} against {pair.b}"


def side_interval(side: SideDifference) -> Interval:
    """Mean difference of one side with its interval."""
    return Interval.of(side.mean, side.low, side.high, signed=True)


def sort_pairs(pairs: Sequence[PairAgreement]) -> list[PairAgreement]:
    """The pairs sorted by verdict, contradictions first; pairs of one verdict keep their order."""
    order = ("contradict", "cannot tell", "agree")
    return sorted(pairs, key=lambda pair: order.index(pair.verdict))


def sort_equivalences(rows: Sequence[Equivalence]) -> list[Equivalence]:
    """The rows sorted by verdict, those beyond the margin first."""
    order = ("beyond the margin", "cannot tell", "equivalent")
    return sorted(rows, key=lambda row: order.index(row.verdict))


def pairs_chart(findings: TrustFindings) -> Chart | None:
    """Difference of each pair on both sides; None without any."""
    pairs = [pair for pair in sort_pairs(findings.pairs) if pair.device.mean is not None][:_MOST_PAIRS]
    if not pairs:
        return None
    texts = "; ".join(
        f"{pair_title(pair)} {side_interval(pair.device).number} on the device and "
        f"{side_interval(pair.simulated).number} in the simulation, "
        f"{pair.verdict}"
        for pair in pairs
    )
    return draw_chart(
        "pairs",
        f"Difference of each pair in {metric_title(findings.ranked_metric)}",
        f"Mean error of the first method minus that of the second, with its {interval_title(findings)} over units. "
        "Where both intervals lie on the same side of zero, the sides agree. Where they lie on opposite sides, they "
        "contradict each other.",
        f"Differences of pairs in {metric_title(findings.ranked_metric)}: {texts}.",
        lambda figure: _draw_pairs(figure, pairs, findings.ranked_metric),
        _FRAME_IN + 0.2 + _PAIR_IN * len(pairs),
    )


def _draw_pairs(figure: Figure, pairs: Sequence[PairAgreement], metric: str) -> None:
    axes = figure.subplots()
    for row, pair in enumerate(pairs):
        for side, style, label, shift in (
            (pair.device, _DEVICE, "device", -0.14),
            (pair.simulated, _SIMULATION, "simulation", 0.14),
        ):
            if side.mean is not None:
                name = None if row else label
                draw_interval(axes, row + shift, (side.low, side.high), side.mean, label=name, **style)
        axes.annotate(
            pair.verdict,
            (1.02, row),
            xycoords=axes.get_yaxis_transform(),
            va="center",
            fontsize=9.5,
            color=INK if pair.verdict != "contradict" else COLOURS[0],
        )
    axes.axvline(0.0, color=FAINT, linewidth=0.9)
    label_rows(axes, [f"{pair.a}\n− {pair.b}" for pair in pairs])
    axes.set_xlabel(f"difference in {metric_title(metric)}")
    add_legend(figure, axes)


def ranks_chart(findings: TrustFindings) -> Chart | None:
    """Mean error of each method on both sides; None with fewer than two."""
    arms = [
        (one.arm, one.device, one.simulated)
        for one in findings.equivalences
        if one.metric == findings.ranked_metric and one.device is not None and one.simulated is not None
    ]
    if len(arms) < 2:
        return None
    margin = next(one.margin for one in findings.equivalences if one.metric == findings.ranked_metric)
    texts = "; ".join(f"{arm} {x:.3g} and {y:.3g}" for arm, x, y in arms)
    return draw_chart(
        "ranks",
        "Simulation against device",
        f"A point for each method: its {metric_title(findings.ranked_metric)}, mean over all units. On the line the "
        "two sides are equal; the band is the margin. A ranking is the same on both sides if the points rise from left "
        "to right.",
        f"Mean {metric_title(findings.ranked_metric)} on the device and in the simulation: {texts}.",
        lambda figure: _draw_ranks(figure, arms, margin, findings.ranked_metric),
        _RANK_IN,
    )


def _draw_ranks(figure: Figure, arms: Sequence[tuple[str, float, float]], margin: float, metric: str) -> None:
    axes = figure.subplots()
    values = [value for _, x, y in arms for value in (x, y)]
    pad = max(0.08 * (max(values) - min(values)), margin)
    low, high = min(values) - pad, max(values) + pad
    axes.fill_between([low, high], [low - margin, high - margin], [low + margin, high + margin], color=GRID, alpha=0.75)
    axes.plot([low, high], [low, high], color=FAINT, linewidth=0.9)
    for n, (arm, x, y) in enumerate(sorted(arms, key=lambda arm: arm[1])):
        axes.plot(x, y, "o", color=series_colour(n), markersize=7, label=arm)
    axes.set_xlim(low, high)
    axes.set_ylim(low, high)
    axes.set_aspect("equal")
    axes.set_xlabel(f"device: {metric_title(metric)}")
    axes.set_ylabel(f"simulation: {metric_title(metric)}")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right upper")


def equivalence_chart(findings: TrustFindings) -> Chart | None:
    """Differences in units of the margin; None without any interval."""
    rows = [r for r in sort_equivalences(findings.equivalences) if r.difference is not None and r.low is not None]
    if not rows:
        return None
    texts = "; ".join(
        f"{row.arm} {metric_name(row.metric)} {_in_margins(row.difference, row):.2g}, {row.verdict}" for row in rows
    )
    return draw_chart(
        "equivalence",
        "Simulation minus device against the margin",
        f"Mean difference over units in units of the margin, with its {interval_title(findings)}. Equivalent: the "
        "whole interval lies in the grey band. Diamonds: the whole interval lies outside. Hollow: it cannot be told.",
        f"Simulation minus device in units of the margin: {texts}.",
        lambda figure: _draw_equivalence(figure, rows),
        _FRAME_IN + _ROW_IN * len(rows),
    )


def _in_margins(value: float | None, row: Equivalence) -> float:
    return math.nan if value is None else value / row.margin


def _draw_equivalence(figure: Figure, rows: Sequence[Equivalence]) -> None:
    axes = figure.subplots()
    axes.axvspan(-1.0, 1.0, color=GRID, alpha=0.75, linewidth=0.0)
    axes.axvline(0.0, color=FAINT, linewidth=0.9)
    reach = 1.3
    for n, row in enumerate(rows):
        style = _VERDICT_STYLES[row.verdict]
        low, middle, high = (
            min(max(_in_margins(value, row), -_MOST_MARGINS), _MOST_MARGINS)
            for value in (row.low, row.difference, row.high)
        )
        text = f"{format_fixed(_in_margins(row.difference, row), 2, signed=True)} {row.verdict}"
        draw_interval(axes, n, (low, high), middle, text, **style)
        reach = max(reach, 1.08 * abs(low), 1.08 * abs(high))
    axes.set_xlim(-reach, reach)
    label_rows(axes, [f"{row.arm}, {metric_name(row.metric)}" for row in rows])
    axes.set_xlabel("simulation − device [margins]")


def distances_chart(findings: TrustFindings) -> Chart | None:
    """Distances of the errors over the device's own; None without any."""
    rows = [row for row in findings.distances if row.distance is not None and row.split_half]
    if not rows:
        return None
    texts = "; ".join(f"{row.station} {row.feature} {_ratio(row):.2g}" for row in rows)
    return draw_chart(
        "distances",
        "Distance of the errors, simulation from device",
        "Energy distance between the errors of both sides, over the largest that is usual between halves of the "
        "device's own captures (95 % quantile). At most 1: the simulation is no farther from the device than the "
        "device from itself. Orange: the errors differ significantly.",
        f"Energy distance over that of halves of the device's captures: {texts}.",
        lambda figure: _draw_distances(figure, rows, findings.level),
        _FRAME_IN + _ROW_IN * len(rows),
    )


def _ratio(row: ErrorDistance) -> float:
    return (row.distance or 0.0) / (row.split_half or math.nan)


def _draw_distances(figure: Figure, rows: Sequence[ErrorDistance], level: float) -> None:
    axes = figure.subplots()
    for n, row in enumerate(rows):
        differs = row.p_holm is not None and row.p_holm <= level
        axes.barh(n, max(_ratio(row), 0.0), 0.6, color=COLOURS[0] if differs else COLOURS[1])
        text = f"{format_fixed(_ratio(row), 2)}{' differs' if differs else ''}"
        axes.annotate(text, (1.02, n), xycoords=axes.get_yaxis_transform(), va="center", fontsize=9.5)
    axes.axvline(1.0, color=INK, linewidth=0.9)
    axes.set_xlim(0.0, max(1.3, 1.08 * max(_ratio(row) for row in rows)))
    label_rows(axes, [f"{row.station}, {row.feature}" for row in rows])
    axes.set_xlabel("distance over the device's own")
