"""Tables of a run's page: errors by behaviour and setting, coverage, stream health, all metrics."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.compare import Sampling
from harness.core.humanoid24 import standard_skeleton
from harness.core.number_format import NOT_MEASURED, count_noun, format_number, format_share
from harness.report.kit.page import Block, BrowserOnly, Code, DataTable, Prose, Stack, Strong
from harness.report.kit.ranking import BOLD_NOTE, LAG_COVERAGE, LAG_NOTE
from harness.report.kit.text import format_statistic, last_line
from harness.report.run.data import Row, RunData, Trace
from harness.report.run.metric_columns import SIGMA_COLUMNS, format_sigma_scores
from harness.report.run.ranking import GroupedValues, best_series, group_values
from harness.results import MAX_FALLBACK_SHARE, PRIMARY_METRIC, SECONDARY_METRIC, setting_text
from harness.score import DEFINITIONS, sum_sigma

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
_COVERAGE = (
    "Frames after the warm-up. Held: too few readings were valid, and the estimate was carried forward. Lost: most "
    "stations had been missing for long. Fallback: a simpler solution answered in place of the method's model. "
    "Bridged: there was no reading. Not finite: the estimate is no number and counts as not matched. The last column "
    "is the share of fallbacks where every station has reported for 0.5 s."
)
_SIGMA = (
    "Standard deviations that methods state for the hinge angles, pooled over the scored frames and the hinges of each "
    "behaviour. Of errors as stated 68 % lie within one, and 95 % within the region of 2.66 (Student's t). The log "
    "score is the mean negative logarithm of the stated normal density of the true angle, per degree: lower is better."
)


def results_tables(run: RunData) -> list[Block]:
    """Methods by behaviour: a table for each metric, most of them folded."""
    columns = [*run.behaviours, *([None] if len(run.behaviours) > 1 else [])]
    methods = run.full_summary["methods"]
    values = {column: group_values(run.cells, methods, column) for column in columns}
    shown, folded = ([behaviour_table(run, m, values) for m in metrics] for metrics in (OPEN_METRICS, FOLDED_METRICS))
    return [*shown, BrowserOnly(folded, "More metrics by behaviour")]


def behaviour_table(run: RunData, metric: str, values: Mapping[str | None, GroupedValues]) -> DataTable:
    """One metric: a row for each method, a column for each key of `values`: a behaviour, or None for all of them."""
    statistics: dict[tuple[str, str | None], Row] = {}
    for row in run.summary["behaviours"]:
        statistics[run.series_of(row), str(row["behaviour"])] = row["metrics"][metric]
    for row in run.summary["methods"]:
        statistics[run.series_of(row), None] = row["metrics"][metric]
    unit = DEFINITIONS[metric].unit
    counts, best = {}, {}
    for column in values:
        by_name = [statistics[name, column] for name in run.series if (name, column) in statistics]
        counts[column] = max((of["sequences"] for of in by_name), default=0)
        best[column] = best_series(values[column], metric, Sampling.of_summary(run.full_summary))

    def cell(name: str, column: str | None) -> object:
        text = _statistic(statistics.get((name, column)), unit, counts[column])
        return Strong(text) if name in best[column] else text

    titles = [f"{(column or 'all').replace('_', ' ')} n\u00a0{counts[column]}" for column in values]
    notes = {run.series_of(row): _fallback_note(row) for row in run.summary["methods"]}
    rows = [[Stack(name, notes.get(name, "")), *(cell(name, column) for column in values)] for name in run.ranked]
    bold = BOLD_NOTE if any(best.values()) else ""
    apart = f" {LAG_NOTE}" if len({group.lag_frames for of in values.values() for group in of}) > 1 else ""
    caption = f"{DEFINITIONS[metric].text}. Mean ± sd over n sequences.{bold}{apart}"
    return DataTable(["method", *titles], rows, f"{metric} [{unit}]:", caption, metric)


def _statistic(statistics: Mapping[str, Any] | None, unit: str, of_column: int) -> str:
    """Mean ± standard deviation of the summary, with the number of sequences where it is not that of the column."""
    if statistics is None:
        return NOT_MEASURED
    mean, sd = statistics["mean"], statistics["sd"]
    return format_statistic(mean, sd, unit, clips=statistics["sequences"], of_column=of_column)


def _fallback_note(row: Row) -> str:
    """Note below a method whose model answers too few undisturbed frames."""
    share = row["metrics"]["fallback_share"]["mean"] or 0.0
    return f"falls back in {format_share(share)}" if share > MAX_FALLBACK_SHARE else ""


def effect_tables(run: RunData) -> list[Block]:
    """For each behaviour and metric a table of methods by setting; nothing when nothing varies."""
    shown = run.behaviours if run.varied_label else ()
    return [_effect_table(run, behaviour, metric) for behaviour in shown for metric in OPEN_METRICS]


def _effect_table(run: RunData, behaviour: str, metric: str) -> DataTable:
    by_series, unit = rows_by_setting(run, behaviour), DEFINITIONS[metric].unit
    columns = list(dict.fromkeys(setting_text(row) for row in run.full_summary["cells"]))
    rows = []
    for name in run.series:
        if name in by_series:
            found = {column: row["metrics"][metric] for column, row in by_series[name].items()}
            n = max(statistics["sequences"] for statistics in found.values())
            rows.append([f"{name} n\u00a0{n}", *(_statistic(found.get(column), unit, n) for column in columns)])
    title, label = f"{behaviour.replace('_', ' ')}, {metric} [{unit}]:", f"{metric} against the varied values"
    return DataTable(["method", *columns], rows, title, "mean ± sd over n clips.", label)


def rows_by_setting(run: RunData, behaviour: str) -> dict[str, dict[str, Row]]:
    """Series -> text of its setting -> row of the full summary."""
    rows: dict[str, dict[str, Row]] = {}
    for row in run.full_summary["behaviours"]:
        if row["behaviour"] == behaviour:
            rows.setdefault(run.series_of(row), {})[setting_text(row)] = row
    return rows


def coverage_tables(run: RunData) -> list[Block]:
    """How many frames each method estimated, and which cells failed; one sentence where nothing is missing."""
    finished, planned = run.summary["cells_finished"], run.summary["cells_planned"]
    methods = run.summary["methods"]
    sums = {name: sum(row[f"frames_{name}"] for row in methods) for name in _FRAME_COUNTS}
    matched, expected, *_ = sums.values()
    if finished == planned and matched == expected and expected:
        notes = [f"{count:,} {name.replace('_', ' ')}" for name, count in list(sums.items())[2:] if count]
        which = f" Among them: {', '.join(notes)}." if notes else ""
        text = f"All {planned:,} cells finished, and all {expected:,} frames after the warm-up have an estimate.{which}"
        return [Prose(text), *([BrowserOnly([_coverage_table(run)], "Frames of each method")] if notes else [])]
    failures = [Code(text, f"{cell}: {last_line(text)}") for cell, text in run.summary["failures"].items()]
    heading = [Prose("Failed cells:")] if failures else []
    return [Prose(f"{finished} of {planned} cells finished."), _coverage_table(run), *heading, *failures]


def _coverage_table(run: RunData) -> DataTable:
    rows = []
    for row in run.summary["methods"]:
        share = format_share(row["coverage"], 1)
        matched, expected, *others = (f"{row[f'frames_{name}']:,}" for name in _FRAME_COUNTS)
        fallback = row["metrics"]["fallback_share"]["mean"]
        undisturbed = "–" if fallback is None else format_share(fallback, 1)
        rows.append([run.series_of(row), row["sequences"], matched, expected, share, *others, undisturbed])
    head = ["method", "sequences", "frames matched", "expected", "share", "held", "lost", "fallback", "bridged"]
    head += ["not finite", "fallback, undisturbed"]
    caption = _COVERAGE + (LAG_COVERAGE if any(run.lags.values()) else "")
    return DataTable(head, rows, caption=caption, label="coverage")


def health_tables(run: RunData) -> list[Block]:
    """What the stream lost, by station and by clip; all methods received the same stream of a clip."""
    streams: dict[str, Trace] = {}
    for trace in sorted(run.traces, key=lambda trace: -len(trace.time_s)):
        if len(trace.time_s):
            streams.setdefault(trace.clip, trace)
    if not streams:
        return [Prose(NOT_MEASURED)]
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
    counts = [[clip, *(_format_count(trace.health.get(name)) for name in names)] for clip, trace in streams.items()]
    by_clip = DataTable(["clip", *names], counts, caption="Counts of the stream, by clip", label="stream counts")
    return [DataTable(head, rows, caption=caption, label="stream health"), BrowserOnly([by_clip], "Counts by clip")]


def _longest_gap_s(trace: Trace, station: int) -> float:
    """Time from the last valid frame before a gap to the first after it, less one period [s]."""
    seen = trace.time_s[trace.position_valid[:, station]]
    edges = np.concatenate([trace.time_s[:1], seen, trace.time_s[-1:]])
    period_s = float(np.min(np.diff(trace.time_s), initial=np.inf))
    longest = float(np.max(np.diff(edges), initial=0.0))
    return longest if longest > 1.5 * period_s else 0.0


def _format_count(value: Any) -> str:
    if value is None:
        return NOT_MEASURED
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_format_count(item)}" for name, item in value.items())
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def all_metrics_table(run: RunData) -> DataTable:
    """Every metric of every method over all sequences, with its definition."""
    by_series = {run.series_of(row): row["metrics"] for row in run.summary["methods"]}
    rows: list[list[object]] = []
    for metric, definition in DEFINITIONS.items():
        if all(metric in metrics for metrics in by_series.values()):
            cells = [_two_means(metrics[metric], definition.unit) for metrics in by_series.values()]
            rows.append([Stack(f"{metric} [{definition.unit}]", definition.text), *cells])
    caption = "Mean ± sd over sequences; below it the value over all frames pooled, where it is defined."
    fold = "All metrics of all methods"
    return DataTable(["metric", *by_series], rows, caption=caption, label="every metric", fold=fold)


def _two_means(statistics: Mapping[str, Any], unit: str) -> Stack:
    """The mean over sequences, and that over all frames where it is defined."""
    pooled = statistics["frame_weighted"]
    return Stack(_statistic(statistics, unit, 0), "" if pooled is None else format_number(pooled, unit))


def sigma_table(run: RunData) -> DataTable:
    """A row for each series that states standard deviations and each behaviour."""
    rows = []
    for series in run.series_with_sigma:
        for behaviour in run.behaviours:
            traces = [t for t in run.traces if (t.series, t.behaviour) == (series, behaviour) and len(t.hinge_deg)]
            if traces:
                parts = [sum_sigma(t.hinge_deg.astype(float), t.sigma_deg[t.scored].astype(float)) for t in traces]
                sums = sum(parts[1:], start=parts[0])
                lowest = standard_skeleton().dof_names[int(np.argmin(sums.within_1))]
                texts = format_sigma_scores(sums.scores())
                cells = [
                    Stack(text, lowest) if name == "sigma_lowest_coverage_1" else text
                    for text, (_, name, *_) in zip(texts, SIGMA_COLUMNS, strict=True)
                ]
                rows.append([series, behaviour.replace("_", " "), *cells])
    head = ["method", "behaviour", *(title for title, *_ in SIGMA_COLUMNS)]
    return DataTable(head, rows, caption=_SIGMA, label="stated standard deviations")
