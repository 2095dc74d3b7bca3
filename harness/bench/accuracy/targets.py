"""Targets of the accuracy benchmark: ratios of today's error to the stored one, averaged within a clip first."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.bench.accuracy.clip_errors import (
    ANGLE,
    JITTER,
    SILENT_ANGLE,
    SKATE,
    TRUE_JITTER,
    TRUE_SKATE,
    ClipErrors,
    ErrorsByCondition,
)
from harness.bench.limits import state_verdict
from harness.core.number_format import format_fixed
from harness.errors import BadInput
from harness.results.findings import BenchmarkStatement


@dataclass(frozen=True)
class Target:
    """The largest ratio of today's mean error to the stored one over some clips of a condition."""

    title: str
    condition: str
    """Name of a condition (see `conditions.Condition`)."""
    least: float
    """Ratio that must be met ("at least")."""
    goal: float
    performer: str = ""
    """Which performers' clips count: "known", "new", or "" for all."""
    metric: str = ANGLE


def _targets(name: str, performer: str, least: Sequence[float], goal: Sequence[float]) -> list[Target]:
    """The targets of a scenario's noise presets; those of one kind of performers leave out the preset `noise`."""
    presets = ("clean", "default") if performer else ("clean", "noise", "default")
    title = f"{name} {performer}," if performer else name
    limits = zip(presets, least, goal, strict=True)
    return [Target(f"{title} {preset}", f"{name}, {preset}", a, b, performer) for preset, a, b in limits]


TARGETS = (
    *_targets("boxing", "", (0.95, 0.84, 0.84), (0.83, 0.75, 0.75)),
    Target("boxing, torso's orientation, clean", "boxing_inputs, clean, pos+torso_ori", 0.92, 0.84),
    Target("boxing, positions, clean", "boxing_inputs, clean, pos", 0.94, 0.75),
    Target("boxing, mixed, clean", "boxing_inputs, clean, mixed", 0.95, 0.88),
    *_targets("walking", "known", (0.90, 0.72), (0.78, 0.62)),
    *_targets("walking", "new", (1.00, 0.97), (0.87, 0.85)),
    *_targets("jumping", "known", (0.87, 0.74), (0.76, 0.65)),
    *_targets("jumping", "new", (0.96, 0.93), (0.85, 0.84)),
    Target(
        "right hand silent, during, default",
        "recovery_boxing, default, right_hand silent",
        0.87,
        0.75,
        metric=SILENT_ANGLE,
    ),
    Target("torso silent, during, default", "recovery_boxing, default, torso silent", 1.00, 0.80, metric=SILENT_ANGLE),
)
"""The rows of the table, in its order."""
LAGGED_CONDITION = "boxing, default"
"""Condition of the cells with a fixed lag."""
LEAST_JITTER, GOAL_JITTER = (0.8, 1.2), (0.9, 1.1)
"""Range of the jitter of estimates with a lag, as a ratio to the truth's."""
LEAST_SKATE_MM_S, GOAL_SKATE_MM_S = 180.0, 130.0
"""Largest foot skate of estimates with a lag [mm/s]."""


def evaluate_targets(stored: ErrorsByCondition, today: ErrorsByCondition) -> list[BenchmarkStatement]:
    """Evaluate the targets whose condition was measured today; BadInput when the sides differ in clips or seeds."""
    return [evaluate_target(target, stored, today) for target in TARGETS if _select(target, today)]


def evaluate_target(target: Target, stored: ErrorsByCondition, today: ErrorsByCondition) -> BenchmarkStatement:
    """Evaluate one target on means over its clips; BadInput when a clip, a seed or a value is missing on a side."""
    before, now = _select(target, stored), _select(target, today)
    if before.keys() != now.keys() or not now:
        sides = (("today", before.keys() - now.keys()), ("in the stored errors", now.keys() - before.keys()))
        missing = [f"{', '.join(sorted(clips))} {where}" for where, clips in sides if clips]
        raise BadInput(
            f"{target.condition}: {'; '.join(missing) or 'every clip'} missing.",
            "Compare errors of the same clips: run with the scenarios of the stored errors.",
        )
    clips = tuple(sorted(now))
    for clip in clips:
        _check_seeds(target, clip, before[clip], now[clip])
    stored_deg, today_deg = (
        float(np.mean([require_mean(side[clip], target.metric, clip) for clip in clips])) for side in (before, now)
    )
    ratio = today_deg / stored_deg
    return state_verdict(
        target.title,
        f"<= {target.least:.2f} (goal {target.goal:.2f})",
        format_fixed(ratio, 3) + _goal_note(ratio <= target.goal),
        ratio <= target.least,
        f"{format_fixed(today_deg, 2)} deg today, {format_fixed(stored_deg, 2)} stored",
        clips=len(clips),
        value=ratio,
        more={
            "condition": target.condition,
            "clip_names": list(clips),
            "stored_deg": stored_deg,
            "today_deg": today_deg,
            "at_least": target.least,
            "goal": target.goal,
        },
    )


def _select(target: Target, errors: ErrorsByCondition) -> dict[str, ClipErrors]:
    """The clips of a target."""
    by_clip = errors.get(target.condition, {})
    return {clip: e for clip, e in by_clip.items() if target.performer in ("", e.performer)}


def _check_seeds(target: Target, clip: str, before: ClipErrors, now: ClipErrors) -> None:
    counts = [len(side.by_metric.get(target.metric, ())) for side in (before, now)]
    if counts[0] != counts[1]:
        raise BadInput(
            f"{target.condition}: {clip} has {counts[1]} seeds today and {counts[0]} in the stored errors.",
            "Use the same seeds.",
        )


def require_mean(errors: ClipErrors, metric: str, clip: str) -> float:
    """Mean of a metric over the seeds of a clip; BadInput where it was not measured."""
    mean = errors.mean(metric)
    if mean is None:
        raise BadInput(f"{metric} of {clip} was not measured.", "Leave out the clip on both sides.")
    return mean


def evaluate_lag(
    method: str, by_clip: Mapping[str, ClipErrors], stored: Mapping[str, ClipErrors]
) -> list[BenchmarkStatement]:
    """Jitter and foot skate of the cells of `method`, whose name has the lag, beside the stored errors without one."""
    clips = sorted(by_clip)
    jitter, true_jitter, skate, true_skate, angle = (
        float(np.mean([require_mean(by_clip[clip], metric, clip) for clip in clips]))
        for metric in (JITTER, TRUE_JITTER, SKATE, TRUE_SKATE, ANGLE)
    )
    before = {metric: mean_of(stored, metric) for metric in (JITTER, TRUE_JITTER, SKATE)}
    ratio, title = jitter / true_jitter, f"{method}, {LAGGED_CONDITION}"
    more = {"clip_names": clips, "angle_deg": angle, "true_skate_mm_s": true_skate}
    ranges = [f"{low:g} to {high:g}" for low, high in (LEAST_JITTER, GOAL_JITTER)]
    return [
        state_verdict(
            f"{title}: jitter over truth's",
            f"{ranges[0]} (goal {ranges[1]})",
            format_fixed(ratio, 2) + _goal_note(GOAL_JITTER[0] <= ratio <= GOAL_JITTER[1]),
            LEAST_JITTER[0] <= ratio <= LEAST_JITTER[1],
            f"{before[JITTER] / before[TRUE_JITTER]:.2f} stored; joint angle {angle:.2f} deg with the lag",
            clips=len(clips),
            value=ratio,
            more=more,
        ),
        state_verdict(
            f"{title}: foot skate",
            f"<= {LEAST_SKATE_MM_S:g} (goal {GOAL_SKATE_MM_S:g})",
            f"{skate:.0f} mm/s" + _goal_note(skate <= GOAL_SKATE_MM_S),
            skate <= LEAST_SKATE_MM_S,
            f"{before[SKATE]:.0f} mm/s stored, truth {true_skate:.0f}",
            clips=len(clips),
            value=skate,
            unit="mm/s",
            more=more,
        ),
    ]


def _goal_note(is_met: bool) -> str:
    return " (goal met)" if is_met else ""


def mean_of(errors: Mapping[str, ClipErrors], metric: str) -> float:
    """Mean of a metric over the clips on which it was measured; NaN without any."""
    values = [value for clip in errors.values() if (value := clip.mean(metric)) is not None]
    return float(np.mean(values)) if values else float("nan")
