"""Whether errors have the expected order of a paper, for the terminal and for the page; nothing without one."""

from collections.abc import Mapping, Sequence
from itertools import groupby, pairwise
from typing import Any

from harness.core.number_format import NOT_MEASURED, format_fixed
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, bullet_list, join, tag
from harness.report.kit.table import count_note, html_table
from harness.results.cell import varied_text
from harness.results.expected_orders import DECIMALS, METRIC

_MEAN_NOTE = "means over the clips on which all were measured"
_VERDICT = {True: "holds", False: "does not hold", None: "not judged"}


def text(summary: Mapping[str, Any]) -> list[str]:
    """For each order a line for each setting, for the terminal."""
    lines = [f"expected orders: {METRIC}, {_MEAN_NOTE}"]
    for title, rows in _by_order(summary):
        lines += ["", title, *map(_line, rows), *(f"  where {reason}" for reason in _reasons(rows))]
    return [*lines, ""] if len(lines) > 1 else []


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
    words = _setting_words(row)
    if row["clips_of_any"]:
        words.append(f"{_clips(row)} {'clip' if row['clips_of_any'] == 1 else 'clips'}")
    where = f" ({', '.join(words)})" if words else ""
    if row["means_deg"] is None:
        return f"  {_verdict(row)}{where}"
    errors = _format_means(row)
    signs = ["", *(f" {_comparison_sign(*pair)} " for pair in pairwise(errors))]
    parts = [f"{sign}{name} {error}" for sign, name, error in zip(signs, row["names"], errors, strict=True)]
    return f"  {''.join(parts)}: {_verdict(row)}{where}"


def _table(title: str, rows: Sequence[Mapping[str, Any]]) -> Markup:
    lines = []
    for row in rows:
        errors = _format_means(row) or [NOT_MEASURED] * len(row["names"])
        setting = join(", ".join(_setting_words(row)) or "everywhere", count_note(_clips(row)))
        lines.append([setting, *errors, _verdict(row)])
    caption = join("Expected: ", tag("b", title), f". {METRIC} [deg], {_MEAN_NOTE} (n).")
    table = Table(["setting", *rows[0]["names"], "order"], lines)
    reasons = [f"Where {reason}" for reason in _reasons(rows)]
    return join(html_table(table, caption, label="expected order"), bullet_list(reasons, class_=None))


def _verdict(row: Mapping[str, Any]) -> str:
    return _VERDICT[row["holds"]] + (f": {row['why'][0]}" if row["holds"] is None else "")


def _reasons(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """The reasons that the scenario gives for orders that do not hold, each once."""
    return list(dict.fromkeys(reason for row in rows if row["holds"] is False for reason in row["why"]))


def _setting_words(row: Mapping[str, Any]) -> list[str]:
    """Behaviour, inputs, performers and varied values, those that there are."""
    words = (row["behaviour"].replace("_", " "), row["inputs"], row["performer"] and f"{row['performer']} performers")
    return [word for word in (*words, varied_text(row["varied"])) if word]


def _clips(row: Mapping[str, Any]) -> str:
    return f"{row['clips']} of {row['clips_of_any']}" if row["clips"] < row["clips_of_any"] else f"{row['clips']}"


def _format_means(row: Mapping[str, Any]) -> list[str]:
    return [format_fixed(mean, DECIMALS) for mean in row["means_deg"] or []]


def _comparison_sign(first: str, second: str) -> str:
    return "<" if float(first) < float(second) else "=" if first == second else ">"
