"""A validated capture in words: its errors and faults first, then the registration."""

import math

from harness.core.number_format import format_fixed, format_share
from harness.report.lab.departure_wording import departures_sentence
from harness.report.lab.quantities import format_both, quantity
from harness.report.lab.validation_content import ValidationReport


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
    """Medians over the stations, "2.1 to 3.0 mm and 0.4 to 0.6 deg (median)"."""
    millimetres = [1e3 * row.position_median_m.value for row in report.accuracy if row.position_median_m.is_measured]
    degrees = [
        math.degrees(row.orientation_median_rad.value)
        for row in report.accuracy
        if row.orientation_median_rad.is_measured
    ]
    parts = [
        f"{_range(values, decimals)} {unit}"
        for values, decimals, unit in ((millimetres, 1, "mm"), (degrees, 2, "deg"))
        if values
    ]
    return f"{' and '.join(parts)} (median of each station)" if parts else ""


def _range(values: list[float], decimals: int) -> str:
    low, high = (format_fixed(value, decimals) for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def registration_sentences(report: ValidationReport) -> list[str]:
    """What was estimated before errors were computed, in short sentences."""
    matched = (
        f"{report.matched_frames:,} of {report.expected_frames:,} frames were matched "
        f"({format_share(report.matched_share, 1)})."
    )
    shown = [
        f"{quantity(one.key).label}: {format_both(one.measured, quantity(one.key))}"
        for one in report.numbers
        if not one.station and one.measured.is_measured
    ]
    estimated = f"Estimated from the capture: {'; '.join(shown)}." if shown else ""
    return [text for text in (matched, estimated) if text]
