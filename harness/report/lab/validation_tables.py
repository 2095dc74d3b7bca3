"""The tables of a validated capture, for its page and for the terminal."""

import math

from harness.core.interval import Interval
from harness.core.number_format import format_fixed, format_number, format_share
from harness.core.text_table import Table
from harness.report.kit.metric_labels import metric_label
from harness.report.lab.check_table import ALL_STATIONS
from harness.report.lab.quantities import Quantity, format_ends, format_value, quantity
from harness.report.lab.stacked_intervals import INTERVAL
from harness.report.lab.validation_content import ROOM, ValidationReport
from harness.score.metrics import DEFINITIONS

_LENGTH, _ANGLE = Quantity("", "", 1e3), Quantity("", "", math.degrees(1.0))


def numbers_table(report: ValidationReport) -> Table:
    """Time offsets, clock, scale and heading errors with their intervals."""
    rows = [
        [
            quantity(one.key).label,
            one.station or ALL_STATIONS,
            format_value(one.measured, quantity(one.key)),
            format_ends(one.measured, quantity(one.key)),
        ]
        for one in report.numbers
    ]
    return Table(["number", "station", "estimate", INTERVAL], rows, 2)


def number_reasons(report: ValidationReport) -> list[str]:
    """Why numbers of the registration were not measured."""
    return [f"{quantity(one.key).label}: {one.measured.reason}" for one in report.numbers if one.measured.reason]


def poses_table(report: ValidationReport) -> Table:
    """Position and orientation of the room and of each mount."""
    rows = []
    for pose in report.poses:
        name = pose.name if pose.name == ROOM or not pose.body else f"{pose.name} on {pose.body}"
        quaternion = " ".join(format_fixed(float(value), 4) for value in pose.rotation)
        angle = f"± {format_fixed(math.degrees(pose.angle_rad), 2)} deg"
        rows.append([name, *(cell for axis in pose.position_m for cell in _both(axis, _LENGTH)), quaternion, angle])
    head = [
        "pose",
        *(cell for axis in "xyz" for cell in (f"{axis} [mm]", INTERVAL)),
        "quaternion w x y z",
        "orientation",
    ]
    return Table(head, rows)


def accuracy_table(report: ValidationReport) -> Table:
    """Errors of each station after the registration."""
    rows = [
        [
            row.station,
            *_both(row.position_median_m, _LENGTH),
            *_both(row.position_rms_m, _LENGTH),
            *_both(row.position_95_m, _LENGTH),
            *_both(row.orientation_median_rad, _ANGLE),
            *_both(row.orientation_rms_rad, _ANGLE),
            *_both(row.orientation_95_rad, _ANGLE),
            f"{row.readings:,}",
            format_share(row.lost_share, 2),
        ]
        for row in report.accuracy
    ]
    figures = [f"{name} [{unit}]" for unit in ("mm", "deg") for name in ("median", "RMS", "95 %")]
    head = ["station", *(cell for figure in figures for cell in (figure, INTERVAL)), "readings", "lost"]
    return Table(head, rows)


def accuracy_reasons(report: ValidationReport) -> list[str]:
    """Why errors of stations were not measured, each reason once with its stations."""
    stations: dict[str, list[str]] = {}
    for row in report.accuracy:
        for reason in dict.fromkeys((row.position_rms_m.reason, row.orientation_rms_rad.reason)):
            if reason:
                stations.setdefault(reason, []).append(row.station)
    return [f"{', '.join(names)}: {reason}" for reason, names in stations.items()]


def _both(number: Interval, shown: Quantity) -> list[str]:
    return [format_value(number, shown), format_ends(number, shown)]


def without_intervals(table: Table) -> Table:
    """The table without its columns of intervals, for a terminal."""
    kept = [n for n, head in enumerate(table.head) if head != INTERVAL]
    return Table([table.head[n] for n in kept], [[row[n] for n in kept] for row in table.rows], table.text_columns)


def scores_table(report: ValidationReport) -> Table:
    """A row for each method, a column for each metric."""
    metrics = list(dict.fromkeys(one.metric for one in report.scores))
    methods = list(dict.fromkeys(one.method for one in report.scores))
    values = {(one.method, one.metric): one.value for one in report.scores}
    rows = [
        [method, *(format_number(values.get((method, metric)), _unit(metric)) for metric in metrics)]
        for method in methods
    ]
    return Table(["method", *(metric_label(metric) if metric in DEFINITIONS else metric for metric in metrics)], rows)


def _unit(metric: str) -> str:
    return DEFINITIONS[metric].unit if metric in DEFINITIONS else ""
