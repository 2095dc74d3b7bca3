"""The page's tables: errors of methods by behaviour, coverage, stream health, every metric."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.report.kit.markup import Markup, details, join, table, tag
from harness.report.run.data import Row, RunData, Trace
from harness.score.metrics import DEFINITIONS

OPEN_METRICS = ("joint_angle_mean_deg", "mpjpe_mm")
"""Metrics whose table by behaviour is open."""
FOLDED_METRICS = (
    "joint_angle_rms_deg",
    "mpjre_deg",
    "mpjpe_root_mm",
    "mpjpe_pa_mm",
    "jitter_m_s3",
    "lag_ms",
    "step_p50_ms",
)
_UNRANKED_METRICS = ("jitter_m_s3", "lag_ms")
"""Where the lowest is not the best: truth has jitter of its own, and a lag has a sign."""
NOT_MEASURED = tag("span", "not measured", class_="none")
_DECIMALS = {"deg": 2, "mm": 1, "mm/s": 1, "m/s³": 1, "ms": 2, "frames/s": 0, "%": 1}


def format_number(value: float, unit: str, *, decimals: int = 0) -> str:
    """With the decimals that suit the unit, `decimals` of them at least."""
    return f"{value:,.{max(decimals, _DECIMALS.get(unit, 2))}f}"


def format_statistics(found: Mapping[str, Any] | None, unit: str, *, n: int | None = None) -> Markup:
    """Mean ± standard deviation over sequences, and their number where it differs from `n`."""
    if found is None or found["mean"] is None:
        return NOT_MEASURED
    spread = None if found["sd"] is None else tag("span", f" ± {format_number(found['sd'], unit)}", class_="spread")
    return join(
        format_number(found["mean"], unit),
        spread,
        None if found["sequences"] == n else format_count(found["sequences"]),
    )


def format_count(n: int | str) -> Markup:
    """Of how many sequences, never broken across lines."""
    return tag("span", f" n\u00a0{n}", class_="spread")


def results_tables(run: RunData) -> Markup:
    """Methods by behaviours: the first metrics open, further ones folded."""
    further = [behaviour_table(run, metric) for metric in FOLDED_METRICS]
    return join(
        *(behaviour_table(run, metric) for metric in OPEN_METRICS), details("More metrics by behaviour", *further)
    )


def behaviour_table(run: RunData, metric: str) -> Markup:
    """One metric: a row for each method, a column for each behaviour, then all sequences of several."""
    found: dict[tuple[str, str | None], Row] = {}
    for row in run.summary["behaviours"]:
        found[run.series_of(row), str(row["behaviour"])] = row["metrics"][metric]
    for row in run.summary["methods"]:
        found[run.series_of(row), None] = row["metrics"][metric]
    unit = DEFINITIONS[metric].unit
    columns = [*run.behaviours, *([None] if len(run.behaviours) > 1 else [])]
    counts, best = {}, {}
    for column in columns:
        here = {name: found[name, column] for name in run.series if (name, column) in found}
        counts[column] = max((s["sequences"] for s in here.values()), default=0)
        means = {name: s["mean"] for name, s in here.items() if s["mean"] is not None}
        ranked = len(means) > 1 and metric not in _UNRANKED_METRICS
        best[column] = min(means, key=lambda name: means[name]) if ranked else None

    def cell(name: str, column: str | None) -> Markup:
        text = format_statistics(found.get((name, column)), unit, n=counts[column])
        return tag("strong", text) if name == best[column] else text

    numbers = [format_count(counts[column]) for column in columns]
    names = [(column or "all").replace("_", " ") for column in columns]
    titles = [join(name, n) for name, n in zip(names, numbers, strict=True)]
    rows = [[name, *(cell(name, column) for column in columns)] for name in run.series]
    caption = join(tag("b", f"{metric} [{unit}]"), f": {DEFINITIONS[metric].text}. Mean ± sd over n sequences.")
    return table(caption, ["method", *titles], rows, label=metric)


def coverage_tables(run: RunData) -> Markup:
    """How much of the motion each method answered for."""
    rows = []
    for row in run.summary["methods"]:
        share = f"{100.0 * row['coverage']:.1f} %"
        counts = [f"{row[name]:,}" for name in ("frames_matched", "frames_expected")]
        doubtful = [f"{row[name]:,}" for name in ("frames_held", "frames_lost", "frames_not_finite")]
        rows.append([run.series_of(row), row["sequences"], *counts, share, *doubtful])
    head = ["method", "sequences", "frames matched", "expected", "share", "held", "lost", "not finite"]
    caption = (
        "Frames after the warm-up. Held: carried on because too little came in; "
        "lost: most stations had been gone for long; not finite counts as not matched."
    )
    failures = [tag("li", tag("b", cell), details(_last_line(text), tag("pre", text))) for cell, text in _failures(run)]
    failed = join(tag("h3", "Failed cells"), tag("ul", *failures)) if failures else None
    finished, planned = run.summary["cells_finished"], run.summary["cells_planned"]
    return join(
        tag("p", f"{finished} of {planned} cells finished."),
        table(caption, head, rows, label="coverage") if rows else None,
        failed,
    )


def health_tables(run: RunData) -> Markup:
    """What the stream lost, by station and by clip; every method on a clip was shown the same stream."""
    streams: dict[str, Trace] = {}
    for trace in sorted(run.traces, key=lambda trace: -len(trace.time_s)):
        if len(trace.time_s):
            streams.setdefault(trace.clip, trace)
    if not streams:
        return NOT_MEASURED
    rows = []
    for station in dict.fromkeys(name for trace in streams.values() for name in trace.stations):
        parts = [(trace, trace.stations.index(station)) for trace in streams.values() if station in trace.stations]
        valid = np.concatenate([t.position_valid[:, s] & t.orientation_valid[:, s] for t, s in parts])
        quality = np.concatenate([t.quality[:, s] for t, s in parts])
        suspect = np.concatenate([t.suspect[:, s] for t, s in parts])
        gap_s = max(_longest_gap_s(t, s) for t, s in parts)
        shares = [f"{100.0 * np.mean(column):.2f} %" for column in (valid, suspect)]
        rows.append([station.replace("_", " "), *shares, f"{np.nanmean(quality):.3f}", f"{gap_s:.2f}"])
    head = ["station", "valid", "suspect", "mean quality", "longest gap [s]"]
    caption = f"All frames of {len(streams)} clip{'s'[: len(streams) != 1]}. Gap: a run of frames without position."
    names = list(dict.fromkeys(name for trace in streams.values() for name in trace.health))
    counts = [[clip, *(_format_plain(trace.health.get(name)) for name in names)] for clip, trace in streams.items()]
    by_clip = table("Counts of the stream, by clip", ["clip", *names], counts, label="stream counts")
    return join(table(caption, head, rows, label="stream health"), details("Counts by clip", by_clip))


def all_metrics_table(run: RunData) -> Markup:
    """Every metric of every method over all sequences, with its definition."""
    found = {run.series_of(row): row["metrics"] for row in run.summary["methods"]}
    rows = []
    for metric, definition in DEFINITIONS.items():
        if not all(metric in metrics for metrics in found.values()):
            continue
        cells = []
        for metrics in found.values():
            frames = metrics[metric]["frame_weighted"]
            below = (
                None if frames is None else tag("span", format_number(frames, definition.unit), class_="spread under")
            )
            cells.append(join(format_statistics(metrics[metric], definition.unit), below))
        rows.append([join(f"{metric} [{definition.unit}]", tag("small", definition.text)), *cells])
    caption = "Mean ± sd over sequences; below it the figure over all frames together, where there is one."
    return table(caption, ["metric", *found], rows, label="every metric")


def _failures(run: RunData) -> list[tuple[str, str]]:
    return [(str(cell), str(text)) for cell, text in run.summary["failures"].items()]


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or ["no message"])[-1]


def _longest_gap_s(trace: Trace, station: int) -> float:
    """Time from the last valid frame before a gap to the first after it, less one period [s]."""
    seen = trace.time_s[trace.position_valid[:, station]]
    edges = np.concatenate([trace.time_s[:1], seen, trace.time_s[-1:]])
    period_s = float(np.min(np.diff(trace.time_s), initial=np.inf))
    longest = float(np.max(np.diff(edges), initial=0.0))
    return longest if longest > 1.5 * period_s else 0.0


def _format_plain(value: Any) -> Any:
    if value is None:
        return NOT_MEASURED
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_format_plain(item)}" for name, item in value.items())
    return f"{value:g}" if isinstance(value, float) else str(value)
