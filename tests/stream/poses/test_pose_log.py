"""The record of poses refuses what is none, and the statistics of its bodies."""

import numpy as np
import pytest

from harness.errors import BadInput, ShapeError, UnknownName
from harness.stream.poses.pose_log import BodyPoses, FileFinding, PoseLog
from harness.stream.poses.pose_statistics import measure_sampling
from tests.stream.poses.pose_files import POSITIONS_M, QUATERNIONS, TIMES_S

TURN = np.array([[1.0, 0.0, 0.0, 0.0]])


def body(name: str = "a", begin_s: float = 0.0) -> BodyPoses:
    return BodyPoses(name, begin_s + TIMES_S, POSITIONS_M, QUATERNIONS)


@pytest.mark.parametrize(
    ("times_s", "positions_m", "quaternions", "message"),
    [
        ([], np.empty((0, 3)), np.empty((0, 4)), "no poses"),
        ([0.0], [[0.0, np.nan, 0.0]], TURN, "not finite"),
        ([0.0, 0.0], np.zeros((2, 3)), np.tile(TURN, (2, 1)), "do not increase"),
        ([0.0], np.zeros((1, 3)), 1.1 * TURN, "another norm"),
    ],
)
def test_what_are_no_poses_is_refused(times_s: object, positions_m: object, quaternions: object, message: str) -> None:
    with pytest.raises(BadInput, match=message):
        BodyPoses("a", times_s, positions_m, quaternions)  # type: ignore[arg-type]


def test_arrays_agree_about_the_number_of_poses() -> None:
    with pytest.raises(ShapeError):
        BodyPoses("a", TIMES_S, POSITIONS_M[1:], QUATERNIONS)


def test_a_log_begins_at_zero_and_has_bodies_of_different_names() -> None:
    for bodies in ((), (body(), body()), (body(begin_s=1.0),)):
        with pytest.raises(BadInput):
            PoseLog(bodies, "a.csv")
    log = PoseLog((body(), body("b", 2.0)), "a.csv")
    assert log.names == ("a", "b")
    assert log.duration_s == 2.0 + TIMES_S[-1]
    with pytest.raises(UnknownName):
        log.body("c")


def test_some_bodies_begin_at_zero_again() -> None:
    log = PoseLog((body(), body("b", 2.0)), "a.csv", start_unix_s=100.0).select(["b"])
    assert (log.names, log.start_unix_s) == (("b",), 102.0)
    np.testing.assert_allclose(log.bodies[0].times_s, TIMES_S)


def test_an_assumption_is_called_one() -> None:
    assert str(FileFinding("up", "z", "poses do not show it", assumed=True)) == "up: z (assumed: poses do not show it)"
    assert str(FileFinding("up", "z", "given")) == "up: z (given)"


def test_rates_gaps_and_repeats_are_measured() -> None:
    kept = np.delete(np.arange(len(TIMES_S)), slice(100, 150))  # a pause of 51 steps
    rows = kept.copy()
    rows[200:220] = rows[199]  # a source that repeats a sample twenty times
    found = measure_sampling(BodyPoses("a", TIMES_S[kept], POSITIONS_M[rows], QUATERNIONS[rows]))
    assert found.rate_hz == pytest.approx(50.0)
    assert found.step_ms == pytest.approx((20.0, 20.0))
    assert found.gaps == 1
    assert found.longest_gap_s == pytest.approx(1.02)
    assert found.repeated_share == pytest.approx(20 / len(kept))
    assert found.extent_m == pytest.approx(np.ptp(POSITIONS_M[rows], axis=0))


def test_the_rate_is_that_of_times_that_are_printed_coarsely() -> None:
    times_s = np.delete(np.round(np.arange(600) / 60.0, 3), slice(100, 200))  # steps of 16 and 17 ms, and a pause
    found = measure_sampling(BodyPoses("a", times_s, np.zeros((500, 3)), np.tile(TURN, (500, 1))))
    assert found.rate_hz == pytest.approx(60.0, abs=0.01)
    assert found.gaps == 1


def test_one_pose_has_no_rate() -> None:
    found = measure_sampling(BodyPoses("a", [0.0], np.zeros((1, 3)), TURN))  # type: ignore[arg-type]
    assert (found.poses, found.rate_hz, found.step_ms, found.gaps) == (1, None, None, 0)
