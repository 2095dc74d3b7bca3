"""The table of a run on a terminal."""

from collections.abc import Mapping, Sequence
from typing import Any

from harness.report.run import calibration_cost, calibration_errors, expected_orders, recovery
from harness.results.cell import varied_text

COLUMNS = (
    ("joint angle [deg]", "joint_angle_mean_deg", 2),
    ("rotation [deg]", "mpjre_deg", 2),
    ("position [mm]", "mpjpe_mm", 1),
    ("jitter [m/s3]", "jitter_m_s3", 0),
    ("step p50 [ms]", "step_p50_ms", 2),
)
"""Title, metric and decimals."""
_RECORDS = ("records_sent", "records_dropped")


def run_table(summary: Mapping[str, Any]) -> str:
    """A row for each method and behaviour: mean and spread over sequences, and how much of the motion was matched."""
    cells = summary["cells"]
    finished = f"cells finished {summary['cells_finished']} of {summary['cells_planned']}"
    failed = [f"FAILED {cell}: {text.strip().splitlines()[-1]}" for cell, text in summary["failures"].items()]
    if not cells:
        return "\n".join(["nothing was measured", finished, *failed])
    lines = [["behaviour", "method", *_varying_columns(cells), "clips", "matched", *(title for title, *_ in COLUMNS)]]
    for row in sorted(summary["behaviours"], key=lambda row: str(row["behaviour"])):
        varying = [_format_cell(row[name]) for name in _varying_columns(cells)]
        matched = f"{row['frames_matched']}/{row['frames_expected']}"
        figures = [_format_statistic(row["metrics"][name], decimals) for _, name, decimals in COLUMNS]
        lines.append([row["behaviour"], row["method"], *varying, str(row["sequences"]), matched, *figures])
    return "\n".join(
        [
            _setup_lines(cells),
            *_link_loss(cells),
            "",
            *align_columns(lines, text_columns=2 + len(_varying_columns(cells))),
            "",
            *calibration_errors.text(summary),
            *calibration_cost.text(summary),
            *recovery.text(summary),
            *expected_orders.text(summary),
            finished,
            *failed,
        ]
    )


def _setup_lines(cells: Sequence[Mapping[str, Any]]) -> str:
    """What all cells share, in two lines."""
    one = cells[0]
    noise, known = (", ".join(dict.fromkeys(str(cell[name]) for cell in cells)) for name in ("noise", "calibration"))
    return (
        f"motion: {one['motion_source']}; {len(one['stations'])} stations ({', '.join(one['stations'])}), "
        f"ankles on the {one['mount']}\n"
        f"{one['rate_hz']:g} Hz, noise {noise}, calibration {known}, seed {one['seed']}; "
        "mean over sequences ± standard deviation, nothing aligned"
    )


def _link_loss(cells: Sequence[Mapping[str, Any]]) -> list[str]:
    """What the line between tracker and host could not carry."""
    sent, lost = (sum(float(cell["health"].get(name, 0.0)) for cell in cells) for name in _RECORDS)
    if not lost:
        return []
    return [f"THE LINE IS TOO SLOW: {100.0 * lost / (sent + lost):.0f} % of the records were dropped"]


def _varying_columns(cells: Sequence[Mapping[str, Any]]) -> list[str]:
    """Protocol always (examples decide much); inputs, performer and varied values where there is a choice."""
    choices = {name: {_format_cell(cell[name]) for cell in cells} for name in ("inputs", "performer", "varied")}
    return ["split", *(name for name, texts in choices.items() if len(texts) > 1)]


def _format_cell(value: Any) -> str:
    return varied_text(value) if isinstance(value, Mapping) else str(value)


def _format_statistic(statistics: Mapping[str, Any], decimals: int) -> str:
    if statistics["mean"] is None:
        return "not measured"
    spread = "" if statistics["sd"] is None else f" ± {statistics['sd']:.{decimals}f}"
    return f"{statistics['mean']:.{decimals}f}{spread}"


def align_columns(lines: Sequence[Sequence[str]], text_columns: int) -> list[str]:
    """Words on the left of their columns, in the first `text_columns`, and figures on the right."""
    widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
    return [
        "  ".join(
            word.ljust(width) if i < text_columns else word.rjust(width)
            for i, (word, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    ]
