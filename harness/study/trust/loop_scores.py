"""Errors of a method's answers to the frames of a capture or of a simulation: a few metrics, over all loops together.

The values are those of `experiment.score_recording`. Only the metrics of the plan are computed, and the true poses are
shared by all methods, because scoring would otherwise take as long as the fastest methods.
"""

from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.estimate import has_pose
from harness.experiment.method_run import MethodAnswers
from harness.experiment.score_recording import LoopFrames
from harness.score import contact
from harness.score.metrics import DEFINITIONS, FRAME_METRICS
from harness.score.pair import Pair, PoseSequence, compute_poses
from harness.score.score import COVERAGE_FLOOR, WARM_UP_S, pool_frames


def score_loops(
    metrics: Sequence[str], answers: MethodAnswers, loops: Sequence[LoopFrames], truth: PoseSequence, rate_hz: float
) -> dict[str, float | None]:
    """Metric -> value over all loops; None where it is not defined, and all None where too few frames have an estimate.

    `truth` has the poses at the rows that the loops name. The first second of the first loop is not scored.
    """
    qpos, ground_m = answers.by_frame()[0].qpos, contact.ground_m(truth)
    values: dict[str, list[Floats]] = {metric: [] for metric in metrics}
    matched = expected = 0
    for number, loop in enumerate(loops):
        first, last = int(loop.index[0]), int(loop.index[-1])
        warm_up = int(np.ceil(first + WARM_UP_S * rate_hz - 1e-9)) if number == 0 else 0
        answered = loop.rows < len(qpos)
        index, estimated = loop.index[answered], qpos[loop.rows[answered]]
        finite = has_pose(estimated)
        index = index[finite]
        pair = Pair(truth.at(index), compute_poses(truth.skeleton, estimated[finite]), index, rate_hz, ground_m)
        scored: Bools = index >= warm_up
        for metric in metrics if len(index) else ():
            values[metric].append(FRAME_METRICS[metric](pair)[scored])
        matched += int(scored.sum())
        expected += max(last + 1 - max(first, warm_up), 0)
    if not matched or matched < COVERAGE_FLOOR * expected:
        return dict.fromkeys(metrics)
    pooled = {metric: pool_frames(np.concatenate(values[metric]), DEFINITIONS[metric].pool) for metric in metrics}
    return {metric: value if np.isfinite(value) else None for metric, value in pooled.items()}
