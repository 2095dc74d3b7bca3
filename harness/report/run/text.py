"""The tables of a run as text for the terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from harness.core.estimate import name_with_lag
from harness.core.number_format import format_fixed, format_mean_sd, format_share
from harness.core.text_table import Table
from harness.report.kit.text import last_line, name_motion
from harness.report.run import calibration_cost, calibration_errors, expected_orders, recovery
from harness.report.run.data import lag_of
from harness.report.run.ranking import describe_rankings
from harness.results.cell import varied_text
from harness.results.reported_metrics import MAX_FALLBACK_SHARE, TABLE_COLUMNS
from harness.results.sigma_table import sigma_lines

_RECORDS = ("records_sent", "records_dropped")


def run_table(summary: Mapping[str, Any]) -> str:
    """The text of a run: what its cells share, a row for each method and behaviour, and what failed.

    A row has the mean and the standard deviation over sequences, and how many frames were matched.
    """
    cells = summary["cells"]
    finished = f"cells finished {summary['cells_finished']} of {summary['cells_planned']}"
    failed = [f"FAILED {cell}: {last_line(text)}" for cell, text in summary["failures"].items()]
    if not cells:
        return "\n".join(["nothing was measured", finished, *failed])
    varying = _varying_columns(cells)
    rows, sigma = [], []
    for row in sorted(summary["behaviours"], key=lambda row: str(row["behaviour"])):
        settings = [_format_cell(row[name]) for name in varying]
        matched = f"{row['frames_matched']}/{row['frames_expected']}"
        statistics = [(row["metrics"][name], decimals) for _, name, decimals in TABLE_COLUMNS]
        figures = [format_mean_sd(s["mean"], s["sd"], decimals) for s, decimals in statistics]
        share = _format_fallback(row["metrics"]["fallback_share"]["mean"])
        method = name_with_lag(row["method"], lag_of(row))
        sigma.append(([row["behaviour"], method, *settings], row.get("sigma_scores", {})))
        rows.append([row["behaviour"], method, *settings, str(row["sequences"]), matched, share, *figures])
    head = ["behaviour", "method", *varying, "clips", "matched", "fallback [%]"]
    head += [title for title, *_ in TABLE_COLUMNS]
    return "\n".join(
        [
            _setup_lines(cells),
            *_link_loss(cells),
            "",
            *Table(head, rows, text_columns=2 + len(varying)).lines(),
            *sigma_lines(["behaviour", "method", *varying], sigma),
            "",
            *_fallback_lines(summary["methods"]),
            *calibration_errors.text(summary),
            *calibration_cost.text(summary),
            *recovery.text(summary),
            *expected_orders.text(summary),
            *(text for text, _ in describe_rankings(summary, name_motion(str(cells[0]["motion_source"])))),
            finished,
            *failed,
        ]
    )


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


def _link_loss(cells: Sequence[Mapping[str, Any]]) -> list[str]:
    """A warning if the link between tracker and host dropped records."""
    sent, dropped = (sum(float(cell["health"].get(name, 0.0)) for cell in cells) for name in _RECORDS)
    if not dropped:
        return []
    return [f"THE LINK IS TOO SLOW: {format_share(dropped / (sent + dropped))} of the records were dropped"]


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
