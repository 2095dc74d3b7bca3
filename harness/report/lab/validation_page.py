"""The page of a validated capture: how far it is from its reference, then the registration, then each station."""

from collections.abc import Mapping
from pathlib import Path

from harness.core.files import write_text
from harness.core.number_format import count_noun
from harness.core.text_table import Table
from harness.report.kit.document import Section, chart_figure, document
from harness.report.kit.markup import Markup, bullet_list, details, join, tag
from harness.report.kit.style import Chart
from harness.report.kit.table import html_table
from harness.report.lab.check_table import departures_table
from harness.report.lab.departure_wording import condense_departures, departure_text
from harness.report.lab.stacked_intervals import stack_intervals
from harness.report.lab.unit_tables import capture_text, stretches_table
from harness.report.lab.validation_charts import charts
from harness.report.lab.validation_content import ValidationReport
from harness.report.lab.validation_tables import (
    accuracy_reasons,
    accuracy_table,
    number_reasons,
    numbers_table,
    poses_table,
    scores_table,
)
from harness.report.lab.validation_wording import registration_sentences, validation_answer

_FEWEST_CHECKS = 5
"""Checks that are shown where none is a departure."""
_REGISTRATION = (
    "These numbers were estimated from the capture and its reference, and taken out before errors were computed. An "
    "error that looks like one of them is therefore here and not in the errors of the stations."
)
_POSES = (
    "The room is the pose of the tracker's frame in the reference's. A mount is the pose of a station on its body, "
    "with the offset of its housing. Below the numbers: 95 % intervals."
)
_ACCURACY = "Errors of each station after the registration. Below the numbers: 95 % intervals."


def write_validation_page(path: Path, report: ValidationReport) -> Path:
    """Write the page to `path` and return it; its folder is created."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, validation_page(report, charts(report)))
    return path


def validation_page(report: ValidationReport, drawn: Mapping[str, Chart]) -> str:
    """The HTML of the page, with the charts of `validation_charts.charts`."""
    facts = {
        "Capture": capture_text(report.capture),
        "Reference": report.truth,
        "Damage": " ".join(report.capture.damage),
        "Expected": f"numbers of {report.expected_from}" if report.checks else "",
    }
    sections: list[Section] = [
        ("Checks", "checks", _checks(report)),
        ("Registration", "registration", _registration(report, drawn)),
        ("Room and mounts", "poses", _table(poses_table(report), _POSES, "room and mounts")),
        ("Accuracy", "accuracy", _accuracy(report)),
        ("Errors over time", "residuals", chart_figure(drawn["residuals"]) if "residuals" in drawn else Markup()),
        ("Reconstruction", "scores", _table(scores_table(report), "Errors of methods on this capture.", "scores")),
        ("Capture", "capture", _capture(report)),
        ("Made by", "command", tag("pre", tag("code", report.command))),
    ]
    return document(
        title=f"{report.name}: harness validate",
        kicker="harness validate",
        heading=validation_answer(report),
        facts={title: text for title, text in facts.items() if text},
        sections=sections,
        lead=_lead(report),
    )


def _lead(report: ValidationReport) -> Markup:
    faults = bullet_list([*report.exchanged, *(departure_text(check) for check in condense_departures(report.checks))])
    return join(faults, tag("p", " ".join(registration_sentences(report))))


def _checks(report: ValidationReport) -> Markup:
    if not report.checks:
        return Markup()
    shown = len(report.departures) or _FEWEST_CHECKS
    table = html_table(
        stack_intervals(departures_table(report.checks, shown)),
        "The least likely first. Below the numbers: 95 % intervals. A departure has a p of at most 0.05 after Holm's "
        "correction.",
        label="checks",
    )
    if shown >= len(report.checks):
        return table
    every = html_table(stack_intervals(departures_table(report.checks)), "The least likely first.", label="all checks")
    return join(table, details(f"All {count_noun(len(report.checks), 'check')}", every))


def _registration(report: ValidationReport, drawn: Mapping[str, Chart]) -> Markup:
    if not report.numbers:
        return Markup()
    chart = chart_figure(drawn["registration"]) if "registration" in drawn else None
    table = _table(numbers_table(report), "Below the estimates: 95 % intervals.", "registration")
    return join(tag("p", _REGISTRATION), chart, table, bullet_list(number_reasons(report)))


def _accuracy(report: ValidationReport) -> Markup:
    return join(_table(accuracy_table(report), _ACCURACY, "accuracy"), bullet_list(accuracy_reasons(report)))


def _table(table: Table, caption: str, label: str) -> Markup:
    """A table with its intervals below the numbers; nothing without rows."""
    return html_table(stack_intervals(table), caption, label=label) if table.rows else Markup()


def _capture(report: ValidationReport) -> Markup:
    stretches = _table(stretches_table(report.capture), "Parts of the capture.", "stretches")
    return join(stretches, bullet_list([*report.capture.damage, *report.notes]))
