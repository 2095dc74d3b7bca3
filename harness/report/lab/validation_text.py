"""A validated capture as text for the terminal: the answer first, then tables."""

from harness.core.text_table import Table
from harness.report.lab.check_table import departures_table
from harness.report.lab.departure_wording import condense_departures, departure_text
from harness.report.lab.unit_tables import capture_text
from harness.report.lab.validation_content import ValidationReport
from harness.report.lab.validation_tables import (
    accuracy_reasons,
    accuracy_table,
    number_reasons,
    numbers_table,
    poses_table,
    scores_table,
    without_intervals,
)
from harness.report.lab.validation_wording import registration_sentences, validation_answer

_WIDTH = 118


def format_validation(report: ValidationReport) -> str:
    """The text of a validated capture; parts without content are left out."""
    lines = [validation_answer(report), *(f"- {text}" for text in report.exchanged)]
    lines += [f"- {departure_text(check)}" for check in condense_departures(report.checks)]
    lines += [*registration_sentences(report), "", capture_text(report.capture), f"reference: {report.truth}"]
    lines += [f"damage: {text}" for text in report.capture.damage]
    for title, table, reasons in (
        ("registration", numbers_table(report), number_reasons(report)),
        ("room and mounts", without_intervals(poses_table(report)), []),
        ("accuracy", without_intervals(accuracy_table(report)), accuracy_reasons(report)),
        ("reconstruction", scores_table(report), []),
        (f"checks against {report.expected_from}", departures_table(report.checks), []),
    ):
        lines += [*_part(title, table), *(f"not measured: {text}" for text in reasons)]
    return "\n".join([*lines, *([""] if report.notes else []), *(f"note: {text}" for text in report.notes)])


def _part(title: str, table: Table) -> list[str]:
    """A title and a table; nothing without rows."""
    if not table.rows:
        return []
    return ["", title, *(line for row in table.wrapped_rows(_WIDTH, (0,)) for line in row)]
