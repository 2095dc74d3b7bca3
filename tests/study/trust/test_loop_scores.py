"""Errors over the loops of a recording: the values of the general scoring."""

import numpy as np
import pytest

from harness.core.arrays import Ints
from harness.core.seeds import generator
from harness.experiment.method_run import MethodAnswers, run_method
from harness.experiment.playback import prepare_playback
from harness.experiment.score_recording import LoopFrames, match_recording, score_methods
from harness.reconstruct import registry
from harness.score.pair import compute_poses
from harness.score.score import score_estimate
from harness.stream.recording.replay import RecordingStream
from harness.study.trust.loop_scores import score_loops
from harness.study.trust.plan import COMPARED_METRICS
from tests.study.trust.conftest import CLIPS, SmallStudy

METRICS = COMPARED_METRICS


@pytest.mark.long
def test_every_metric_of_a_capture_has_the_value_of_the_general_scoring(small_study: SmallStudy) -> None:
    stream = RecordingStream(small_study.captures[2])
    playback = prepare_playback(small_study.plan.with_name("small.toml"), clip=CLIPS[2])
    (expected,) = score_methods(stream, playback, ["ik:previous"])
    matched = match_recording(stream, playback)
    fitted = playback.clip_evaluation.fit_method(registry.resolve("ik:previous"), "ik:previous")
    answers = run_method(fitted, playback.calibration, matched.frames)
    truth = compute_poses(playback.body.skeleton, playback.simulation.truth_qpos)
    found = score_loops(METRICS, answers, matched.loops, truth, 40.0)
    assert found == pytest.approx({metric: expected.metrics[metric] for metric in METRICS}, rel=1e-12)
    assert found["mpjpe_mm"] is not None


@pytest.fixture(scope="module")
def made() -> tuple[MethodAnswers, Ints]:
    """Answers to 200 frames that are off by random angles, and the true frame of each."""
    playback = prepare_playback("builtin_boxing")
    qpos = playback.simulation.truth_qpos[:200].copy()
    qpos[:, 7:] += 0.05 * generator(1, "answers").normal(size=qpos[:, 7:].shape)
    ones, zeros = np.ones(200), np.zeros(200, dtype=np.int64)
    return MethodAnswers(qpos, zeros, zeros, ones, ones, ones, zeros), np.arange(200)


def test_loops_count_together_and_only_the_first_warms_up(made: tuple[MethodAnswers, Ints]) -> None:
    answers, index = made
    playback = prepare_playback("builtin_boxing")
    truth_qpos, skeleton = playback.simulation.truth_qpos, playback.body.skeleton
    truth = compute_poses(skeleton, truth_qpos)
    loops = [LoopFrames(index[20:120], index[20:120]), LoopFrames(index[120:], index[120:])]
    found = score_loops(["joint_angle_mean_deg"], answers, loops, truth, 40.0)
    frames = score_estimate(
        skeleton, 40.0, truth_qpos, answers.qpos, index, answers.status, answers.step_ms, warm_up_s=0.0
    ).per_frame["joint_angle_mean_deg"]
    assert found["joint_angle_mean_deg"] == pytest.approx(np.mean(frames[60:]), rel=1e-12)


def test_half_of_the_frames_are_needed(made: tuple[MethodAnswers, Ints]) -> None:
    answers, index = made
    playback = prepare_playback("builtin_boxing")
    truth = compute_poses(playback.body.skeleton, playback.simulation.truth_qpos)
    lost = answers.qpos.copy()
    lost[40:121] = np.nan  # 81 of the 160 frames after the warm-up
    loop = [LoopFrames(index, index)]
    assert score_loops(["mpjpe_mm"], replace_qpos(answers, lost), loop, truth, 40.0) == {"mpjpe_mm": None}
    lost[120] = answers.qpos[120]
    assert score_loops(["mpjpe_mm"], replace_qpos(answers, lost), loop, truth, 40.0)["mpjpe_mm"] is not None
    nothing = replace_qpos(answers, np.full_like(lost, np.nan))
    assert score_loops(["mpjpe_mm"], nothing, loop, truth, 40.0) == {"mpjpe_mm": None}


def replace_qpos(answers: MethodAnswers, qpos: np.ndarray) -> MethodAnswers:
    return answers._replace(qpos=qpos)


def test_a_lag_leaves_the_last_frames_without_an_answer(made: tuple[MethodAnswers, Ints]) -> None:
    answers, index = made
    playback = prepare_playback("builtin_boxing")
    truth = compute_poses(playback.body.skeleton, playback.simulation.truth_qpos)
    lag = np.minimum(np.arange(200), 5)
    late = answers._replace(lag=lag, qpos=np.concatenate([answers.qpos[:1].repeat(5, axis=0), answers.qpos[:-5]]))
    found = score_loops(["mpjpe_mm"], late, [LoopFrames(index, index)], truth, 40.0)
    kept = score_loops(["mpjpe_mm"], answers, [LoopFrames(index[:195], index[:195])], truth, 40.0)
    assert found == pytest.approx(kept)
