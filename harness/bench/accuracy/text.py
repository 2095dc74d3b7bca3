"""Text and JSON of the accuracy benchmark."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from harness.bench.accuracy.clip_errors import JITTER, POSITION, SKATE, TRUE_JITTER, TRUE_SKATE, ErrorsByCondition
from harness.bench.accuracy.measurement import AccuracyReport
from harness.bench.accuracy.statements import LARGEST_RATIO
from harness.bench.accuracy.targets import (
    GOAL_JITTER,
    GOAL_SKATE_MM_S,
    LAGGED_CONDITION,
    LEAST_JITTER,
    LEAST_SKATE_MM_S,
    LagResult,
    TargetResult,
)
from harness.core.number_format import count_noun, format_fixed, format_interval
from harness.core.text_table import Table


def format_report(report: AccuracyReport) -> str:
    """Format a report as text tables."""
    if report.failures:
        lines = [f"{cell}: {failure.strip().splitlines()[-1]}" for cell, failure in report.failures.items()]
        return "\n".join([*lines, f"{count_noun(len(lines), 'cell')} failed, so nothing is compared."])
    return "\n\n".join(_sections(report))


def _sections(report: AccuracyReport) -> Iterator[str]:
    yield f"{report.method} against {report.stored_title}: joint angle [deg], mean over clips, seeds averaged first"
    yield "\n".join(_target_table(report).lines())
    yield _lag_text(report)
    yield "\n".join(("position, jitter and foot skate:", *_motion_table(report).lines()))
    yield "\n".join(("pooled clips, paired 95 % intervals [deg]:", *_statement_table(report).lines()))
    yield "\n".join(_ranking_lines(report))
    yield "\n".join(_worse_lines(report))
    if report.quick:
        yield "The quick form has one seed and few clips: no verdict."


def _target_table(report: AccuracyReport) -> Table:
    head = ["condition", "clips", report.stored_title, "today", "ratio", "at least", "goal", "met"]
    return Table(head, [_target_row(result) for result in report.targets])


def _target_row(result: TargetResult) -> list[str]:
    target = result.target
    errors = [format_fixed(value, 2) for value in (result.stored, result.today)]
    ratios = [format_fixed(result.ratio, 3), f"{target.least:.2f}", f"{target.goal:.2f}"]
    return [target.title, str(len(result.clips)), *errors, *ratios, result.met]


def _lag_text(report: AccuracyReport) -> str:
    if report.lag is None:
        return f"two frames of lag: not measured ({report.no_lag})"
    lag: LagResult = report.lag
    low, high = (f"{a:g} to {b:g}" for a, b in (LEAST_JITTER, GOAL_JITTER))
    head = ["two frames of lag, boxing default", report.stored_title, "today", "truth", "at least", "goal", "met"]
    _, ratio, skate_mm_s, _ = _motion_cells(report.stored, LAGGED_CONDITION)
    jitter = ["jitter over truth's", ratio, format_fixed(lag.jitter_ratio, 2), "1", low, high, lag.jitter_met]
    values = (lag.skate_mm_s, lag.true_skate_mm_s, LEAST_SKATE_MM_S, GOAL_SKATE_MM_S)
    skate = [skate_mm_s, *(f"{value:.0f}" for value in values)]
    rows = [jitter, ["foot skate [mm/s]", *skate, lag.skate_met]]
    note = f"{lag.method}: joint angle {lag.angle_deg:.2f} deg at the frames that it answers"
    return "\n".join((*Table(head, rows).lines(), note))


def _motion_table(report: AccuracyReport) -> Table:
    """Position, jitter over the truth's, and foot skate by condition, of the stored errors and of today's."""
    head = ["condition", "method", "position [mm]", "jitter/truth", "foot skate [mm/s]", "truth's"]
    today = report.by_method[report.method]
    sides = {report.stored_title: report.stored, report.method: today}
    rows = [
        [condition, name, *_motion_cells(errors, condition)] for condition in today for name, errors in sides.items()
    ]
    return Table(head, rows, text_columns=2)


def _motion_cells(errors: ErrorsByCondition, condition: str) -> list[str]:
    means = []
    for metric in (POSITION, JITTER, TRUE_JITTER, SKATE, TRUE_SKATE):
        values = [value for e in errors.get(condition, {}).values() if (value := e.mean(metric)) is not None]
        means.append(float(np.mean(values)) if values else float("nan"))
    position, jitter, true_jitter, skate, true_skate = means
    return [f"{position:.1f}", f"{jitter / true_jitter:.2f}", f"{skate:.0f}", f"{true_skate:.0f}"]


def _statement_table(report: AccuracyReport) -> Table:
    head = ["performers", "noise", "clips", report.method, "other", "error", "difference", "interval", "verdict"]
    rows = []
    for s in report.statements:
        interval = format_interval(s.difference.low, s.difference.high, 2, signed=True)
        means = [format_fixed(value, 2) for value in (s.mean_deg, s.other_mean_deg)]
        difference = format_fixed(s.difference.mean, 2, signed=True)
        verdict = s.verdict if s.difference.low is not None else s.difference.why
        cells = [s.performer, s.noise, str(len(s.difference.units)), means[0], s.other, means[1]]
        rows.append([*cells, difference, interval, verdict])
    return Table(head, rows, text_columns=2)


def _ranking_lines(report: AccuracyReport) -> Iterator[str]:
    """One line for each ranking, the lowest mean first."""
    for (performer, noise), ranking in report.rankings.items():
        order = ", ".join(f"{name} {mean:.2f}" for name, mean in ranking.means.items())
        best = f"{ranking.best} is better than every other one" if ranking.best else "no method is best"
        yield f"{performer} performers, {noise}, {count_noun(len(ranking.clips), 'clip')}: {order}; {best}"


def _worse_lines(report: AccuracyReport) -> Iterator[str]:
    percent = f"{100.0 * (LARGEST_RATIO - 1.0):.0f} %"
    if not report.worse_clips:
        others = f"{report.stored_title}, dynamic_map or ik"
        yield f"On no clip is {report.method} worse than {others} by more than {percent}."
        return
    yield f"{report.method} is worse by more than {percent} on:"
    head = ["condition", "clip", "today", "other", "error", "ratio"]
    rows = [
        [w.condition, w.clip, f"{w.error_deg:.2f}", w.other, f"{w.other_error_deg:.2f}", f"{w.ratio:.3f}"]
        for w in report.worse_clips
    ]
    yield from Table(head, rows, text_columns=2).lines()


def report_content(report: AccuracyReport) -> dict[str, Any]:
    """The content of the JSON output; errors are means over seeds."""
    return {
        "method": report.method,
        "stored": report.stored_title,
        "quick": report.quick,
        "failures": dict(report.failures),
        "targets": [
            {
                "title": r.target.title,
                "condition": r.target.condition,
                "clips": list(r.clips),
                "stored_deg": r.stored,
                "today_deg": r.today,
                "ratio": r.ratio,
                "at_least": r.target.least,
                "goal": r.target.goal,
                "met": r.met,
            }
            for r in report.targets
        ],
        "lag": None if report.lag is None else {**vars(report.lag), "clips": list(report.lag.clips)},
        "no_lag": report.no_lag,
        "statements": [
            {
                "performers": s.performer,
                "noise": s.noise,
                "method": s.method,
                "other": s.other,
                "clips": list(s.difference.units),
                "mean_deg": s.mean_deg,
                "other_mean_deg": s.other_mean_deg,
                "difference_deg": s.difference.mean,
                "low_deg": s.difference.low,
                "high_deg": s.difference.high,
                "verdict": s.verdict,
                "holds": s.holds,
            }
            for s in report.statements
        ],
        "rankings": [
            {"performers": performer, "noise": noise, "means_deg": ranking.means, "best": ranking.best}
            for (performer, noise), ranking in report.rankings.items()
        ],
        "worse_clips": [{**vars(w), "ratio": w.ratio} for w in report.worse_clips],
        "clips": {
            name: {
                condition: {clip: {metric: e.mean(metric) for metric in e.by_metric} for clip, e in by_clip.items()}
                for condition, by_clip in errors.items()
            }
            for name, errors in report.by_method.items()
        },
    }
