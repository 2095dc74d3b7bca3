"""What speed is measured against is the same work every time, and is timed."""

import time

import numpy as np
import pytest

from harness.experiment.reference_workload import ReferenceWorkload


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
