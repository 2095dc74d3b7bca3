"""What speed is measured against is the same work every time, and is timed."""

import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.errors import ShapeError
from harness.experiment.methods.method_run import FRAMES_PER_TIMING, ReferenceWorkload, run_method


def test_the_work_is_the_same_every_time_and_solves_what_it_says() -> None:
    one, again = ReferenceWorkload().work(), ReferenceWorkload().work()
    np.testing.assert_array_equal(one, again)
    assert one.shape == (54,)
    assert np.abs(one).max() > 1e-3


def test_its_cpu_time_is_told_in_milliseconds(monkeypatch: pytest.MonkeyPatch) -> None:
    work = ReferenceWorkload()
    ticks = iter([7.0, 7.002])
    monkeypatch.setattr(time, "process_time", lambda: next(ticks))
    assert work.cpu_ms() == pytest.approx(2.0)
    assert next(ticks, None) is None


def test_the_work_of_today_is_that_of_yesterday() -> None:
    """Units of another reference are not comparable: whoever changes it raises the version of `step_relative`."""
    step = ReferenceWorkload().work()
    np.testing.assert_allclose(
        [np.linalg.norm(step), step[0], step[-1]], [1.742647543, -0.355808417, 0.230158596], rtol=1e-6
    )


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
