"""The tables of a measured unit, for its page and for the terminal."""

from collections.abc import Sequence

import numpy as np

from harness.core.interval import Interval
from harness.core.number_format import NOT_MEASURED, count_noun, format_fixed, format_share
from harness.core.text_table import Table
from harness.measure.rigid_pair import RigidPair
from harness.report.kit.markup import Markup
from harness.report.kit.table import stacked_cell
from harness.report.lab.quantities import format_ends, format_plain, format_value, quantity
from harness.report.lab.stacked_intervals import INTERVAL
from harness.report.lab.unit_content import (
    EPISODE_KINDS,
    STATION_FIGURES,
    CaptureSummary,
    DensityCurve,
    DeviationCurve,
    EpisodeMark,
    ParameterRow,
    QualityClass,
    StationFigures,
)

_FREQUENCIES, _TAUS = 8, 8
"""Rows of the tables of spectra and of Allan deviations."""


def parameters_table(parameters: Sequence[ParameterRow]) -> Table:
    """Parameters with their interval, the default, and whether they were measured."""
    rows = []
    for row in parameters:
        shown, number = quantity(row.key), row.measured
        rows.append(
            [
                shown.label,
                format_value(number, shown),
                format_ends(number, shown),
                f"{number.count:,}" if number.count else "–",
                "–" if row.default is None else format_plain(row.default, shown),
                row.status,
            ]
        )
    return Table(["number", "measured", INTERVAL, "from", "default", "status"], rows)


def reasons(parameters: Sequence[ParameterRow]) -> list[str]:
    """Why numbers were not measured, each reason once with its numbers."""
    names: dict[str, list[str]] = {}
    for row in parameters:
        if not row.measured.is_measured:
            names.setdefault(row.measured.reason, []).append(quantity(row.key).label)
    return [f"{', '.join(labels)}: {reason}" for reason, labels in names.items()]


def station_figures(rows: Sequence[StationFigures]) -> list[str]:
    """The figures that at least one station has, in their order."""
    return [name for name in STATION_FIGURES if any(name in row.figures for row in rows)]


def stations_table(rows: Sequence[StationFigures]) -> Table:
    """A row for each figure, a column for each station."""
    cells = [
        [quantity(f"station.{name}").title, *(_figure(row, name) for row in rows)] for name in station_figures(rows)
    ]
    return Table(["", *(row.station for row in rows)], cells)


def _figure(row: StationFigures, name: str) -> str:
    number = row.figures.get(name)
    return format_value(number, quantity(f"station.{name}"), with_unit=False) if number and number.is_measured else "–"


def stations_page_table(rows: Sequence[StationFigures]) -> Table:
    """The table of the stations with the interval below each number."""
    plain = stations_table(rows)
    cells = [
        [line[0], *(_with_interval(cell, row, name) for cell, row in zip(line[1:], rows, strict=True))]
        for line, name in zip(plain.rows, station_figures(rows), strict=True)
    ]
    return Table(plain.head, cells)


def _with_interval(cell: object, row: StationFigures, name: str) -> Markup | object:
    number = row.figures.get(name)
    ends = format_ends(number, quantity(f"station.{name}")) if number and number.is_measured else ""
    return stacked_cell(cell, ends)


def stretches_table(capture: CaptureSummary) -> Table:
    """The stretches of the capture."""
    rows = [
        [one.name or "without a mark", format_fixed(one.duration_s, 1, grouped=True), f"{one.records:,}"]
        for one in capture.stretches
    ]
    return Table(["stretch", "duration [s]", "records"], rows)


def allan_table(curves: Sequence[DeviationCurve], factor: float, unit: str) -> Table:
    """Allan deviations at a few averaging times."""
    shown_s = _spaced(curves[0].tau_s, _TAUS)
    rows = [
        [f"{tau_s:.3g}", *(_significant(factor * _nearest(c.tau_s, c.deviation, tau_s)) for c in curves)]
        for tau_s in shown_s
    ]
    return Table(["averaging time [s]", *(f"{curve.station} [{unit}]" for curve in curves)], rows)


def spectrum_table(curves: Sequence[DensityCurve]) -> Table:
    """Densities at a few frequencies."""
    shown_hz = _spaced(curves[0].frequency_hz, _FREQUENCIES)
    rows = [
        [f"{hz:.3g}", *(_significant(1e6 * _nearest(c.frequency_hz, c.density_m2_hz, hz)) for c in curves)]
        for hz in shown_hz
    ]
    return Table(["frequency [Hz]", *(f"{curve.station} [mm²/Hz]" for curve in curves)], rows)


def _spaced(values: np.ndarray, count: int) -> list[float]:
    """At most `count` of the rising values, about evenly spaced on a logarithmic axis."""
    wanted = np.geomspace(values[0], values[-1], count)
    return sorted({float(values[np.abs(np.log(values / value)).argmin()]) for value in wanted})


def _nearest(at: np.ndarray, values: np.ndarray, wanted: float) -> float:
    return float(values[np.abs(at - wanted).argmin()])


def kinds_of(episodes: Sequence[EpisodeMark]) -> list[str]:
    """The kinds of episodes that there are, in their order."""
    return [kind for kind in EPISODE_KINDS if any(one.kind == kind for one in episodes)]


def episode_counts(episodes: Sequence[EpisodeMark]) -> str:
    """Number of episodes of each kind in words."""
    counts = {kind: sum(one.kind == kind for one in episodes) for kind in kinds_of(episodes)}
    plural = {"echo": "echoes"}
    return ", ".join(
        f"{count:,} {kind if count == 1 else plural.get(kind, f'{kind}s')}" for kind, count in counts.items()
    )


def episodes_table(episodes: Sequence[EpisodeMark]) -> Table:
    """Number, total time and medians of the episodes of each kind that there is."""
    rows = []
    for kind in kinds_of(episodes):
        found = [one for one in episodes if one.kind == kind]
        duration_s = np.array([one.duration_s for one in found])
        sizes_m = np.array([one.size_m for one in found])
        known = sizes_m[np.isfinite(sizes_m)]
        rows.append(
            [
                kind,
                f"{len(found):,}",
                format_fixed(float(duration_s.sum()), 1, grouped=True),
                format_fixed(float(np.median(duration_s)), 3),
                format_fixed(1e3 * float(np.median(known)), 1) if len(known) else "–",
            ]
        )
    return Table(["kind", "number", "in all [s]", "median duration [s]", "median size [mm]"], rows)


def quality_table(classes: Sequence[QualityClass]) -> Table:
    """Share and error of the readings in each class of quality."""
    rows = [
        [
            "lost (0)" if one.to == 0.0 else f"above {one.above:g} to {one.to:g}",
            format_share(one.share, 2),
            "–" if one.to == 0.0 else _millimetres(one.median_m),
            "–" if one.to == 0.0 else _millimetres(one.quantile95_m),
        ]
        for one in classes
    ]
    return Table(["quality", "share of the readings", "median error [mm]", "95 % quantile [mm]"], rows)


def pair_table(pair: RigidPair) -> Table:
    """What two stations on one bar show."""
    rows = [
        ["distance of the stations", *_both(pair.length_m, "length_m")],
        ["change of the angle between them (RMS)", *_both(pair.rotation_rad, "rotation_rad")],
        ["positions ahead of orientations", *_both(pair.ahead_s, "components.speed.ahead_s")],
        *(
            [f"error at {one.from_m_s:g} to {one.to_m_s:g} m/s (RMS)", *_both(one.rms_m, "rms_m")]
            for one in pair.speeds
        ),
    ]
    return Table([" and ".join(pair.stations), "measured", INTERVAL], rows)


def _both(number: Interval, key: str) -> list[str]:
    return [format_value(number, quantity(key)), format_ends(number, quantity(key))]


def _millimetres(value_m: float) -> str:
    return format_fixed(1e3 * value_m, 1) if np.isfinite(value_m) else NOT_MEASURED


def _significant(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else NOT_MEASURED


def capture_text(capture: CaptureSummary) -> str:
    """The capture in a few words."""
    minutes = format_fixed(capture.duration_s / 60.0, 1, grouped=True)
    return f"{capture.name}: {count_noun(len(capture.stations), 'station')} at {capture.rate_hz:g} Hz, {minutes} min"
