"""Tables of a run's page: errors of methods by behaviour, coverage, stream health, every metric."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.compare.units import Sampling
from harness.core.number_format import count_noun, format_number, format_share
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, bullet_list, details, join, tag
from harness.report.kit.ranking import BOLD_NOTE, LAG_NOTE
from harness.report.kit.table import NOT_MEASURED_CELL, count_note, html_table, stacked_cell, statistic_cell
from harness.report.kit.text import last_line
from harness.report.run.data import Row, RunData, Trace
from harness.report.run.ranking import GroupedValues, best_series, group_values
from harness.results.reported_metrics import MAX_FALLBACK_SHARE, PRIMARY_METRIC, SECONDARY_METRIC
from harness.score.metrics import DEFINITIONS

OPEN_METRICS = (PRIMARY_METRIC, SECONDARY_METRIC)
"""Metrics whose table by behaviour is shown."""
FOLDED_METRICS = (
    "joint_angle_rms_deg",
    "mpjre_deg",
    "mpjpe_root_mm",
    "mpjpe_pa_mm",
    "jitter_m_s3",
    "lag_ms",
    "step_p50_ms",
)
"""Metrics whose table by behaviour is folded."""
_FRAME_COUNTS = ("matched", "expected", "held", "lost", "fallback", "bridged", "not_finite")


def summary_cell(statistics: Mapping[str, Any] | None, unit: str, *, column_n: int = 0) -> Markup:
    """Mean ± standard deviation of the summary, with the number of sequences where it is not `column_n`."""
    if statistics is None:
        return NOT_MEASURED_CELL
    return statistic_cell(statistics["mean"], statistics["sd"], unit, n=statistics["sequences"], column_n=column_n)


def results_tables(run: RunData) -> Markup:
    """Methods by behaviour: a table for each metric, most of them folded."""
    columns = [*run.behaviours, *([None] if len(run.behaviours) > 1 else [])]
    methods = run.full_summary["methods"]
    values = {column: group_values(run.cells, methods, column) for column in columns}
    further = [behaviour_table(run, metric, values) for metric in FOLDED_METRICS]
    return join(
        *(behaviour_table(run, metric, values) for metric in OPEN_METRICS),
        details("More metrics by behaviour", *further),
    )


def behaviour_table(run: RunData, metric: str, values: Mapping[str | None, GroupedValues]) -> Markup:
    """One metric: a row for each method, a column for each key of `values`: a behaviour, or None for all of them."""
    statistics: dict[tuple[str, str | None], Row] = {}
    for row in run.summary["behaviours"]:
        statistics[run.series_of(row), str(row["behaviour"])] = row["metrics"][metric]
    for row in run.summary["methods"]:
        statistics[run.series_of(row), None] = row["metrics"][metric]
    unit = DEFINITIONS[metric].unit
    counts, best = {}, {}
    for column in values:
        by_name = {name: statistics[name, column] for name in run.series if (name, column) in statistics}
        counts[column] = max((s["sequences"] for s in by_name.values()), default=0)
        best[column] = best_series(values[column], metric, Sampling.of_summary(run.full_summary))

    def cell(name: str, column: str | None) -> Markup:
        text = summary_cell(statistics.get((name, column)), unit, column_n=counts[column])
        return tag("strong", text) if name in best[column] else text

    numbers = [count_note(counts[column]) for column in values]
    names = [(column or "all").replace("_", " ") for column in values]
    titles = [join(name, n) for name, n in zip(names, numbers, strict=True)]
    notes = {run.series_of(row): _fallback_note(row) for row in run.summary["methods"]}
    rows = [[join(name, notes.get(name)), *(cell(name, column) for column in values)] for name in run.ranked]
    caption = join(
        tag("b", f"{metric} [{unit}]"),
        f": {DEFINITIONS[metric].text}. Mean ± sd over n sequences.{BOLD_NOTE if any(best.values()) else ''}",
        f" {LAG_NOTE}" if len({group.lag for of in values.values() for group in of}) > 1 else "",
    )
    return html_table(Table(["method", *titles], rows), caption, label=metric)


def _fallback_note(row: Row) -> Markup | None:
    """Note beside a method whose model answers too few undisturbed frames."""
    share = row["metrics"]["fallback_share"]["mean"] or 0.0
    return tag("small", f" falls back in {format_share(share)}") if share > MAX_FALLBACK_SHARE else None


def coverage_tables(run: RunData) -> Markup:
    """How many frames each method estimated, and which cells failed; one sentence where nothing is missing."""
    finished, planned = run.summary["cells_finished"], run.summary["cells_planned"]
    methods = run.summary["methods"]
    matched, expected = (sum(row[f"frames_{name}"] for row in methods) for name in ("matched", "expected"))
    if finished == planned and matched == expected and expected:
        others = {name: sum(row[f"frames_{name}"] for row in methods) for name in _FRAME_COUNTS[2:]}
        notes = [f"{count:,} {name.replace('_', ' ')}" for name, count in others.items() if count]
        which = f" Among them: {', '.join(notes)}." if notes else ""
        text = f"All {planned:,} cells finished, and all {expected:,} frames after the warm-up have an estimate.{which}"
        return join(tag("p", text), details("Frames of each method", _coverage_table(run)) if notes else None)
    failures = [
        join(tag("b", cell), details(last_line(text), tag("pre", text)))
        for cell, text in run.summary["failures"].items()
    ]
    return join(
        tag("p", f"{finished} of {planned} cells finished."),
        _coverage_table(run) if methods else None,
        join(tag("h3", "Failed cells"), bullet_list(failures, class_=None)) if failures else None,
    )


def _coverage_table(run: RunData) -> Markup:
    rows = []
    for row in run.summary["methods"]:
        share = format_share(row["coverage"], 1)
        matched, expected, *others = (f"{row[f'frames_{name}']:,}" for name in _FRAME_COUNTS)
        fallback = row["metrics"]["fallback_share"]["mean"]
        undisturbed = "–" if fallback is None else format_share(fallback, 1)
        rows.append([run.series_of(row), row["sequences"], matched, expected, share, *others, undisturbed])
    head = ["method", "sequences", "frames matched", "expected", "share", "held", "lost", "fallback", "bridged"]
    head += ["not finite", "fallback, undisturbed"]
    caption = (
        "Frames after the warm-up. Held: too few readings were valid, and the estimate was carried forward. Lost: "
        "most stations had been missing for long. Fallback: a simpler solution answered in place of the method's "
        "model. Bridged: there was no reading. Not finite: the estimate is no number and counts as not matched. The "
        "last column is the share of fallbacks where every station has reported for 0.5 s."
    ) + (" A method with a lag leaves the last frames of a take unanswered." if any(run.lags.values()) else "")
    return html_table(Table(head, rows), caption, label="coverage")


def health_tables(run: RunData) -> Markup:
    """What the stream lost, by station and by clip; all methods received the same stream of a clip."""
    streams: dict[str, Trace] = {}
    for trace in sorted(run.traces, key=lambda trace: -len(trace.time_s)):
        if len(trace.time_s):
            streams.setdefault(trace.clip, trace)
    if not streams:
        return NOT_MEASURED_CELL
    rows = []
    for station in dict.fromkeys(name for trace in streams.values() for name in trace.stations):
        parts = [(trace, trace.stations.index(station)) for trace in streams.values() if station in trace.stations]
        valid = np.concatenate([t.position_valid[:, s] & t.orientation_valid[:, s] for t, s in parts])
        quality = np.concatenate([t.quality[:, s] for t, s in parts])
        suspect = np.concatenate([t.suspect[:, s] for t, s in parts])
        gap_s = max(_longest_gap_s(t, s) for t, s in parts)
        shares = [format_share(float(np.mean(column)), 2) for column in (valid, suspect)]
        rows.append([station.replace("_", " "), *shares, f"{np.nanmean(quality):.3f}", f"{gap_s:.2f}"])
    head = ["station", "valid", "suspect", "mean quality", "longest gap [s]"]
    caption = f"All frames of {count_noun(len(streams), 'clip')}. Gap: consecutive frames without position."
    names = list(dict.fromkeys(name for trace in streams.values() for name in trace.health))
    counts = [[clip, *(_format_plain(trace.health.get(name)) for name in names)] for clip, trace in streams.items()]
    by_clip = html_table(Table(["clip", *names], counts), "Counts of the stream, by clip", label="stream counts")
    return join(html_table(Table(head, rows), caption, label="stream health"), details("Counts by clip", by_clip))


def all_metrics_table(run: RunData) -> Markup:
    """Every metric of every method over all sequences, with its definition."""
    by_series = {run.series_of(row): row["metrics"] for row in run.summary["methods"]}
    rows = []
    for metric, definition in DEFINITIONS.items():
        if not all(metric in metrics for metrics in by_series.values()):
            continue
        cells = []
        for metrics in by_series.values():
            pooled = metrics[metric]["frame_weighted"]
            lower = "" if pooled is None else format_number(pooled, definition.unit)
            cells.append(stacked_cell(summary_cell(metrics[metric], definition.unit), lower))
        rows.append([join(f"{metric} [{definition.unit}]", tag("small", definition.text)), *cells])
    caption = "Mean ± sd over sequences; below it the value over all frames pooled, where it is defined."
    return html_table(Table(["metric", *by_series], rows), caption, label="every metric")


def _longest_gap_s(trace: Trace, station: int) -> float:
    """Time from the last valid frame before a gap to the first after it, less one period [s]."""
    seen = trace.time_s[trace.position_valid[:, station]]
    edges = np.concatenate([trace.time_s[:1], seen, trace.time_s[-1:]])
    period_s = float(np.min(np.diff(trace.time_s), initial=np.inf))
    longest = float(np.max(np.diff(edges), initial=0.0))
    return longest if longest > 1.5 * period_s else 0.0


def _format_plain(value: Any) -> Any:
    if value is None:
        return NOT_MEASURED_CELL
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_format_plain(item)}" for name, item in value.items())
    return f"{value:g}" if isinstance(value, float) else str(value)
