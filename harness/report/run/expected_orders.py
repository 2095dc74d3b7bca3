"""Whether errors come in the orders that papers expect, for the terminal and for the page; nothing without any."""

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from typing import Any

from harness.report.kit.markup import Markup, join, table, tag
from harness.report.run.tables import format_count
from harness.results.cell import varied_text
from harness.results.expected_orders import DECIMALS, METRIC

_MEAN_NOTE = "means over the clips that all of them were measured on"
_VERDICT = {True: "holds", False: "does not hold", None: "not judged"}


def text(summary: Mapping[str, Any]) -> list[str]:
    """Lines for the terminal."""
    found = [f"expected orders: {METRIC}, {_MEAN_NOTE}"]
    for title, rows in _by_order(summary):
        found += ["", title, *map(_line, rows), *(f"  where {reason}" for reason in _reasons(rows))]
    return [*found, ""] if len(found) > 1 else []


def section(summary: Mapping[str, Any]) -> Markup:
    """A table for each order, a row for each setting."""
    return join(*(_table(title, rows) for title, rows in _by_order(summary)))


def _by_order(summary: Mapping[str, Any]) -> list[tuple[str, list[Mapping[str, Any]]]]:
    groups = groupby(summary.get("expected_orders", []), key=_title)
    return [(title, list(rows)) for title, rows in groups]


def _title(row: Mapping[str, Any]) -> str:
    whose = f"{row['method']} with " if row["method"] else ""
    return f"{whose}{' < '.join(row['names'])} ({row['source']})"


def _line(row: Mapping[str, Any]) -> str:
    words = [
        *_setting_words(row),
        *([f"{_clips(row)} clip{'s'[: row['clips_of_any'] != 1]}"] if row["clips_of_any"] else []),
    ]
    where = f" ({', '.join(words)})" if words else ""
    if row["means_deg"] is None:
        return f"  {_verdict(row)}{where}"
    errors = _format_means(row)
    signs = ["", *(f" {_comparison_sign(*pair)} " for pair in pairwise(errors))]
    said = "".join(f"{sign}{name} {error}" for sign, name, error in zip(signs, row["names"], errors, strict=True))
    return f"  {said}: {_verdict(row)}{where}"


def _table(title: str, rows: Sequence[Mapping[str, Any]]) -> Markup:
    lines = []
    for row in rows:
        errors = _format_means(row) or ["not measured"] * len(row["names"])
        setting = join(", ".join(_setting_words(row)) or "everywhere", format_count(_clips(row)))
        lines.append([setting, *errors, _verdict(row)])
    caption = join("Expected: ", tag("b", title), f". {METRIC} [deg], {_MEAN_NOTE} (n).")
    reasons = [tag("li", f"Where {reason}") for reason in _reasons(rows)]
    body = table(caption, ["setting", *rows[0]["names"], "order"], lines, label="expected order")
    return join(body, tag("ul", *reasons) if reasons else None)


def _verdict(row: Mapping[str, Any]) -> str:
    return _VERDICT[row["holds"]] + (f": {row['why'][0]}" if row["holds"] is None else "")


def _reasons(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Why it does not hold: each reason once, however often it is called for."""
    return list(dict.fromkeys(reason for row in rows if row["holds"] is False for reason in row["why"]))


def _setting_words(row: Mapping[str, Any]) -> list[str]:
    """The setting in words."""
    named = (row["behaviour"].replace("_", " "), row["inputs"], row["performer"] and f"{row['performer']} performers")
    return [word for word in (*named, varied_text(row["varied"])) if word]


def _clips(row: Mapping[str, Any]) -> str:
    return f"{row['clips']} of {row['clips_of_any']}" if row["clips"] < row["clips_of_any"] else f"{row['clips']}"


def _format_means(row: Mapping[str, Any]) -> list[str]:
    return [f"{mean:.{DECIMALS}f}" for mean in row["means_deg"] or []]


def _comparison_sign(one: str, next_one: str) -> str:
    return "<" if float(one) < float(next_one) else "=" if one == next_one else ">"
