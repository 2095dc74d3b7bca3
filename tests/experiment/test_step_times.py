"""The wall times of a cell: of steps that follow a step, with reference work between them."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.errors import ShapeError
from harness.experiment.method_run import run_method
from harness.experiment.reference_workload import FRAMES_PER_TIMING


class Diary:
    """A method and its session, who write down what is asked of them."""

    def __init__(self) -> None:
        self.seen: list[int] = []

    def begin(self, calibration: Any) -> "Diary":
        return self

    def step(self, frame: int) -> SimpleNamespace:
        self.seen.append(frame)
        return SimpleNamespace(qpos=np.full(55, float(frame)), status=0, origin=0)


def test_reference_work_lies_between_steps_and_the_step_after_it_is_not_timed() -> None:
    frames = 3 * FRAMES_PER_TIMING + 2
    diary: Any = Diary()
    shown: Any = range(frames)
    qpos, status, _, step_ms, cpu_ms, reference_ms, *_ = run_method(diary, diary, shown)
    assert diary.seen == list(range(frames))
    np.testing.assert_array_equal(qpos[:, 0], np.arange(frames))
    assert len(status) == len(step_ms) == len(cpu_ms) == len(reference_ms) == frames
    np.testing.assert_array_equal(
        np.flatnonzero(np.isfinite(reference_ms)),
        [FRAMES_PER_TIMING - 1, 2 * FRAMES_PER_TIMING - 1, 3 * FRAMES_PER_TIMING - 1],
    )
    for times_ms in (step_ms, cpu_ms):
        np.testing.assert_array_equal(
            np.flatnonzero(np.isnan(times_ms)), [FRAMES_PER_TIMING, 2 * FRAMES_PER_TIMING, 3 * FRAMES_PER_TIMING]
        )
    assert (step_ms[np.isfinite(step_ms)] > 0.0).all()
    assert (reference_ms[np.isfinite(reference_ms)] > 0.0).all()


class Rewriter:
    """A session whose answers are one array, which it writes anew at every step."""

    def __init__(self) -> None:
        self.qpos = np.zeros(55)

    def begin(self, calibration: Any) -> "Rewriter":
        return self

    def step(self, frame: int) -> SimpleNamespace:
        self.qpos[:] = frame
        return SimpleNamespace(qpos=self.qpos, status=0, origin=0)


def test_an_answer_is_copied_at_its_step() -> None:
    method: Any = Rewriter()
    shown: Any = range(5)
    answers = run_method(method, method, shown)
    np.testing.assert_array_equal(answers.qpos[:, 0], np.arange(5.0))


def test_a_pose_of_another_size_is_an_error() -> None:
    method: Any = Rewriter()
    method.qpos = np.zeros(54)
    shown: Any = range(5)
    with pytest.raises(ShapeError, match=r"shape \(54,\), expected \(55\)"):
        run_method(method, method, shown)
