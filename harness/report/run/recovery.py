"""How methods get over disturbances, for the terminal and for the page; nothing when a run has none."""

from collections.abc import Mapping
from typing import Any

from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.markup import table as page_table
from harness.results.recovery import MAX_RECOVERED_RATIO, SETTLING_S, WINDOW_S, tabulate_recovery

_CAPTION = (
    "joint angle error divided by the undisturbed run's over the same frames: while the disturbance lasts, then over "
    f"the {WINDOW_S:g} s that begins {SETTLING_S:g} s after its last bad frame"
)
_STATISTIC_NOTE = f"mean over clips (worst clip); above {MAX_RECOVERED_RATIO:g} is not recovered"


_UNKNOWN = "not measured: too short"


def table_rows(summary: Mapping[str, Any]) -> list[list[str]]:
    """The table's cells, head first; empty without recoveries."""
    rows = tabulate_recovery(summary.get("recovery", []))
    if not rows:
        return []
    kinds = list(dict.fromkeys(kind for row in rows for kind in row["after"]))
    inputs = ["inputs"] if len({row["inputs"] for row in rows}) > 1 else []
    found = [["method", *inputs, "split", "clips", "undisturbed [deg]", *kinds, "status right"]]
    for row in rows:
        ratios = [_format_ratio(row["after"].get(kind)) for kind in kinds]
        names = [row["method"], *(row[name] for name in inputs), row["split"], str(row["clips"])]
        found.append(
            [
                *names,
                _format_value(row["undisturbed_deg"], 1.0, ""),
                *ratios,
                _format_value(row["status_right"], 100.0, " %"),
            ]
        )
    return found


def text(summary: Mapping[str, Any]) -> list[str]:
    """Lines for the terminal."""
    found = table_rows(summary)
    if not found:
        return []
    widths = [max(len(line[i]) for line in found) for i in range(len(found[0]))]
    aligned = ["  ".join(word.ljust(width) for word, width in zip(line, widths, strict=True)) for line in found]
    return [f"recovery: {_CAPTION};", _STATISTIC_NOTE, "", *(line.rstrip() for line in aligned), ""]


def section(summary: Mapping[str, Any]) -> Markup:
    """The same for the page."""
    found = table_rows(summary)
    if not found:
        return Markup()
    head, *rows = found
    caption = join(
        tag("b", "Recovery"),
        f": {_CAPTION}; {_STATISTIC_NOTE}. Status right: the least share of frames, from the first bad one on, whose status is what "
        "the readings call for (SOLVED with half of the stations, else HELD, LOST after 0.5 s).",
    )
    return page_table(caption, head, rows, label="recovery")


def _format_ratio(after: Mapping[str, Any] | None) -> str:
    if after is None:
        return _UNKNOWN
    mark = "" if after["ratio"] <= MAX_RECOVERED_RATIO else " FAIL"
    return f"{after['during']:.2f}, then {after['ratio']:.2f} ({after['worst']:.2f}){mark}"


def _format_value(value: float | None, times: float, unit: str) -> str:
    return _UNKNOWN if value is None else f"{times * value:.2f}{unit}"
