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
from harness.errors import BadInput


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


def _noise_targets(name: str, least: Sequence[float], goal: Sequence[float]) -> list[Target]:
    presets = ("clean", "noise", "default")
    return [Target(f"{name} {p}", f"{name}, {p}", a, b) for p, a, b in zip(presets, least, goal, strict=True)]


def _performer_targets(name: str, performer: str, least: Sequence[float], goal: Sequence[float]) -> list[Target]:
    return [
        Target(f"{name} {performer}, {preset}", f"{name}, {preset}", a, b, performer)
        for preset, a, b in zip(("clean", "default"), least, goal, strict=True)
    ]


TARGETS = (
    *_noise_targets("boxing", (0.95, 0.84, 0.84), (0.83, 0.75, 0.75)),
    Target("boxing, torso's orientation, clean", "boxing_inputs, clean, pos+torso_ori", 0.92, 0.84),
    Target("boxing, positions, clean", "boxing_inputs, clean, pos", 0.94, 0.75),
    Target("boxing, mixed, clean", "boxing_inputs, clean, mixed", 0.95, 0.88),
    *_performer_targets("walking", "known", (0.90, 0.72), (0.78, 0.62)),
    *_performer_targets("walking", "new", (1.00, 0.97), (0.87, 0.85)),
    *_performer_targets("jumping", "known", (0.87, 0.74), (0.76, 0.65)),
    *_performer_targets("jumping", "new", (0.96, 0.93), (0.85, 0.84)),
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


@dataclass(frozen=True)
class TargetResult:
    """A target with both errors, means over the clips."""

    target: Target
    clips: tuple[str, ...]
    stored: float
    today: float

    @property
    def ratio(self) -> float:
        """Today's error relative to the stored one."""
        return self.today / self.stored

    @property
    def met(self) -> str:
        """What is met: "goal", "at least" or "no"."""
        return "goal" if self.ratio <= self.target.goal else "at least" if self.ratio <= self.target.least else "no"


@dataclass(frozen=True)
class LagResult:
    """Jitter and foot skate of the cells with a fixed lag, means over the clips."""

    method: str
    clips: tuple[str, ...]
    jitter_ratio: float
    """Mean jitter relative to the truth's."""
    skate_mm_s: float
    true_skate_mm_s: float
    angle_deg: float

    @property
    def jitter_met(self) -> str:
        """What the jitter meets: "goal", "at least" or "no"."""
        for word, (low, high) in (("goal", GOAL_JITTER), ("at least", LEAST_JITTER)):
            if low <= self.jitter_ratio <= high:
                return word
        return "no"

    @property
    def skate_met(self) -> str:
        """What the skate meets: "goal", "at least" or "no"."""
        least = "at least" if self.skate_mm_s <= LEAST_SKATE_MM_S else "no"
        return "goal" if self.skate_mm_s <= GOAL_SKATE_MM_S else least


def evaluate_targets(stored: ErrorsByCondition, today: ErrorsByCondition) -> list[TargetResult]:
    """Evaluate the targets whose condition was measured today; BadInput when the sides differ in clips or seeds."""
    return [evaluate_target(target, stored, today) for target in TARGETS if _select(target, today)]


def evaluate_target(target: Target, stored: ErrorsByCondition, today: ErrorsByCondition) -> TargetResult:
    """Evaluate one target; BadInput when a clip, a seed or a value is missing on either side."""
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
    means = [np.mean([require_mean(side[clip], target.metric, clip) for clip in clips]) for side in (before, now)]
    return TargetResult(target, clips, float(means[0]), float(means[1]))


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


def evaluate_lag(method: str, by_clip: Mapping[str, ClipErrors]) -> LagResult:
    """Evaluate the cells of `method`, whose name has the lag."""
    clips = tuple(sorted(by_clip))
    jitter, true_jitter, skate, true_skate, angle = (
        float(np.mean([require_mean(by_clip[clip], metric, clip) for clip in clips]))
        for metric in (JITTER, TRUE_JITTER, SKATE, TRUE_SKATE, ANGLE)
    )
    return LagResult(method, clips, jitter / true_jitter, skate, true_skate, angle)
