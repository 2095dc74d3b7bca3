"""Columns of text tables: metrics of methods, and the scores of the standard deviations that methods state."""

from collections.abc import Mapping, Sequence

from harness.core.number_format import format_fixed
from harness.core.text_table import Table
from harness.results import PRIMARY_METRIC, SECONDARY_METRIC

TABLE_COLUMNS = (
    ("joint angle [deg]", PRIMARY_METRIC, 2),
    ("rotation [deg]", "mpjre_deg", 2),
    ("position [mm]", SECONDARY_METRIC, 1),
    ("jitter [m/s3]", "jitter_m_s3", 0),
    ("step p50 [ms]", "step_p50_ms", 2),
)
"""Columns of the text table of a run: title, metric and decimals."""
SIGMA_TITLE = "standard deviations that methods state for hinge angles, pooled over frames and hinges"
SIGMA_COLUMNS = (
    ("within 1 sigma [%]", "sigma_coverage_1", 1, 100.0),
    ("within 95 % region [%]", "sigma_coverage_95", 1, 100.0),
    ("lowest hinge, 1 sigma [%]", "sigma_lowest_coverage_1", 1, 100.0),
    ("mean sigma [deg]", "sigma_width_deg", 2, 1.0),
    ("log score [nat]", "sigma_log_score", 2, 1.0),
)
"""Columns: title, score, decimals and factor."""


def format_sigma_scores(scores: Mapping[str, float]) -> list[str]:
    """The scores as texts, in the order of `SIGMA_COLUMNS`; "-" for one that an earlier version did not write."""
    return [
        format_fixed(factor * scores[name], decimals) if name in scores else "-"
        for _, name, decimals, factor in SIGMA_COLUMNS
    ]


def sigma_lines(head: Sequence[str], rows: Sequence[tuple[Sequence[str], Mapping[str, float]]]) -> list[str]:
    """A title and a table with a row for each method that states standard deviations; nothing if none does.

    A row is its first cells, under the titles `head`, and its scores.
    """
    cells = [[*first, *format_sigma_scores(scores)] for first, scores in rows if scores]
    if not cells:
        return []
    table = Table([*head, *(title for title, *_ in SIGMA_COLUMNS)], cells, text_columns=len(head))
    return ["", SIGMA_TITLE, *table.lines()]
