"""Targets of the set-ups: ratios of a method's error to that of the best stored method, and how well its sigma holds.

The reference of a row is the stored method with the least mean joint angle error on it. Clips of a performer are
averaged first. Known and new performers, built-in and real ones have rows of their own.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.bench.accuracy.clip_errors import ANGLE, COVERAGES, POSITION, ClipErrors, ErrorsByCondition
from harness.bench.accuracy.conditions import Condition
from harness.bench.accuracy.setups import MOTIONS, SETUPS
from harness.bench.accuracy.targets import require_mean
from harness.bench.limits import state_verdict
from harness.compare import average_units
from harness.core.number_format import format_fixed
from harness.errors import BadInput
from harness.results.findings import BenchmarkStatement

Limits = tuple[float, float]
"""The largest ratio that is allowed ("at least"), and the goal."""
ANGLE_LIMITS: Mapping[str, Mapping[str, Limits]] = {
    "six_stations": {"known": (1.01, 0.95), "new": (0.99, 0.93)},
    "six_noise": {"known": (1.01, 0.95), "new": (0.99, 0.93)},
    "six_clean": {"known": (1.01, 0.95), "new": (0.99, 0.93), "new walkers": (0.96, 0.90)},
    "six_positions": {"new": (0.93, 0.85)},
    "head_hands_pelvis": {"new": (0.95, 0.88)},
    "head_hands_ankles": {"new": (0.98, 0.92)},
    "head_hands": {"new": (0.93, 0.85)},
    "one_hand": {"known": (0.93, 0.85), "new": (0.93, 0.85)},
    "dropout_30": {"known": (1.00, 0.90), "new": (0.93, 0.85)},
    "t_pose": {},
    "baud_9600": {"known": (0.65, 0.50), "new": (0.75, 0.60)},
    "baud_19200": {"known": (0.50, 0.40), "new": (0.62, 0.52)},
    "baud_9600_at_4_hz": {"known": (0.40, 0.30), "new": (0.65, 0.55)},
}
"""Set-up -> group of performers -> limits of the joint angle error."""
POSITION_LIMITS: Mapping[str, Mapping[str, Limits]] = {"head_hands": {"new": (0.87, 0.78)}}
"""Set-up -> group of performers -> limits of the position error."""
GROUPS = ("known", "new", "new walkers")
WORSE_BY = 1.05
"""Ratio above which a clip is worse than the reference."""
MOST_WORSE: Limits = (0.15, 0.05)
"""Largest share of clips that are worse than the reference, and the goal."""
COVERAGE_RANGES = (((0.60, 0.76), (0.64, 0.72)), ((0.91, 0.98), (0.93, 0.97)))
"""Ranges of the shares of errors within one stated sigma and within the stated 95 % region, and the goals."""


@dataclass(frozen=True)
class SetUpRow:
    """One set-up with one group of performers on built-in or real motion."""

    setup: str
    group: str
    motion: str
    """ "built-in" or "CMU"."""
    ours: Mapping[str, ClipErrors]
    references: Mapping[str, Mapping[str, ClipErrors]]
    """Stored method -> clip -> errors."""

    @property
    def title(self) -> str:
        """The row in words, such as "baud 9600, new, CMU"."""
        return f"{self.setup.replace('_', ' ')}, {self.group}, {self.motion}"

    @property
    def reference(self) -> str:
        """The stored method with the least mean joint angle error."""
        return min(self.references, key=lambda name: mean_over_units(self.references[name], ANGLE))

    @property
    def clip_ratios(self) -> dict[str, float]:
        """Clip -> ratio of the joint angle error to the reference's."""
        reference = self.references[self.reference]
        return {
            clip: require_mean(e, ANGLE, clip) / require_mean(reference[clip], ANGLE, clip)
            for clip, e in self.ours.items()
        }


def mean_over_units(errors: Mapping[str, ClipErrors], metric: str) -> float:
    """Mean over performers of their clips' means [unit of the metric]; BadInput where a clip was not measured."""
    return float(
        np.mean(list(average_units({clip: require_mean(e, metric, clip) for clip, e in errors.items()}).values()))
    )


def setup_rows(ours: ErrorsByCondition, stored: Mapping[str, ErrorsByCondition]) -> list[SetUpRow]:
    """The rows of all set-ups; BadInput where one was not measured, and where clips differ from the stored ones.

    Real clips are known or new by their scenario, built-in ones by their performer.
    """
    rows = []
    for setup in SETUPS:
        for group in GROUPS:
            for motion in ("built-in", "CMU"):
                chosen = _select(setup, group, motion, ours)
                others = {name: _select(setup, group, motion, errors) for name, errors in stored.items()}
                if group == "new walkers" and group not in ANGLE_LIMITS[setup]:
                    continue
                if not chosen:
                    raise BadInput(f"{setup}, {group}, {motion}: no cell was measured.", "")
                if strange := [name for name, errors in others.items() if errors.keys() != chosen.keys()]:
                    raise BadInput(f"{setup}, {group}, {motion}: other clips than those of {strange[0]}.", "")
                rows.append(SetUpRow(setup, group, motion, chosen, others))
    return rows


def _select(setup: str, group: str, motion: str, errors: ErrorsByCondition) -> dict[str, ClipErrors]:
    """Clip -> errors of one row."""
    builtin, known, new = MOTIONS
    kind = group.split()[0]
    scenario = builtin if motion == "built-in" else known if kind == "known" else new
    by_clip = errors.get(str(Condition(scenario, SETUPS[setup].noise, SETUPS[setup].inputs, setup=setup)), {})
    return {
        clip: e
        for clip, e in by_clip.items()
        if (motion == "CMU" or e.performer == kind) and (group != "new walkers" or e.behaviour == "walking")
    }


def evaluate_setups(
    method: str, ours: ErrorsByCondition, stored: Mapping[str, ErrorsByCondition], commit: str
) -> list[BenchmarkStatement]:
    """The statements of all measured set-ups: error, position, clips that are worse, and sigma."""
    rows = setup_rows(ours, stored)
    found = [_state_ratio(row, ANGLE, ANGLE_LIMITS, commit) for row in rows]
    found += [_state_ratio(row, POSITION, POSITION_LIMITS, commit) for row in rows]
    return [*found, *_state_worse_clips(rows), *(one for row in rows for one in _state_coverage(method, row))]


def _state_ratio(
    row: SetUpRow, metric: str, limits: Mapping[str, Mapping[str, Limits]], commit: str
) -> BenchmarkStatement:
    """The ratio of a mean error to the reference's; without limits for information."""
    unit = "deg" if metric == ANGLE else "mm"
    today, before = (mean_over_units(errors, metric) for errors in (row.ours, row.references[row.reference]))
    limit = limits.get(row.setup, {}).get(row.group)
    ratio = today / before
    goal = " (goal met)" if limit and ratio <= limit[1] else ""
    return state_verdict(
        f"{row.title}: {'joint angle' if metric == ANGLE else 'position'}",
        f"<= {limit[0]:.2f} (goal {limit[1]:.2f})" if limit else "",
        format_fixed(ratio, 3) + goal,
        ratio <= limit[0] if limit else None,
        f"{format_fixed(today, 2)} {unit}, {row.reference} of {commit[:7]} {format_fixed(before, 2)}",
        clips=len(average_units(dict.fromkeys(row.ours, 0.0))),
        value=ratio,
        more={"setup": row.setup, "performers": row.group, "motion": row.motion, "reference": row.reference},
    )


def _state_worse_clips(rows: Sequence[SetUpRow]) -> Iterator[BenchmarkStatement]:
    """The share of clips on which the method is worse than the reference, over all set-ups with the same performers."""
    for group in ("known", "new"):
        for motion in ("built-in", "CMU"):
            ratios = [
                ratio
                for row in rows
                if (row.group, row.motion) == (group, motion)
                for ratio in row.clip_ratios.values()
            ]
            if not ratios:
                continue
            share = float(np.mean([ratio > WORSE_BY for ratio in ratios]))
            yield state_verdict(
                f"all set-ups, {group}, {motion}: clips worse by more than 5 %",
                f"<= {MOST_WORSE[0]:.0%} (goal {MOST_WORSE[1]:.0%})",
                f"{share:.1%}" + (" (goal met)" if share <= MOST_WORSE[1] else ""),
                share <= MOST_WORSE[0],
                f"largest ratio {format_fixed(max(ratios), 2)}",
                clips=len(ratios),
                value=share,
                more={"performers": group, "motion": motion},
            )


def _state_coverage(method: str, row: SetUpRow) -> Iterator[BenchmarkStatement]:
    """Shares of errors within one stated sigma and the stated 95 % region; nothing for a method that states none."""
    for metric, (allowed, goal), sigmas in zip(COVERAGES, COVERAGE_RANGES, ("1 sigma", "95 % region"), strict=True):
        values = {clip: value for clip, e in row.ours.items() if (value := e.mean(metric)) is not None}
        if not values:
            continue
        share = float(np.mean(list(average_units(values).values())))
        met = " (goal met)" if goal[0] <= share <= goal[1] else ""
        yield state_verdict(
            f"{row.title}: {method} within {sigmas}",
            f"{allowed[0]:.0%} to {allowed[1]:.0%} (goal {goal[0]:.0%} to {goal[1]:.0%})",
            f"{share:.1%}{met}",
            allowed[0] <= share <= allowed[1],
            clips=len(average_units(values)),
            value=share,
            more={"setup": row.setup, "performers": row.group, "motion": row.motion},
        )
