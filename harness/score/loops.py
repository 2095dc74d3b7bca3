"""Errors of estimates of a motion that was observed once or in several loops."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.estimate import has_pose
from harness.core.skeleton import Skeleton
from harness.score import contact
from harness.score.metrics import DEFINITIONS, FRAME_METRICS, Pool
from harness.score.pair import Pair, PoseSequence, compute_poses

WARM_UP_S = 1.0
"""Estimates in this first part of a take are not scored [s] (choice)."""
COVERAGE_FLOOR = 0.5
"""With a smaller share of matched frames, only coverage is measured (choice)."""


@dataclass(frozen=True, eq=False)
class LoopFrames:
    """Frames of one loop of the motion within one session of the line."""

    rows: Ints
    """(N,) indices of the observed frames."""
    index: Ints
    """(N,) indices of the true frames, strictly increasing."""
    expected: range = field(default=range(0))
    """True frames that should have been observed; by default those between the first and the last one that was."""

    def __post_init__(self) -> None:
        if not self.expected and len(self.index):
            object.__setattr__(self, "expected", range(int(self.index[0]), int(self.index[-1]) + 1))


@dataclass(frozen=True, eq=False)
class LoopScores:
    """Errors of N estimates, loop after loop."""

    rows: Ints
    """(N,) rows of the estimates."""
    index: Ints
    """(N,) their true frames."""
    warm: Bools
    """(N,) estimates after the warm-up."""
    scored: Bools
    """(N,) those of them that are finite."""
    per_frame: Mapping[str, Floats]
    """Metric -> (N,) values; NaN where undefined (no contact, a gap, an estimate that is not finite)."""
    expected: int
    """Number of true frames after the warm-up."""
    pairs: tuple[Pair, ...]
    """Truth and scored estimates of each loop."""

    @property
    def matched(self) -> int:
        """Number of scored estimates."""
        return int(self.scored.sum())

    @property
    def coverage(self) -> float:
        """Share of the expected frames that are matched."""
        return self.matched / self.expected if self.expected else 0.0

    def is_enough(self, floor: float = COVERAGE_FLOOR) -> bool:
        """Whether errors count: the coverage reaches the floor."""
        return self.expected > 0 and self.coverage >= floor

    def pooled(self) -> dict[str, float]:
        """Metric -> value over all loops; NaN where it is undefined."""
        return {
            name: pool_frames(values[self.scored], DEFINITIONS[name].pool) for name, values in self.per_frame.items()
        }


def score_loops(
    truth: PoseSequence,
    rate_hz: float,
    estimate_qpos: Floats,
    loops: Sequence[LoopFrames],
    *,
    metrics: Sequence[str] = tuple(FRAME_METRICS),
    estimate_skeleton: Skeleton | None = None,
    warm_up_s: float = WARM_UP_S,
) -> LoopScores:
    """Errors of F configurations (F, 55) against the E true poses that one or more loops relate them to.

    `metrics` are those to compute, of `FRAME_METRICS`. The first loop begins with the warm-up. Frames without an
    estimate, because the method waits for later frames, are expected and not matched.
    """
    skeleton, ground_m = estimate_skeleton or truth.skeleton, contact.ground_m(truth) if len(truth.root_m) else 0.0

    def score(loop: LoopFrames, warm_up: int) -> LoopScores:
        answered = loop.rows < len(estimate_qpos)
        rows, index = loop.rows[answered], loop.index[answered]
        finite, warm = has_pose(estimate_qpos[rows]), index >= warm_up
        matched = index[finite]
        estimate = compute_poses(skeleton, estimate_qpos[rows[finite]])
        pair = Pair(truth.at(matched), estimate, matched, rate_hz, ground_m)
        per_frame = {name: np.full(len(rows), np.nan) for name in metrics}
        for name in metrics if len(matched) else ():
            per_frame[name][finite] = FRAME_METRICS[name](pair)
        expected = max(loop.expected.stop - max(loop.expected.start, warm_up), 0)
        return LoopScores(rows, index, warm, finite & warm, per_frame, expected, (pair.at(matched >= warm_up),))

    warm_up = int(np.ceil(loops[0].expected.start + warm_up_s * rate_hz - 1e-9))
    parts = [score(loop, 0 if number else warm_up) for number, loop in enumerate(loops)]
    rows, index, warm, scored = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("rows", "index", "warm", "scored")
    )
    per_frame = {name: np.concatenate([part.per_frame[name] for part in parts]) for name in metrics}
    pairs = tuple(pair for part in parts for pair in part.pairs)
    return LoopScores(rows, index, warm, scored, per_frame, sum(part.expected for part in parts), pairs)


def pool_frames(values: Floats, pool: Pool) -> float:
    """Pool per-frame values to one number; undefined values are left out; NaN without values."""
    defined = values[np.isfinite(values)]
    if not len(defined) or pool == "none":
        return float("nan")
    return float(np.sqrt(np.mean(defined**2))) if pool == "rms" else float(np.mean(defined))
