"""What an estimate states of its uncertainty and of the frame that it answers."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from harness.core.estimate import Estimate, Status, name_with_lag, session_lag
from harness.errors import ShapeError

POSE = np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0], np.zeros(48)])


def test_an_estimate_states_nothing_by_default() -> None:
    estimate = Estimate(POSE, Status.SOLVED)
    assert (estimate.angle_sigma_rad, estimate.lag) == (None, 0)


def test_an_estimate_keeps_copies_that_nobody_can_change() -> None:
    sigma_rad = np.full(48, 0.1)
    estimate = Estimate(POSE, Status.SOLVED, angle_sigma_rad=sigma_rad, lag=np.int64(2))  # type: ignore[arg-type]
    sigma_rad[:] = 7.0
    assert estimate.angle_sigma_rad is not None
    np.testing.assert_array_equal(estimate.angle_sigma_rad, 0.1)
    assert not estimate.angle_sigma_rad.flags.writeable
    assert type(estimate.lag) is int


@pytest.mark.parametrize(
    ("fields", "error", "text"),
    [
        ({"angle_sigma_rad": np.ones(47)}, ShapeError, "angle_sigma_rad"),
        ({"angle_sigma_rad": np.ones((1, 48))}, ShapeError, "angle_sigma_rad"),
        ({"angle_sigma_rad": np.r_[np.ones(5), 0.0, np.ones(42)]}, ValueError, "hinge 5 is 0 rad"),
        ({"angle_sigma_rad": np.r_[np.ones(5), -1.0, np.ones(42)]}, ValueError, "hinge 5 is -1 rad"),
        ({"angle_sigma_rad": np.r_[np.ones(47), np.nan]}, ValueError, "hinge 47 is nan rad"),
        ({"angle_sigma_rad": np.r_[np.inf, np.ones(47)]}, ValueError, "hinge 0 is inf rad"),
        ({"lag": -1}, ValueError, "a lag of -1 frames"),
        ({"lag": 1.5}, TypeError, "integer"),
    ],
)
def test_impossible_statements_are_refused(fields: dict[str, Any], error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        Estimate(POSE, Status.SOLVED, **fields)


@pytest.mark.parametrize(
    ("lags", "lag"), [([], 0), ([0, 0, 0], 0), ([0, 1, 1, 1], 1), ([0, 1, 2, 3, 3], 3), ([0, 1], 1)]
)
def test_the_lag_grows_to_that_of_the_session(lags: Sequence[int], lag: int) -> None:
    assert session_lag(lags) == lag


@pytest.mark.parametrize("lags", [[1], [2, 2, 2], [0, 2, 2], [0, 1, 2, 1], [0, 0, 1], [0, 1, 0, 1]])
def test_any_other_lag_is_refused(lags: Sequence[int]) -> None:
    with pytest.raises(ValueError, match="lag"):
        session_lag(lags)


@pytest.mark.parametrize(
    ("name", "lag", "title"),
    [
        ("ik", 0, "ik"),
        ("mine:Late", 2, "mine:Late (lag 2)"),
        ("experts[lag=2]", 2, "experts[lag=2]"),
        ("experts[a=1,lag=2]+ik", 2, "experts[a=1,lag=2]+ik"),
        ("experts[lag=1]", 2, "experts[lag=1] (lag 2)"),
        ("experts[flag=2]", 2, "experts[flag=2] (lag 2)"),
        ("experts[lag=20]", 2, "experts[lag=20] (lag 2)"),
    ],
)
def test_a_name_states_the_lag_once(name: str, lag: int, title: str) -> None:
    assert name_with_lag(name, lag) == title
