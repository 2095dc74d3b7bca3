"""The page of the tracker's physics: the truth table first, then the error models side by side."""

import itertools
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import NOT_MEASURED, count_noun, format_fixed, format_share
from harness.errors import BadInput
from harness.report.kit.page import Badge, DataTable, Drawing, Page, Section, Stack
from harness.report.kit.page_html import write_page
from harness.report.kit.statement_lines import MARKS
from harness.report.kit.text import list_first
from harness.report.physics.charts import excursions_chart, gaps_chart, quality_chart, spectrum_chart
from harness.report.physics.error_comparison import ErrorModelComparison, TrackerErrorStatistics
from harness.results.findings import BenchmarkStatement

_HEAD = ("condition", "held to", "measured", "verdict", "published")
_CAPTION = (
    "Held to: the range that the simulated errors should lie in. Measured: the figure of this run. Published: the "
    "figure that the range comes from. A row outside its range is missed."
)


def result_sentence(model: str, rows: Sequence[BenchmarkStatement]) -> str:
    """How many rows a model meets, and which it misses, in one sentence."""
    if not rows:
        return f"The errors of {model} were not held to any published figure."
    missed = [row.text for row in rows if row.verdict == "missed"]
    verdicts = [row.verdict for row in rows]
    without = len(rows) - verdicts.count("met") - len(missed)
    parts = [f"meets {verdicts.count('met')}"]
    if missed:
        parts.append(f"misses {len(missed)} ({list_first(missed, separator='; ')})")
    if without:
        parts.append(f"has no verdict on {without}")
    *start, last = parts
    counted = f"{', '.join(start)} and {last}" if start else last
    return f"Of {count_noun(len(rows), 'row')} of the truth table, {model} {counted}."


def truth_table(rows: Sequence[BenchmarkStatement]) -> DataTable:
    """The table of the page: how a figure was measured stands below it."""
    cells = [
        [
            row.text,
            row.target,
            Stack(row.measured or NOT_MEASURED, row.why),
            Badge(row.verdict or "no verdict", MARKS[row.verdict] or "–"),
            row.reference or "–",
        ]
        for row in rows
    ]
    return DataTable(_HEAD, cells, caption=_CAPTION, label="truth table", cards=True)


_EPISODE_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
_FREQUENCIES = 9
"""Rows of the table of the spectrum; the frequencies are spaced evenly on a logarithmic axis."""


def summary_table(comparison: ErrorModelComparison) -> DataTable:
    """A row for each figure, a column for each model."""
    models, limit = comparison.models, f"{1e3 * comparison.limit_m:g} mm"
    rows: list[list[object]] = [
        ["recordings", *(f"{m.recordings:,}" for m in models)],
        ["minutes, summed over stations", *(_number(m.station_s / 60.0, 1) for m in models)],
        ["median error [mm]", *(_number(1e3 * m.error_m[0], 2) for m in models)],
        ["95 % quantile [mm]", *(_number(1e3 * m.error_m[1], 2) for m in models)],
        ["99 % quantile [mm]", *(_number(1e3 * m.error_m[2], 2) for m in models)],
        [f"excursions above {limit}, per minute", *(_number(m.per_minute(len(m.excursion_s)), 2) for m in models)],
        ["median duration of an excursion [s]", *(_median(m.excursion_s, 2) for m in models)],
        ["median size of an excursion [mm]", *(_median(1e3 * m.excursion_peak_m, 1) for m in models)],
        ["gaps per minute", *(_number(m.per_minute(len(m.gap_s)), 2) for m in models)],
        ["median duration of a gap [s]", *(_median(m.gap_s, 2) for m in models)],
        ["share of the readings lost", *(format_share(m.lost_share, 2) for m in models)],
    ]
    caption = (
        "Pooled over recordings and stations. Per minute: for each minute and station. Lost readings have no error."
    )
    return DataTable(["figure", *(m.label for m in models)], rows, caption=caption, label="summary")


def spectrum_table(models: Sequence[TrackerErrorStatistics]) -> DataTable:
    """The density at a few frequencies [mm^2/Hz]."""
    shown_hz = np.geomspace(models[0].frequency_hz[0], models[0].frequency_hz[-1], _FREQUENCIES)
    rows = []
    for frequency_hz in shown_hz:
        nearest = [int(np.abs(m.frequency_hz - frequency_hz).argmin()) for m in models]
        densities = [_significant(1e6 * m.density_m2_hz[n]) for m, n in zip(models, nearest, strict=True)]
        rows.append([f"{models[0].frequency_hz[nearest[0]]:.3g}", *densities])
    head = ["frequency [Hz]", *(m.label for m in models)]
    return DataTable(head, rows, caption="Density [mm²/Hz] at the frequencies nearest to these.", label="spectrum")


def excursions_table(models: Sequence[TrackerErrorStatistics]) -> DataTable:
    """Quantiles of the durations and sizes of excursions."""
    columns = {f"{m.label}, duration [s]": m.excursion_s for m in models}
    columns |= {f"{m.label}, size [mm]": 1e3 * m.excursion_peak_m for m in models}
    return _quantile_table(columns, "excursions")


def gaps_table(models: Sequence[TrackerErrorStatistics]) -> DataTable:
    """Quantiles of the durations of gaps."""
    return _quantile_table({f"{m.label}, duration [s]": m.gap_s for m in models}, "gaps")


def quality_table(models: Sequence[TrackerErrorStatistics]) -> DataTable:
    """The share of the readings in each class of quality, and the median and the 95 % quantile of their error."""
    edges = models[0].quality_edges
    classes = ["lost", *(f"{low:g} to {high:g}" for low, high in itertools.pairwise(edges))]
    rows = []
    for n, name in enumerate(classes):
        shares = [format_share(float(m.quality_share[n]), 2) for m in models]
        errors = [
            cell
            for m in models
            for cell in (["–", "–"] if n == 0 else [_number(1e3 * m.class_error_m[n - 1, k], 1) for k in (0, 1)])
        ]
        rows.append([name, *shares, *errors])
    head = [
        "quality",
        *(f"{m.label}, share" for m in models),
        *(f"{m.label}, {name} error [mm]" for m in models for name in ("median", "95 %")),
    ]
    return DataTable(head, rows, caption="A class includes its upper end.", label="quality")


def _quantile_table(columns: dict[str, Floats], label: str) -> DataTable:
    rows: list[list[object]] = [["number", *(f"{len(values):,}" for values in columns.values())]]
    for share in _EPISODE_QUANTILES:
        cells = [format_fixed(float(np.quantile(v, share)), 2) if len(v) else "–" for v in columns.values()]
        rows.append(["longest or largest" if share == 1.0 else f"{100.0 * share:g} % quantile", *cells])
    return DataTable(["", *columns], rows, caption=f"Quantiles over all {label}.", label=label)


def _median(values: Floats, decimals: int) -> str:
    """The median of the episodes; a dash without any."""
    return format_fixed(float(np.median(values)), decimals, grouped=True) if len(values) else "–"


def _number(value: float | Floats, decimals: int) -> object:
    return format_fixed(float(value), decimals, grouped=True) if np.isfinite(value) else NOT_MEASURED


def _significant(value: float) -> object:
    return f"{value:.3g}" if np.isfinite(value) else NOT_MEASURED


def write_physics_page(path: Path, comparison: ErrorModelComparison) -> Path:
    """Write the page to `path` and return it; its folder is created. BadInput without any error model."""
    if not comparison.models:
        raise BadInput("There is no error model to show.", "Give at least one.")
    return write_page(physics_page(comparison), path)


def physics_page(comparison: ErrorModelComparison) -> Page:
    """The page of a comparison of error models."""
    models = comparison.models
    parts = {
        "Spectrum": (spectrum_chart, spectrum_table(models)),
        "Excursions": (excursions_chart, excursions_table(models)),
        "Gaps": (gaps_chart, gaps_table(models)),
        "Quality": (quality_chart, quality_table(models)),
    }
    return Page(
        verb="bench physics",
        name="",
        headline=result_sentence(models[0].label, comparison.rows),
        lead=[truth_table(comparison.rows)],
        facts={model.label: model.source for model in models},
        sections=[
            Section("Summary", "summary", [summary_table(comparison)]),
            *(
                Section(title, title.lower(), [Drawing(partial(draw, comparison), table)])
                for title, (draw, table) in parts.items()
            ),
        ],
        command=comparison.command,
    )
