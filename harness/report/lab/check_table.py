"""The table of checks: measured and expected numbers with their p-values."""

from collections.abc import Sequence

from harness.core.number_format import format_p_value
from harness.core.text_table import Table
from harness.report.lab.quantities import format_ends, format_plain, format_value, quantity
from harness.report.lab.stacked_intervals import INTERVAL
from harness.report.lab.unit_content import DepartureCheck

ALL_STATIONS = "all"


def departures_table(checks: Sequence[DepartureCheck], most: int | None = None) -> Table:
    """Measured and expected numbers of checks, the least likely first; at most so many rows."""
    rows = []
    for check in sorted(checks, key=lambda check: (check.p_holm, check.departure.p))[:most]:
        one = check.departure
        shown = quantity(one.key)
        rows.append(
            [
                shown.label,
                one.station or ALL_STATIONS,
                format_value(one.measured, shown),
                format_ends(one.measured, shown),
                format_plain(one.expected.value, shown),
                format_p_value(one.p),
                format_p_value(check.p_holm),
            ]
        )
    return Table(["number", "station", "measured", INTERVAL, "expected", "p", "p (Holm)"], rows, 2)
