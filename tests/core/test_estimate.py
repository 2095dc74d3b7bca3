"""What an estimate states of its uncertainty and of the frame that it answers."""

from collections.abc import Sequence
from enum import IntEnum
from typing import Any

import numpy as np
import pytest

from harness.core.estimate import (
    Estimate,
    Origin,
    Status,
    as_estimate,
    find_impossible_pose,
    has_pose,
    name_with_lag,
    session_lag,
)
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
        ({"angle_sigma_rad": np.r_[np.ones(47), 1e6]}, ValueError, "hinge 47 is 1e\\+06 rad"),
        ({"angle_sigma_rad": np.r_[1e-50, np.ones(47)]}, ValueError, "hinge 0 is 1e-50 rad"),
        ({"angle_sigma_rad": np.ones(48, complex)}, TypeError, "complex128"),
        ({"angle_sigma_rad": np.ones(48, bool)}, TypeError, "bool"),
        ({"origin": Status.HELD}, ValueError, "no Origin"),
        ({"lag": -1}, ValueError, "a lag of -1 frames"),
        ({"lag": 1.5}, TypeError, "integer"),
    ],
)
def test_impossible_statements_are_refused(fields: dict[str, Any], error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        Estimate(POSE, Status.SOLVED, **fields)


class Answer:
    """An answer of a method's own type, which has only what a pose needs."""

    def __init__(self, qpos: Any, **others: Any) -> None:
        self.__dict__.update(qpos=qpos, status=Status.HELD, **others)


def changed(place: int | slice, value: float) -> Any:
    pose = POSE.copy()
    pose[place] = value
    return pose


@pytest.mark.parametrize(
    ("qpos", "error", "text"),
    [
        (changed(10, 1e17), ValueError, r"1e\+17 at place 10 of a pose"),
        (changed(54, -1e6), ValueError, r"-1e\+06 at place 54"),
        (changed(0, 1e308), ValueError, r"1e\+308 at place 0"),
        (changed(3, 1e-160), ValueError, "a root quaternion of"),
        (changed(3, 1e-6), ValueError, "a root quaternion of"),
        (changed(4, 1e6), ValueError, "place 4"),
        (POSE[:54], ShapeError, r"\(54,\)"),
        (POSE[None], ShapeError, r"\(1, 55\)"),
        (1.0, ShapeError, r"\(\)"),
        (POSE + 0j, TypeError, "complex128"),
        (POSE.astype(object), TypeError, "object"),
        (POSE.astype(str), TypeError, "<U"),
        (POSE.astype(bool), TypeError, "bool"),
        (np.zeros(55, "datetime64[s]"), TypeError, "datetime64"),
        ([None] * 55, TypeError, "object"),
        ([10**30] * 55, TypeError, "object"),
        (np.ma.array(POSE, mask=POSE > 0.5), TypeError, "masked"),
        (np.full(55, np.longdouble("1e4000")), ValueError, "too large for float64"),
    ],
)
def test_an_answer_that_is_no_pose_is_refused(qpos: Any, error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        as_estimate(Answer(qpos))


@pytest.mark.parametrize(
    "qpos",
    [
        POSE.tolist(),
        POSE.astype(np.float32),
        POSE.astype(np.longdouble),
        POSE.astype(np.int8),
        np.repeat(POSE, 2)[::2],
        np.ma.array(POSE),
        POSE.astype(">f8"),
    ],
)
def test_real_numbers_of_any_type_are_a_pose(qpos: Any) -> None:
    estimate = as_estimate(Answer(qpos))
    np.testing.assert_array_equal(estimate.qpos, POSE)
    assert estimate.qpos.dtype == np.dtype("=f8")
    assert (estimate.status, estimate.origin, estimate.lag, estimate.angle_sigma_rad) == (
        *(Status.HELD, Origin.MODEL, 0, None),
    )


@pytest.mark.parametrize("qpos", [changed(7, np.nan), changed(0, -np.inf), changed(slice(3, 7), 0.0), np.zeros(55)])
def test_a_frame_may_have_no_pose(qpos: Any) -> None:
    """Such a frame is not scored, whatever else it holds."""
    assert not has_pose(as_estimate(Answer(qpos)).qpos[None]).any()
    qpos[20] = 1e300
    assert find_impossible_pose(np.array([POSE, qpos])) == ""


class Level(IntEnum):
    """An enumeration of somebody else's, with values of `Status`."""

    LOW = 0


@pytest.mark.parametrize("status", [3, -1, "SOLVED", None, True, Level.LOW, Origin.FALLBACK, 0.5])
def test_another_status_is_refused(status: Any) -> None:
    with pytest.raises(ValueError, match="Status"):
        Estimate(POSE, status)


@pytest.mark.parametrize("value", [1, 1.0, np.int8(1), Status.HELD])
def test_the_value_of_a_status_stands_for_it(value: Any) -> None:
    assert Estimate(POSE, value).status is Status.HELD


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
