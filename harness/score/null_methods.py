"""Estimates without a tracker: the truth itself, and three simple estimates that give the scale of every score.

A method with a larger error than the frozen pose has learnt nothing. A method with a smaller error than the truth one
frame late is as good as its latency allows.
"""

from collections.abc import Callable

import numpy as np

from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.skeleton import Skeleton
from harness.score.score import Scores, score_estimate


def oracle(truth_qpos: Floats) -> Floats:
    """(T, 55) the truth."""
    return np.array(truth_qpos)


def last_value(truth_qpos: Floats) -> Floats:
    """(T, 55) the truth of the previous frame."""
    return np.concatenate([truth_qpos[:1], truth_qpos[:-1]])


def mean_pose(truth_qpos: Floats) -> Floats:
    """(T, 55) the true root with every hinge at its mean angle over the take."""
    out = np.array(truth_qpos)
    out[:, 7:] = truth_qpos[:, 7:].mean(axis=0)
    return out


def frozen_pose(truth_qpos: Floats) -> Floats:
    """(T, 55) the first frame, repeated."""
    return np.repeat(truth_qpos[:1], len(truth_qpos), axis=0)


NULL_METHODS: dict[str, Callable[[Floats], Floats]] = {
    function.__name__: function for function in (oracle, last_value, mean_pose, frozen_pose)
}


def score_null_methods(skeleton: Skeleton, rate_hz: float, truth_qpos: Floats) -> dict[str, Scores]:
    """Score every null method on one true motion (T, 55)."""
    frames = len(truth_qpos)
    status, untimed = np.full(frames, Status.SOLVED), np.full(frames, np.nan)
    return {
        name: score_estimate(skeleton, rate_hz, truth_qpos, null(truth_qpos), np.arange(frames), status, untimed)
        for name, null in NULL_METHODS.items()
    }
