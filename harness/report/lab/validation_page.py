"""The page of a validated capture: how far it is from its reference, then the registration, then each station."""

import math
from collections.abc import Mapping
from functools import partial

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import format_fixed, format_number, format_share
from harness.measure.reports import ResidualSeries, ValidationReport
from harness.report.kit.axes import draw_interval, label_rows
from harness.report.kit.chart import draw_chart, insert_gaps
from harness.report.kit.page import BrowserOnly, Bullets, DataTable, Drawing, Page, Prose, Section
from harness.report.kit.style import COLOURS, FAINT, Axes, Chart, Figure
from harness.report.kit.text import metric_label
from harness.report.lab.departures import departure_texts, departures_sentence, departures_table
from harness.report.lab.quantities import find_quantity, format_range
from harness.report.lab.unit_page import capture_text, stretches_table
from harness.score import DEFINITIONS

_OFFSETS = ("time_offset_orientation_s", "time_offset_position_s")
_ROW_IN, _FRAME_IN, _SERIES_IN = 0.34, 0.75, 0.95
_MOST_POINTS = 1200
"""Points of one curve; more are averaged in pairs, fours and so on: the largest is drawn."""


def offsets_chart(report: ValidationReport) -> Chart | None:
    """The time offsets by orientation and by position; None unless both were measured."""
    offsets = {key: report.numbers[key] for key in _OFFSETS if key in report.numbers}
    if len(offsets) < 2 or not all(number.is_measured for number in offsets.values()):
        return None
    names = [find_quantity(key).label.removeprefix("time offset ") for key in offsets]
    shown = [find_quantity(key).of(number) for key, number in offsets.items()]

    def draw(figure: Figure) -> None:
        axes = figure.subplots()
        for row, (number, colour) in enumerate(zip(shown, (COLOURS[1], COLOURS[0]), strict=True)):
            draw_interval(axes, row, (number.low, number.high), number.value, color=colour, marker="o")
        label_rows(axes, names)
        axes.set_xlabel("time offset [ms]")
        axes.ticklabel_format(axis="x", useOffset=False)
        axes.locator_params(axis="x", nbins=5)

    return draw_chart(
        "offsets",
        "Time offset by orientation and by position",
        "How much later the stream is than its reference, with its 95 % interval. The two are estimated apart. Their "
        "difference is an error of the position along the velocity: positions that are not of the moment of the stamp.",
        f"Time offsets: {'; '.join(f'{name} {number}' for name, number in zip(names, shown, strict=True))}.",
        draw,
        _FRAME_IN + _ROW_IN * len(offsets),
    )


def residuals_chart(report: ValidationReport) -> Chart | None:
    """The errors of each station over time; None without any."""
    series = report.residuals
    if not series:
        return None
    return draw_chart(
        "residuals",
        "Errors of each station over time",
        "Distance of the position (left) and angle of the orientation (right) from the reference, after the "
        "registration. A curve shows the largest error of each short stretch. A gap is a stretch without a reading.",
        f"Errors over time of {', '.join(one.station for one in series)}; the numbers are in the table of accuracy.",
        lambda figure: _draw_residuals(figure, series),
        _FRAME_IN + _SERIES_IN * len(series),
    )


def _draw_residuals(figure: Figure, series: tuple[ResidualSeries, ...]) -> None:
    panels = figure.subplots(len(series), 2, sharex=True, sharey="col", squeeze=False)
    for (left, right), one in zip(panels, series, strict=True):
        _draw_errors(left, one.time_s, 1e3 * one.position_m, COLOURS[1])
        _draw_errors(right, one.time_s, np.degrees(one.angle_rad), COLOURS[0])
        left.set_title(one.station)
    panels[0, 0].set_title(f"{series[0].station}: position [mm]")
    panels[0, 1].set_title("orientation [deg]")
    for axes in panels[-1]:
        axes.set_xlabel("time since the start [s]")


def _draw_errors(axes: Axes, time_s: Floats, values: Floats, colour: str) -> None:
    times, largest = insert_gaps(*largest_of_stretches(time_s, values))
    axes.plot(times, largest, color=colour, linewidth=0.9)
    finite = values[np.isfinite(values)]
    if len(finite):
        axes.axhline(float(np.median(finite)), color=FAINT, linewidth=0.9)
        axes.set_ylim(bottom=0.0)


def largest_of_stretches(time_s: Floats, values: Floats) -> tuple[Floats, Floats]:
    """At most `_MOST_POINTS` times, and the largest value from each to the next; NaN where there is no reading."""
    every = -(-len(time_s) // _MOST_POINTS) if len(time_s) else 1
    starts = np.arange(0, len(time_s), every)
    if not len(starts):
        return time_s, values
    out: Floats = np.fmax.reduceat(values, starts)
    return time_s[starts], out


_REGISTRATION = (
    "These numbers were estimated from the capture and its reference, and taken out before errors were computed. An "
    "error that looks like one of them is therefore here and not in the errors of the stations."
)
_POSES = (
    "The room is the pose of the tracker's frame in the reference's. A mount is the pose of a station on its body, "
    "with the offset of its housing. Below the numbers: 95 % intervals."
)
_DEGREES = math.degrees(1.0)


def validation_page(report: ValidationReport, scores: Mapping[str, Mapping[str, float | None]], command: str) -> Page:
    """The page of a capture that `command` validated; `scores` are errors of methods on it, by method and metric."""
    reasons = [f"{find_quantity(key).label}: {one.reason}" for key, one in report.numbers.items() if one.reason]
    return Page(
        verb="validate",
        name=report.name,
        headline=validation_answer(report),
        lead=[
            Bullets([*report.exchanged, *departure_texts(report.checks)]),
            Prose(" ".join(registration_sentences(report))),
        ],
        facts={
            "Capture": capture_text(report.capture),
            "Reference": report.truth,
            "Damage": " ".join(report.capture.damage),
            "Expected": f"numbers of {report.expected_from}" if report.checks else "",
        },
        sections=[
            Section("Checks", "checks", [departures_table(report.checks)]),
            Section(
                "Registration",
                "registration",
                [
                    *([BrowserOnly([Prose(_REGISTRATION)])] if report.numbers else []),
                    Drawing(partial(offsets_chart, report)),
                    _numbers_table(report),
                    Bullets(reasons, prefix="not measured: "),
                ],
            ),
            Section("Room and mounts", "poses", [_poses_table(report)]),
            Section(
                "Accuracy",
                "accuracy",
                [_accuracy_table(report), Bullets(_accuracy_reasons(report), prefix="not measured: ")],
            ),
            Section("Errors over time", "residuals", [Drawing(partial(residuals_chart, report))], terminal=False),
            Section("Reconstruction", "scores", [_scores_table(scores)]),
            Section(
                "Capture",
                "capture",
                [stretches_table(report.capture.stretches), Bullets([*report.capture.damage, *report.notes])],
            ),
        ],
        command=command,
    )


def validation_answer(report: ValidationReport) -> str:
    """How far the capture is from its reference, and what departs from the expected numbers."""
    errors = _median_text(report)
    departures = departures_sentence(report.name, report.checks, report.expected_from)
    if not errors:
        return departures
    if not report.checks:
        return f"{report.name} lies {errors} from its reference."
    return f"{report.name} lies {errors} from its reference. {departures.replace(report.name, 'It', 1)}"


def _median_text(report: ValidationReport) -> str:
    """Medians over the stations, "2.1 to 3.0 mm and 0.4 to 0.6 deg (median of each station)"."""
    places = [row.position.median.scaled(1e3).value for row in report.accuracy.values()]
    turns = [row.orientation.median.scaled(_DEGREES).value for row in report.accuracy.values()]
    parts = [
        f"{format_range(filter(math.isfinite, values), decimals)} {unit}"
        for values, decimals, unit in ((places, 1, "mm"), (turns, 2, "deg"))
        if any(map(math.isfinite, values))
    ]
    return f"{' and '.join(parts)} (median of each station)" if parts else ""


def registration_sentences(report: ValidationReport) -> list[str]:
    """What was estimated before errors were computed, in short sentences."""
    matched = (
        f"{report.matched_frames:,} of {report.expected_frames:,} frames were matched "
        f"({format_share(report.matched_share, 1)})."
    )
    shown = [
        f"{find_quantity(key).label}: {find_quantity(key).of(one)}"
        for key, one in report.numbers.items()
        if one.is_measured
    ]
    return [matched, *([f"Estimated from the capture: {'; '.join(shown)}."] if shown else [])]


def _numbers_table(report: ValidationReport) -> DataTable:
    """Time offsets, clock, scale and heading errors with their intervals."""
    rows = [[find_quantity(key).label, find_quantity(key).of(one)] for key, one in report.numbers.items()]
    caption = "Below the estimates: 95 % intervals."
    return DataTable(["number", "estimate"], rows, caption=caption, label="registration")


def _poses_table(report: ValidationReport) -> DataTable:
    """Position and orientation of the room and of each mount."""
    rows = [
        [
            f"{pose.name} on {pose.body}" if pose.body else pose.name,
            *(axis.scaled(1e3) for axis in pose.position_m),
            " ".join(format_fixed(float(value), 4) for value in pose.rotation),
            f"± {format_fixed(math.degrees(pose.angle_rad), 2)} deg",
        ]
        for pose in report.poses
    ]
    head = ["pose", *(f"{axis} [mm]" for axis in "xyz"), "quaternion w x y z", "orientation"]
    return DataTable(head, rows, caption=_POSES, intervals_printed=False)


def _accuracy_table(report: ValidationReport) -> DataTable:
    """Errors of each station after the registration."""
    rows = [
        [
            station,
            *(
                number.scaled(factor)
                for of, factor in ((row.position, 1e3), (row.orientation, _DEGREES))
                for number in (of.median, of.rms, of.quantile95)
            ),
            f"{row.readings:,}",
            format_share(row.lost_share, 2),
        ]
        for station, row in report.accuracy.items()
    ]
    figures = [f"{name} [{unit}]" for unit in ("mm", "deg") for name in ("median", "RMS", "95 %")]
    caption = "Errors of each station after the registration. Below the numbers: 95 % intervals."
    return DataTable(["station", *figures, "readings", "lost"], rows, caption=caption, intervals_printed=False)


def _accuracy_reasons(report: ValidationReport) -> list[str]:
    """Why errors of stations were not measured, each reason once with its stations."""
    stations: dict[str, list[str]] = {}
    for station, row in report.accuracy.items():
        for reason in dict.fromkeys((row.position.rms.reason, row.orientation.rms.reason)):
            if reason:
                stations.setdefault(reason, []).append(station)
    return [f"{', '.join(names)}: {reason}" for reason, names in stations.items()]


def _scores_table(scores: Mapping[str, Mapping[str, float | None]]) -> DataTable:
    """A row for each method, a column for each metric."""
    metrics = list(dict.fromkeys(metric for values in scores.values() for metric in values))
    rows = [
        [method, *(format_number(values.get(metric), DEFINITIONS[metric].unit) for metric in metrics)]
        for method, values in scores.items()
    ]
    return DataTable(["method", *map(metric_label, metrics)], rows, caption="Errors of methods on this capture.")
