"""Departures from expected numbers, in words, as a table and as a chart, for units and validated captures."""

import math
from collections.abc import Sequence

import numpy as np

from harness.core.number_format import count_noun, format_fixed, format_p_value
from harness.measure.reports import Departure
from harness.report.kit.axes import draw_interval, label_rows
from harness.report.kit.chart import draw_chart
from harness.report.kit.page import DataTable
from harness.report.kit.style import COLOURS, FAINT, INK, PAPER, Axes, Chart, Figure
from harness.report.kit.text import list_first
from harness.report.lab.quantities import find_quantity

ALL_STATIONS = "all"
_CLEAR_RATIO = 0.05
"""A ratio this near to 1 is left out."""
_MOST_PRINTED = 8


def departures_sentence(name: str, checks: Sequence[Departure], expected_from: str) -> str:
    """What departs from the expected numbers, in one sentence."""
    counted, found = count_noun(len(checks), "check"), [check for check in checks if check.is_named]
    if not checks:
        return f"No expected number could be compared with {name}."
    if not found:
        return f"{name} shows no departure from {expected_from} in {counted}."
    faults = list_first([_fault(check) for check in condense_departures(checks)], 4)
    return f"{name} departs from {expected_from} in {len(found)} of {counted}: {faults}."


def condense_departures(checks: Sequence[Departure]) -> list[Departure]:
    """The departures, without those of single stations where all stations depart, together and each."""
    named = [check for check in checks if check.is_named]
    departing = {(check.key, check.station) for check in named}
    common = set()
    for key in {key for key, station in departing if not station}:
        stations = {one.station for one in checks if one.key == key} - {""}
        if len(stations) > 1 and all((key, station) in departing for station in stations):
            common.add(key)
    return [check for check in named if not check.station or check.key not in common]


def _fault(check: Departure) -> str:
    """Name of a departure, and how many times as large it is as expected."""
    shown = find_quantity(check.key)
    of = f" of {check.station}" if check.station else ""
    ratio = _ratio_text(check.measured.value, check.expected.value).removeprefix(", ")
    return f"{shown.label}{of} ({ratio or shown.of(check.measured).number})"


def departure_texts(checks: Sequence[Departure]) -> list[str]:
    """Each departure in words: what, where, how large, and what was expected."""
    return [_departure_text(check) for check in condense_departures(checks)]


def _departure_text(check: Departure) -> str:
    shown = find_quantity(check.key)
    name = f"{shown.label[0].upper()}{shown.label[1:]}" + (f" of {check.station}" if check.station else "")
    number = f"{shown.of(check.measured)}, expected {shown.exact(check.expected.value)}"
    return f"{name}: {number}{_ratio_text(check.measured.value, check.expected.value)}."


def _ratio_text(measured: float, expected: float) -> str:
    if expected == 0.0 or measured / expected <= 0.0 or abs(measured / expected - 1.0) < _CLEAR_RATIO:
        return ""
    ratio = measured / expected
    if ratio > 1.0:
        return f", {format_fixed(ratio, 1 if ratio < 10.0 else 0)} times as much"
    return f", {format_fixed(100.0 * ratio, 0)} % of it"


def departures_table(checks: Sequence[Departure]) -> DataTable:
    """Measured and expected numbers of checks, the least likely first."""
    rows = [
        [
            find_quantity(check.key).label,
            check.station or ALL_STATIONS,
            find_quantity(check.key).of(check.measured),
            find_quantity(check.key).exact(check.expected.value),
            format_p_value(check.p),
            format_p_value(check.p_holm),
        ]
        for check in sorted(checks, key=lambda check: (check.p_holm, check.p))
    ]
    return DataTable(
        ["number", "station", "measured", "expected", "p", "p (Holm)"],
        rows,
        caption="The least likely first. Below the numbers: 95 % intervals. A departure has a p of at most 0.05 after "
        "Holm's correction for the number of checks.",
        most_printed=max(_MOST_PRINTED, sum(check.is_named for check in checks)),
    )


_ROW_IN, _FRAME_IN = 0.3, 0.75
_LEAST_RATIO, _MOST_RATIO = 0.02, 50.0
"""Ends of the axis of ratios."""
_TICKS = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0)
_TICK_SPACING = 0.07
"""Least distance of two ticks, as a share of the axis."""


def check_chart(every: Sequence[Departure], expected_from: str) -> Chart | None:
    """Measured over expected number of each check, with its interval; None if no check has a ratio."""
    checks = _with_ratio(every)
    if not checks:
        return None
    names = [_check_name(check) for check in checks]
    texts = "; ".join(
        f"{name} {find_quantity(check.key).of(check.measured)}{', a departure' if check.is_named else ''}"
        for name, check in zip(names, checks, strict=True)
    )
    return draw_chart(
        "checks",
        "Measured over expected",
        f"Each number over that of {expected_from}, with its 95 % interval. Orange triangles: departures, after "
        "Holm's correction over all checks. Hollow: no departure. A number with nothing expected has no place here.",
        f"Measured over expected: {texts}.",
        lambda figure: _draw_checks(figure, checks, names),
        _FRAME_IN + _ROW_IN * len(checks),
    )


def _check_name(check: Departure) -> str:
    label = find_quantity(check.key).label
    return f"{label}, {check.station}" if check.station else label


def _draw_checks(figure: Figure, checks: Sequence[Departure], names: Sequence[str]) -> None:
    axes = figure.subplots()
    ends = []
    for row, check in enumerate(checks):
        number = check.measured.scaled(1.0 / check.expected.value)
        ratio, low, high = number.value, number.low, number.high
        colour = COLOURS[0] if check.is_named else FAINT
        low, high = max(low, _LEAST_RATIO), min(high, _MOST_RATIO)
        marker = (">" if ratio > 1.0 else "<") if check.is_named else "o"
        face, value = colour if check.is_named else PAPER, float(np.clip(ratio, _LEAST_RATIO, _MOST_RATIO))
        draw_interval(axes, row, (low, high), value, color=colour, marker=marker, markerfacecolor=face)
        ends += [low, high]
    axes.axvline(1.0, color=INK, linewidth=0.9, zorder=1)
    label_rows(axes, names)
    _scale_ratios(axes, min(0.8, 0.9 * min(ends)), max(1.25, 1.1 * max(ends)))
    axes.set_xlabel("measured over expected")


def _with_ratio(checks: Sequence[Departure]) -> list[Departure]:
    """The checks whose numbers have a ratio: those of all stations together, and departures of single ones."""
    told = condense_departures(checks)
    return [
        check
        for check in checks
        if (not check.station or check in told) and check.expected.value > 0.0 and check.measured.value > 0.0
    ]


def _scale_ratios(axes: Axes, low: float, high: float) -> None:
    """Make the x axis logarithmic from `low` to `high`, with plain ticks that stand far enough apart."""
    from matplotlib.ticker import NullLocator

    axes.set_xscale("log")
    axes.xaxis.set_minor_locator(NullLocator())
    ticks = [1.0]
    for tick in sorted((tick for tick in _TICKS if low <= tick <= high), key=lambda tick: abs(math.log(tick))):
        if min(abs(math.log(tick / other)) for other in ticks) > _TICK_SPACING * math.log(high / low):
            ticks.append(tick)
    axes.set_xticks(sorted(ticks), [f"{tick:g}" for tick in sorted(ticks)])
    axes.set_xlim(low, high)
