"""How methods recover from disturbances, for the terminal and for the page; nothing when a run has none."""

from collections.abc import Mapping
from typing import Any

from harness.core.number_format import NOT_MEASURED, format_fixed, format_share
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.table import html_table
from harness.results.recovery import MAX_RECOVERED_RATIO, SETTLING_S, WINDOW_S, tabulate_recovery

_CAPTION = (
    "joint angle error divided by that of the undisturbed run over the same frames; first during the disturbance, then "
    f"over the {WINDOW_S:g} s that begin {SETTLING_S:g} s after its last bad frame"
)
_STATISTIC_NOTE = f"mean over clips (worst clip); a ratio above {MAX_RECOVERED_RATIO:g} is not recovered"
_STATUS_NOTE = (
    "Status right: the lowest share of frames, from the first bad one on, whose status is the expected one: "
    "SOLVED with at least half of the stations, else HELD, and LOST after 0.5 s"
)
_TOO_SHORT = f"{NOT_MEASURED}: too short"


def recovery_table(summary: Mapping[str, Any]) -> Table | None:
    """A row for each method, a column for each kind of disturbance; None without recoveries."""
    recoveries = tabulate_recovery(summary.get("recovery", []))
    if not recoveries:
        return None
    kinds = list(dict.fromkeys(kind for row in recoveries for kind in row["after"]))
    inputs = ["inputs"] if len({row["inputs"] for row in recoveries}) > 1 else []
    head = ["method", *inputs, "split", "clips", "undisturbed [deg]", *kinds, "status right"]
    rows = []
    for row in recoveries:
        names = [row["method"], *(row[name] for name in inputs), row["split"], str(row["clips"])]
        undisturbed, right = row["undisturbed_deg"], row["status_right"]
        first = _TOO_SHORT if undisturbed is None else format_fixed(undisturbed, 2)
        last = _TOO_SHORT if right is None else format_share(right, 2)
        rows.append([*names, first, *(_format_ratio(row["after"].get(kind)) for kind in kinds), last])
    return Table(head, rows, text_columns=len(head))


def text(summary: Mapping[str, Any]) -> list[str]:
    """The table as lines for the terminal."""
    table = recovery_table(summary)
    return [f"recovery: {_CAPTION};", _STATISTIC_NOTE, "", *table.lines(), ""] if table else []


def section(summary: Mapping[str, Any]) -> Markup:
    """The table for the page."""
    table = recovery_table(summary)
    caption = join(tag("b", "Recovery"), f": {_CAPTION}; {_STATISTIC_NOTE}. {_STATUS_NOTE}.")
    return html_table(table, caption, label="recovery") if table else Markup()


def _format_ratio(after: Mapping[str, Any] | None) -> str:
    if after is None:
        return _TOO_SHORT
    mark = "" if after["ratio"] <= MAX_RECOVERED_RATIO else " FAIL"
    return f"{after['during']:.2f}, then {after['ratio']:.2f} ({after['worst']:.2f}){mark}"
