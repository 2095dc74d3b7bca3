"""What a scenario expects of its run: the orders of methods that a paper states, and recovery from disturbances."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from harness.compare.run_summary import DECIMALS, MAX_RECOVERED_RATIO, SETTLING_S, WINDOW_S, tabulate_recovery
from harness.core.number_format import NOT_MEASURED, format_fixed, format_share
from harness.report.kit.page import Block, Bullets, DataTable, Prose, TerminalOnly
from harness.results import PRIMARY_METRIC, setting_text

_MEANS = "means over the clips on which all were measured"
_VERDICT = {True: "holds", False: "does not hold", None: "not judged"}
_RECOVERY = (
    "joint angle error divided by that of the undisturbed run over the same frames; first during the disturbance, then "
    f"over the {WINDOW_S:g} s that begin {SETTLING_S:g} s after its last bad frame; mean over clips (worst clip); a "
    f"ratio above {MAX_RECOVERED_RATIO:g} is not recovered. Status right: the lowest share of frames, from the first "
    "bad one on, whose status is the expected one: SOLVED with at least half of the stations, else HELD, and LOST "
    "after 0.5 s."
)
_TOO_SHORT = f"{NOT_MEASURED}: too short"


def expected_orders(summary: Mapping[str, Any]) -> list[Block]:
    """A table for each order with a row for each setting, and why orders do not hold; nothing without one."""
    blocks: list[Block] = []
    for title, group in groupby(summary.get("expected_orders", []), key=_order_title):
        rows = list(group)
        cells = [[_setting(row), *_format_means(row), _verdict(row)] for row in rows]
        caption = f"{PRIMARY_METRIC} [deg], {_MEANS} (n)."
        table = DataTable(["setting", *rows[0]["names"], "order"], cells, f"Expected: {title}.", caption)
        reasons = dict.fromkeys(reason for row in rows if row["holds"] is False for reason in row["why"])
        blocks += [table, Bullets([f"Where {reason}" for reason in reasons], prefix="  ")]
    return [TerminalOnly([Prose(f"expected orders: {PRIMARY_METRIC}, {_MEANS} (n)")]), *blocks] if blocks else []


def _order_title(row: Mapping[str, Any]) -> str:
    whose = f"{row['method']} with " if row["method"] else ""
    return f"{whose}{' < '.join(row['names'])} ({row['source']})"


def _setting(row: Mapping[str, Any]) -> str:
    """Behaviour, inputs, performers and values that vary, those that there are, and the number of clips."""
    words = (row["behaviour"].replace("_", " "), row["inputs"], row["performer"] and f"{row['performer']} performers")
    setting = ", ".join(filter(None, (*words, setting_text(row)))) or "everywhere"
    of_any = f" of {row['clips_of_any']}" if row["clips"] < row["clips_of_any"] else ""
    return f"{setting} n\u00a0{row['clips']}{of_any}"


def _format_means(row: Mapping[str, Any]) -> list[str]:
    return [format_fixed(mean, DECIMALS) for mean in row["means_deg"] or [None] * len(row["names"])]


def _verdict(row: Mapping[str, Any]) -> str:
    return _VERDICT[row["holds"]] + (f": {row['why'][0]}" if row["holds"] is None else "")


def recovery_table(summary: Mapping[str, Any]) -> DataTable:
    """A row for each method, a column for each kind of disturbance; no rows without recoveries."""
    recoveries: Sequence[Mapping[str, Any]] = tabulate_recovery(summary.get("recovery", []))
    kinds = list(dict.fromkeys(kind for row in recoveries for kind in row["after"]))
    inputs = ["inputs"] if len({row["inputs"] for row in recoveries}) > 1 else []
    rows = []
    for row in recoveries:
        names = [row["method"], *(row[name] for name in inputs), row["split"], str(row["clips"])]
        undisturbed, right = row["undisturbed_deg"], row["status_right"]
        first = _TOO_SHORT if undisturbed is None else format_fixed(undisturbed, 2)
        last = _TOO_SHORT if right is None else format_share(right, 2)
        rows.append([*names, first, *(_format_ratio(row["after"].get(kind)) for kind in kinds), last])
    head = ["method", *inputs, "split", "clips", "undisturbed [deg]", *kinds, "status right"]
    return DataTable(head, rows, "Recovery:", _RECOVERY, label="recovery", caption_printed=True)


def _format_ratio(after: Mapping[str, Any] | None) -> str:
    if after is None:
        return _TOO_SHORT
    mark = "" if after["ratio"] <= MAX_RECOVERED_RATIO else " FAIL"
    return f"{after['during']:.2f}, then {after['ratio']:.2f} ({after['worst']:.2f}){mark}"
