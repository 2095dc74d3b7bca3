"""A measured unit as text for the terminal: its faults first, then tables."""

from harness.core.text_table import Table
from harness.report.lab.check_table import departures_table
from harness.report.lab.departure_wording import condense_departures, departure_text
from harness.report.lab.unit_content import UnitReport
from harness.report.lab.unit_tables import (
    capture_text,
    episodes_table,
    pair_table,
    parameters_table,
    reasons,
    stations_table,
    stretches_table,
)
from harness.report.lab.unit_wording import advice_text, answer, description

_WIDTH, _MOST_CHECKS = 118, 8


def format_unit(report: UnitReport) -> str:
    """The text of a measured unit; parts without content are left out."""
    lines = [
        answer(report),
        *(f"- {departure_text(check)}" for check in condense_departures(report.checks)),
        *description(report),
    ]
    lines += ["", capture_text(report.capture), *(f"damage: {text}" for text in report.capture.damage)]
    lines += _part("", stretches_table(report.capture))
    lines += _part("error model", parameters_table(report.parameters))
    lines += _part("clock and records", parameters_table(report.timing))
    lines += [f"not measured: {text}" for text in reasons((*report.parameters, *report.timing))]
    lines += _part("stations", stations_table(report.stations))
    lines += _part("episodes", episodes_table(report.episodes) if report.episodes else Table([], []))
    for pair in report.rigid_pairs:
        lines += _part("stations on a bar", pair_table(pair))
    shown = max(_MOST_CHECKS, len(report.departures))
    title = f"checks against {report.expected_from}, the least likely of {len(report.checks)} first"
    lines += _part(title, departures_table(report.checks, shown))
    if report.advice:
        lines += ["", "how long to record", *(f"- {advice_text(one)}" for one in report.advice)]
    if report.notes:
        lines += ["", *(f"note: {text}" for text in report.notes)]
    return "\n".join(lines)


def _part(title: str, table: Table) -> list[str]:
    """A title and a table; nothing without rows."""
    if not table.rows:
        return []
    return ["", *([title] if title else []), *(line for row in table.wrapped_rows(_WIDTH, (0,)) for line in row)]
