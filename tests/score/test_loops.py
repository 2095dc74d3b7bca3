"""Errors over the loops of a recording: the values of the general scoring of each loop."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.score.loops import LoopFrames, score_loops
from harness.score.pair import PoseSequence, compute_poses
from tests.scored_run import RATE_HZ, Judge


@pytest.fixture
def truth(truth_qpos: Floats) -> PoseSequence:
    return compute_poses(standard_skeleton(), truth_qpos)


@pytest.fixture
def estimate_qpos(truth_qpos: Floats, rng: np.random.Generator) -> Floats:
    """Estimates of the first 200 frames, off by random angles."""
    estimate = truth_qpos[:200].copy()
    estimate[:, 7:] += 0.05 * rng.normal(size=estimate[:, 7:].shape)
    return estimate


def loops(*parts: slice) -> list[LoopFrames]:
    return [LoopFrames(np.arange(200)[part], np.arange(200)[part]) for part in parts]


def test_loops_count_together_and_only_the_first_warms_up(
    truth: PoseSequence, estimate_qpos: Floats, judge: Judge
) -> None:
    found = score_loops(truth, RATE_HZ, estimate_qpos, loops(slice(20, 120), slice(120, 200)))
    assert (found.matched, found.expected, found.coverage) == (140, 140, 1.0)
    np.testing.assert_array_equal(found.index, np.arange(20, 200))
    np.testing.assert_array_equal(found.scored, np.arange(20, 200) >= 60)
    whole = judge(estimate_qpos).per_frame["joint_angle_mean_deg"]
    assert found.pooled()["joint_angle_mean_deg"] == pytest.approx(np.mean(whole[60:]), rel=1e-12)


def test_differences_do_not_reach_over_the_end_of_a_loop(truth: PoseSequence, estimate_qpos: Floats) -> None:
    found = score_loops(truth, RATE_HZ, estimate_qpos, loops(slice(0, 100), slice(100, 200)), metrics=["jitter_m_s3"])
    assert list(found.per_frame) == ["jitter_m_s3"]
    undefined = np.isnan(found.per_frame["jitter_m_s3"])
    assert undefined[100:103].all()
    assert not undefined[103:].any()


def test_half_of_the_frames_are_needed(truth: PoseSequence, estimate_qpos: Floats) -> None:
    estimate_qpos[40:121] = np.nan  # 81 of the 160 frames after the warm-up
    (loop,) = loops(slice(None))
    assert not score_loops(truth, RATE_HZ, estimate_qpos, [loop]).is_enough()
    estimate_qpos[120] = 0.0
    estimate_qpos[120, 3] = 1.0
    assert score_loops(truth, RATE_HZ, estimate_qpos, [loop]).is_enough()
    nothing = score_loops(truth, RATE_HZ, estimate_qpos[:0], [loop])
    assert (nothing.matched, nothing.expected, nothing.is_enough()) == (0, 160, False)
    assert np.isnan(list(nothing.pooled().values())).all()


def test_frames_are_expected_where_the_loop_says_so(truth: PoseSequence, estimate_qpos: Floats) -> None:
    """A simulation expects all of its frames, also those before the first and after the last that arrived."""
    rows = np.arange(50, 150)
    found = score_loops(truth, RATE_HZ, estimate_qpos, [LoopFrames(rows, rows, range(200))])
    assert (found.matched, found.expected) == (100, 160)


def test_a_lag_leaves_the_last_frames_without_an_answer(truth: PoseSequence, estimate_qpos: Floats) -> None:
    (loop,), (shorter,) = loops(slice(None)), loops(slice(0, 195))
    late, kept = (
        score_loops(truth, RATE_HZ, qpos, [one])
        for qpos, one in ((estimate_qpos[:195], loop), (estimate_qpos, shorter))
    )
    np.testing.assert_equal(late.pooled(), kept.pooled())
    assert (late.matched, late.expected) == (155, 160)
