"""The tables of a run as text for the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from harness.core.estimate import name_with_lag
from harness.core.number_format import count_noun, format_fixed, format_mean_sd, format_share
from harness.core.stream_health import describe_line_loss, poor_hearing
from harness.core.text_table import Table
from harness.report.kit.page_text import block_lines
from harness.report.kit.text import last_line, name_motion
from harness.report.run.calibration import calibration_tables
from harness.report.run.data import note_of
from harness.report.run.expectations import expected_orders, recovery_table
from harness.report.run.metric_columns import TABLE_COLUMNS, sigma_lines
from harness.report.run.ranking import describe_rankings
from harness.results import MAX_FALLBACK_SHARE, PRIMARY_METRIC, SECONDARY_METRIC, lag_of, varied_text

MOST_ROWS = 12
"""Rows of the short table of a run: about what a terminal shows without scrolling."""
_WIDTH = 160
"""Most characters of a line of the tables below the first one."""
_SHORT_COLUMNS = (PRIMARY_METRIC, SECONDARY_METRIC, "jitter_m_s3", "step_p50_ms")
"""Metrics of the short table, which fits into 100 characters."""


def run_table(summary: Mapping[str, Any], *, short: bool = False) -> str:
    """The text of a run: what its cells share, the rows, the ranking, and what failed.

    There is a row for each method, behaviour and condition. With `short` a run of more than 12 such rows gets a row for
    each method and condition instead, over all behaviours, lowest error first, and at most 12 of them. A row has the
    mean and the standard deviation over sequences, and how many frames were matched.
    """
    cells = summary["cells"]
    finished = f"cells finished {summary['cells_finished']} of {summary['cells_planned']}"
    failed = [f"FAILED {cell}: {last_line(text)}" for cell, text in summary["failures"].items()]
    if not cells:
        return "\n".join(["nothing was measured", finished, *failed])
    blocks = [*calibration_tables(summary), recovery_table(summary), *expected_orders(summary)]
    pooled = short and len(summary["behaviours"]) > MOST_ROWS
    return "\n".join(
        [
            _setup_lines(cells),
            *filter(None, [describe_line_loss(cells)]),
            *_poor_hearing(cells),
            "",
            *(_pooled_rows(summary) if pooled else _behaviour_rows(summary)),
            "",
            *_fallback_lines(summary["methods"]),
            *(line for block in blocks if (lines := block_lines(block, _WIDTH)) for line in (*lines, "")),
            *(text for text, _ in describe_rankings(summary, name_motion(str(cells[0]["motion_source"])))),
            finished,
            *failed,
        ]
    )


def _behaviour_rows(summary: Mapping[str, Any]) -> list[str]:
    """The table of every method, behaviour and condition, and that of the standard deviations."""
    rows = sorted(summary["behaviours"], key=lambda row: str(row["behaviour"]))
    varying = _varying_columns(summary["cells"])
    firsts = [[row["behaviour"], *_first_cells(row, varying, summary["methods"])] for row in rows]
    head = ["behaviour", "method", *varying]
    scores = [(first, row.get("sigma_scores", {})) for first, row in zip(firsts, rows, strict=True)]
    return [*_table_lines(head, firsts, rows), *sigma_lines(head, scores)]


def _pooled_rows(summary: Mapping[str, Any]) -> list[str]:
    """The table of the methods and conditions with the lowest errors over all behaviours, and how many are left out."""
    measured = [row for row in summary["methods"] if row["metrics"][PRIMARY_METRIC]["mean"] is not None]
    unmeasured = [row for row in summary["methods"] if row["metrics"][PRIMARY_METRIC]["mean"] is None]
    rows = [*sorted(measured, key=lambda row: float(row["metrics"][PRIMARY_METRIC]["mean"])), *unmeasured]
    shown = rows[:MOST_ROWS]
    varying = [
        name for name in _varying_columns(summary["cells"]) if len({_format_cell(row[name]) for row in shown}) > 1
    ]
    firsts = [_first_cells(row, varying, rows) for row in shown]
    lines = _table_lines(["method", *varying], firsts, shown, short=True)
    more = f"{count_noun(len(rows) - len(shown), 'more row')}, and the" if len(rows) > len(shown) else "The"
    return [*lines, f"{more} rows of single behaviours: --all, or the report."]


def _first_cells(row: Mapping[str, Any], varying: Sequence[str], methods: Sequence[Mapping[str, Any]]) -> list[str]:
    note = note_of(row, methods)
    name = name_with_lag(row["method"], lag_of(row)) + (f" ({note})" if note else "")
    return [name, *(_format_cell(row[name]) for name in varying)]


def _table_lines(
    head: Sequence[str], firsts: Sequence[Sequence[str]], rows: Sequence[Mapping[str, Any]], *, short: bool = False
) -> list[str]:
    """A table of rows of a summary; `firsts` are the cells below `head`.

    A short one has fewer columns, and a standard deviation for the first metric only.
    """
    columns = [column for column in TABLE_COLUMNS if not short or column[1] in _SHORT_COLUMNS]
    fallback = not short or any(row["metrics"]["fallback_share"]["mean"] for row in rows)
    cells = []
    for first, row in zip(firsts, rows, strict=True):
        share = [_format_fallback(row["metrics"]["fallback_share"]["mean"])] if fallback else []
        figures: list[str] = []
        for _, name, decimals in columns:
            metric = row["metrics"][name]
            figures.append(format_mean_sd(metric["mean"], None if short and figures else metric["sd"], decimals))
        matched = f"{row['frames_matched']}/{row['frames_expected']}"
        cells.append([*first, str(row["sequences"]), matched, *share, *figures])
    titles = ["clips", "matched", *(["fallback [%]"] if fallback else []), *(title for title, *_ in columns)]
    return Table([*head, *titles], cells, text_columns=len(head)).lines()


def _setup_lines(cells: Sequence[Mapping[str, Any]]) -> str:
    """Motion, stations, rate, noise and calibration, in two lines."""
    first = cells[0]
    noise, calibration = (
        ", ".join(dict.fromkeys(str(cell[name]) for cell in cells)) for name in ("noise", "calibration")
    )
    return (
        f"motion: {first['motion_source']}; {len(first['stations'])} stations ({', '.join(first['stations'])}), "
        f"ankles on the {first['mount']}\n"
        f"{first['rate_hz']:g} Hz, noise {noise}, calibration {calibration}, seed {first['seed']}; "
        "mean over sequences ± standard deviation, nothing aligned"
    )


def _poor_hearing(cells: Sequence[Mapping[str, Any]]) -> list[str]:
    """A warning if stations hear too few emitters, with the first such clip."""
    poor = {cell["clip"]: sentence for cell in cells if (sentence := poor_hearing(cell["health"]))}
    if not poor:
        return []
    clip, sentence = next(iter(poor.items()))
    more = f" (and in {count_noun(len(poor) - 1, 'more clip')})" if len(poor) > 1 else ""
    return [f"TOO FEW EMITTERS IN {clip}{more}: {sentence}"]


def _fallback_lines(methods: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line for each method whose model answers too few undisturbed frames; `methods` are rows of a summary."""
    shares: dict[str, float] = {}
    for row in methods:
        share = row["metrics"]["fallback_share"]["mean"] or 0.0
        shares[row["method"]] = max(share, shares.get(row["method"], 0.0))
    return [
        f"{method} FALLS BACK in {format_share(share)} of the undisturbed frames: other figures than its model's"
        for method, share in shares.items()
        if share > MAX_FALLBACK_SHARE
    ]


def _format_fallback(share: float | None) -> str:
    """Share of undisturbed frames that a fallback answered [%]; "-" where no frame is undisturbed."""
    return "-" if share is None else format_fixed(100.0 * share, 1)


def _varying_columns(cells: Sequence[Mapping[str, Any]]) -> list[str]:
    """The split always, since examples decide much; inputs, performer and varied values where they vary."""
    choices = {name: {_format_cell(cell[name]) for cell in cells} for name in ("inputs", "performer", "varied")}
    return ["split", *(name for name, texts in choices.items() if len(texts) > 1)]


def _format_cell(value: Any) -> str:
    return varied_text(value) if isinstance(value, Mapping) else str(value)
