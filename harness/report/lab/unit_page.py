"""The page of a measured unit: its faults first, what it is like, then every number with its interval."""

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from harness.core.number_format import NOT_MEASURED, Interval, count_noun, format_fixed, format_share
from harness.measure import QualityClass, RigidPair, StretchLength, SurveyComparison, UncertaintyBudget
from harness.measure.reports import (
    STATION_FIGURES,
    CaptureSummary,
    DensityCurve,
    EpisodeMark,
    ParameterRow,
    RecordingAdvice,
    StationFigures,
    UnitReport,
)
from harness.report.kit.page import Block, Bullets, DataTable, Drawing, Page, Prose, Section
from harness.report.lab.departures import check_chart, departure_texts, departures_sentence, departures_table
from harness.report.lab.quantities import find_quantity, format_range
from harness.report.lab.unit_charts import (
    allan_chart,
    episodes_chart,
    kinds_of,
    pair_chart,
    quality_chart,
    spectrum_chart,
)

_FREQUENCIES, _TAUS = 8, 8
"""Rows of the tables of spectra and of Allan deviations."""
_INTERVALS = (
    "Below the numbers: intervals that hold the true value in 95 of 100 captures. From: the number of events or of "
    "independent samples."
)
_STATIONS = (
    "Within: distance at rest from the median position and the mean orientation. White noise and drift are "
    "standard deviations on each axis. Lost readings have quality 0; lost records never came. Below: 95 % intervals."
)
_EPISODES = "Excursion: a displacement of seconds. Echo: a burst of outliers. Gap: a loss."


def unit_page(report: UnitReport, command: str, unit_file: str = "") -> Page:
    """The page of a unit that `command` measured, and whose unit file has this name."""
    described = " ".join(description(report))
    return Page(
        verb="characterize",
        name=report.name,
        headline=departures_sentence(report.name, report.checks, report.expected_from)
        if report.expected_from
        else f"{capture_text(report.capture)}.",
        lead=[Bullets(departure_texts(report.checks)), *([Prose(described)] if described else [])],
        facts={
            "Capture": capture_text(report.capture),
            "Damage": " ".join(report.capture.damage),
            "Unit file": unit_file,
            "Expected": f"numbers of {report.expected_from}" if report.expected_from else "",
        },
        sections=[
            Section(
                "Checks",
                "checks",
                [
                    Drawing(
                        partial(check_chart, report.checks, report.expected_from),
                        departures_table(report.checks),
                        f"All {count_noun(len(report.checks), 'check')}",
                    )
                ],
            ),
            Section("Error model", "parameters", _parameters(report.parameters)),
            Section("Clock and records", "timing", _parameters(report.timing)),
            Section("Stations", "stations", [_stations_table(report.stations)]),
            Section(
                "Allan deviation",
                "allan",
                [Drawing(partial(allan_chart, report), tuple(_allan_tables(report)))],
                terminal=False,
            ),
            Section(
                "Spectrum",
                "spectrum",
                [Drawing(partial(spectrum_chart, report), _spectrum_table(report.spectra))],
                terminal=False,
            ),
            Section(
                "Episodes", "episodes", [Drawing(partial(episodes_chart, report), _episodes_table(report.episodes))]
            ),
            Section(
                "Quality",
                "quality",
                [Drawing(partial(quality_chart, report.quality), _quality_table(report.quality))],
                terminal=False,
            ),
            Section(
                "Stations on a bar",
                "bar",
                [Drawing(partial(pair_chart, pair), _pair_table(pair)) for pair in report.rigid_pairs],
            ),
            Section("Surveyed points", "survey", [_survey_table(report.survey)] if report.survey else []),
            Section("How long to record", "advice", [Bullets([advice_text(one) for one in report.advice])]),
            Section(
                "Capture",
                "capture",
                [stretches_table(report.capture.stretches), Bullets([*report.capture.damage, *report.notes])],
            ),
        ],
        command=command,
    )


def description(report: UnitReport) -> list[str]:
    """What the unit is like, in short sentences; numbers that were not measured are left out."""
    values = {row.key: row.measured for row in (*report.parameters, *report.timing) if row.measured.is_measured}
    sentences = (
        _spread_sentence(report),
        _noise_sentence(values),
        _excursion_sentence(values),
        _share_sentence(values),
        _timing_sentence(values),
    )
    return [sentence for sentence in sentences if sentence]


def _spread_sentence(report: UnitReport) -> str:
    """Half and 95 % of the readings at rest, over all stations; the next sentences name the outliers."""
    parts = [
        f"half of a station's {noun} lie within {half} of the middle, 95 % in {_over_stations(report, f'most_{end}')}"
        for noun, end in (("positions", "within_m"), ("orientations", "within_rad"))
        if (half := _over_stations(report, f"half_{end}"))
    ]
    return f"At rest, {'; '.join(parts)}." if parts else ""


def _over_stations(report: UnitReport, name: str) -> str:
    """The smallest and the largest value of a figure; "" where it was not measured."""
    found = [number.value for row in report.stations if (number := row.figures.get(name)) and number.is_measured]
    shown = find_quantity(f"station.{name}")
    return f"{format_range(shown.factor * value for value in found)} {shown.unit}" if found else ""


def _noise_sentence(values: Mapping[str, Interval]) -> str:
    nouns = {"components.white.position_m": "white noise", "components.drift.position_m": "drift"}
    parts = [f"{_number(values, key)} of {noun}" for key, noun in nouns.items() if key in values]
    drift = values.get("components.drift.position_m")
    lasting = _number(values, "components.drift.correlation_s") if drift and drift.low > 0.0 else ""
    return (
        f"On each axis a position has {' and '.join(parts)}{', which lasts ' * bool(lasting)}{lasting}."
        if parts
        else ""
    )


def _number(values: Mapping[str, Interval], key: str) -> str:
    return find_quantity(key).of(values[key]).number if key in values else ""


def _excursion_sentence(values: Mapping[str, Interval]) -> str:
    rate = values.get("components.excursion.onsets_per_min")
    if rate is None:
        return ""
    size, stay = (_ends_text(values, f"components.excursion.{name}") for name in ("size_m", "stay_s"))
    tail = "".join([f" of {size}" if size else "", f" for {stay}" if stay else ""])
    return f"A station has {rate.number} excursions a minute{tail}."


def _ends_text(values: Mapping[str, Interval], key: str) -> str:
    if f"{key}.0" in values and f"{key}.1" in values:
        return f"{find_quantity(f'{key}.0').bare(values[f'{key}.0']).number} to {_number(values, f'{key}.1')}"
    return _number(values, key)


def _share_sentence(values: Mapping[str, Interval]) -> str:
    nouns = {
        "components.echo.share": "echoes",
        "components.dropout.share": "lost",
        "timing.lost_share": "missing",
        "timing.duplicate_share": "sent twice",
    }
    parts = [f"{_number(values, key)} are {noun}" for key, noun in nouns.items() if key in values]
    joined = " and ".join([", ".join(parts[:-1]), parts[-1]] if parts[1:] else parts)
    return f"Of the readings {joined}." if parts else ""


def _timing_sentence(values: Mapping[str, Interval]) -> str:
    rate = _number(values, "timing.rate_hz")
    clock = values.get("components.clock.drift_ppm")
    parts = [f"records of a station come at {rate}"] if rate else []
    if clock:
        size = clock if clock.value >= 0.0 else clock.scaled(-1.0)
        word = "fast" if clock.value >= 0.0 else "slow"
        parts.append(f"the clock runs {find_quantity('components.clock.drift_ppm').of(size).number} {word}")
    text = " and ".join(parts)
    return f"{text[0].upper()}{text[1:]}." if text else ""


def advice_text(advice: RecordingAdvice) -> str:
    """How long to record for a wanted precision."""
    label, percent = find_quantity(advice.key).label, f"{100.0 * advice.precision:g} %"
    had = f"This capture has {count_noun(advice.events, 'event')} in {_minutes(advice.minutes)}"
    if advice.events >= advice.needed_events:
        return (
            f"To know the {label} to {percent}: {had.lower()}, which is enough ({advice.needed_events:,} are needed)."
        )
    if not math.isfinite(advice.needed_minutes):
        return f"To know the {label} to {percent}: {advice.needed_events:,} events are needed. {had}: no rate to go by."
    needed = f"record {_minutes(advice.needed_minutes)} at this rate ({advice.needed_events:,} events)"
    return f"To know the {label} to {percent}: {needed}. {had}."


def _minutes(minutes: float) -> str:
    return f"{format_fixed(minutes, 1 if minutes < 10.0 else 0, grouped=True)} min"


def capture_text(capture: CaptureSummary) -> str:
    """The capture in a few words."""
    minutes = format_fixed(capture.duration_s / 60.0, 1, grouped=True)
    return f"{capture.name}: {count_noun(len(capture.stations), 'station')} at {capture.rate_hz:g} Hz, {minutes} min"


def _parameters(parameters: Sequence[ParameterRow]) -> list[Block]:
    """Parameters with their interval, the default, and why numbers were not measured."""
    rows = [
        [
            find_quantity(row.key).label,
            find_quantity(row.key).of(row.measured),
            f"{row.measured.count:,}" if row.measured.count else "–",
            "–" if row.default is None else find_quantity(row.key).exact(row.default),
            row.status,
        ]
        for row in parameters
    ]
    why: dict[str, list[str]] = {}
    for row in parameters:
        if not row.measured.is_measured:
            why.setdefault(row.measured.reason, []).append(find_quantity(row.key).label)
    reasons = [f"{', '.join(labels)}: {reason}" for reason, labels in why.items()]
    table = DataTable(["number", "measured", "from", "default", "status"], rows, caption=_INTERVALS)
    return [table, Bullets(reasons, "Not measured, and why", "not measured: ")]


def _stations_table(rows: Sequence[StationFigures]) -> DataTable:
    """A row for each figure, a column for each station."""
    names = [name for name in STATION_FIGURES if any(name in row.figures for row in rows)]
    cells = [[find_quantity(f"station.{name}").title, *(_figure(row, name) for row in rows)] for name in names]
    return DataTable(["", *(row.station for row in rows)], cells, caption=_STATIONS, intervals_printed=False)


def _figure(row: StationFigures, name: str) -> Interval | str:
    number = row.figures.get(name)
    return find_quantity(f"station.{name}").bare(number) if number and number.is_measured else "–"


def stretches_table(stretches: Sequence[StretchLength]) -> DataTable:
    """The stretches of a capture."""
    rows = [
        [one.name or "without a mark", format_fixed(one.duration_s, 1, grouped=True), f"{one.records:,}"]
        for one in stretches
    ]
    return DataTable(["stretch", "duration [s]", "records"], rows, caption="Parts of the capture.", label="stretches")


def _allan_tables(report: UnitReport) -> list[DataTable]:
    """Allan deviations at a few averaging times."""
    groups = (
        (report.allan_position, 1e3, "mm", "Allan deviation of the position"),
        (report.allan_orientation, math.degrees(1.0), "deg", "Allan deviation of the orientation"),
    )
    return [
        DataTable(
            ["averaging time [s]", *(f"{curve.station} [{unit}]" for curve in curves)],
            [
                [f"{tau_s:.3g}", *(_significant(factor * _nearest(c.tau_s, c.deviation, tau_s)) for c in curves)]
                for tau_s in _spaced(curves[0].tau_s, _TAUS)
            ],
            caption=caption,
            label=caption,
        )
        for curves, factor, unit, caption in groups
        if curves
    ]


def _spectrum_table(curves: Sequence[DensityCurve]) -> DataTable:
    """Densities at a few frequencies."""
    rows = [
        [f"{hz:.3g}", *(_significant(1e6 * _nearest(c.frequency_hz, c.density_m2_hz, hz)) for c in curves)]
        for hz in (_spaced(curves[0].frequency_hz, _FREQUENCIES) if curves else ())
    ]
    head = ["frequency [Hz]", *(f"{curve.station} [mm²/Hz]" for curve in curves)]
    return DataTable(head, rows, caption="Density near these frequencies.")


def _spaced(values: np.ndarray, count: int) -> list[float]:
    """At most `count` of the rising values, about evenly spaced on a logarithmic axis."""
    wanted = np.geomspace(values[0], values[-1], count)
    return sorted({float(values[np.abs(np.log(values / value)).argmin()]) for value in wanted})


def _nearest(at: np.ndarray, values: np.ndarray, wanted: float) -> float:
    return float(values[np.abs(at - wanted).argmin()])


def _significant(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else NOT_MEASURED


def _episodes_table(episodes: Sequence[EpisodeMark]) -> DataTable:
    """Number, total time and medians of the episodes of each kind that there is."""
    rows = []
    for kind in kinds_of(episodes):
        found = [one for one in episodes if one.kind == kind]
        duration_s = np.array([one.duration_s for one in found])
        known = [one.size_m for one in found if np.isfinite(one.size_m)]
        rows.append(
            [
                kind,
                f"{len(found):,}",
                format_fixed(float(duration_s.sum()), 1, grouped=True),
                format_fixed(float(np.median(duration_s)), 3),
                format_fixed(1e3 * float(np.median(known)), 1) if known else "–",
            ]
        )
    return DataTable(
        ["kind", "number", "in all [s]", "median duration [s]", "median size [mm]"], rows, caption=_EPISODES
    )


def _quality_table(classes: Sequence[QualityClass]) -> DataTable:
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
    head = ["quality", "share of the readings", "median error [mm]", "95 % quantile [mm]"]
    return DataTable(head, rows, caption="A class includes its upper end.")


def _millimetres(value_m: float) -> str:
    return format_fixed(1e3 * value_m, 1) if np.isfinite(value_m) else NOT_MEASURED


def _survey_table(survey: SurveyComparison) -> DataTable:
    """What a station at rest errs by at surveyed points."""
    numbers: dict[str, object] = {
        f"point {number}: error x, y, z": f"{', '.join(format_fixed(1e3 * value, 2) for value in error)} mm"
        for number, error in enumerate(survey.errors_m.tolist(), 1)
    }
    numbers |= {"distance (RMS)": survey.rms_m.scaled(1e3, "mm"), "scale error": survey.scale.scaled(1e2, "%")}
    numbers |= budget_rows(survey.budget)
    caption = "Errors after the best rigid placement of the points, which takes out origin and axes."
    return DataTable([survey.station, "measured"], [*map(list, numbers.items())], caption=caption, label="survey")


def budget_rows(budget: UncertaintyBudget) -> dict[str, object]:
    """An uncertainty budget in millimetres: standard uncertainties, bias, and expanded uncertainty."""
    rows: dict[str, object] = {
        f"{one.name} (type {one.kind})": f"{_significant(1e3 * one.standard)} mm" for one in budget.components
    }
    rows["bias"] = budget.bias.scaled(1e3, "mm") if budget.bias.is_measured else NOT_MEASURED
    label = f"expanded uncertainty of one reading (k = {budget.coverage_factor:.2f})"
    return {**rows, label: f"{_significant(1e3 * budget.expanded)} mm"}


def _pair_table(pair: RigidPair) -> DataTable:
    """What two stations on one bar show."""
    numbers: dict[str, object] = {
        "distance of the stations": find_quantity("length_m").of(pair.length_m),
        "change of the angle between them (RMS)": find_quantity("rotation_rad").of(pair.rotation_rad),
        "positions ahead of orientations": find_quantity("components.speed.ahead_s").of(pair.ahead_s),
    }
    numbers |= {
        f"error at {one.from_m_s:g} to {one.to_m_s:g} m/s (RMS)": find_quantity("rms_m").of(one.rms_m)
        for one in pair.speeds
    }
    numbers |= {
        f"length at {one.from_m:.2g} to {one.to_m:.2g} m from the origin": find_quantity("length_m").of(one.length_m)
        for one in pair.places
    }
    numbers |= budget_rows(pair.budget)
    caption = "Errors of both stations together. Below the numbers: 95 % intervals."
    names = " and ".join(pair.stations)
    return DataTable([names, "measured"], [*map(list, numbers.items())], caption=caption, label=f"bar of {names}")
