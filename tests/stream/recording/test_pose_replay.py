"""A pose log as a stream: it keeps the contract, and each pose comes once, at its time."""

import io
import time

import numpy as np
import pytest

from harness.core import rotations
from harness.stream.poses.pose_log import BodyPoses, PoseLog
from harness.stream.recording.pose_replay import PoseLogStream
from harness.testing.stream_checks import check_stream
from tests.stream.poses.pose_files import POSITIONS_M, QUATERNIONS, TIMES_S

LATE_S = TIMES_S[::3] + 0.005


def log() -> PoseLog:
    """One body at 50 Hz, one at the same times in part, and one at times of its own."""
    return PoseLog(
        (
            BodyPoses("head", TIMES_S, POSITIONS_M, QUATERNIONS),
            BodyPoses("hand", TIMES_S[10:40], POSITIONS_M[10:40], QUATERNIONS[10:40]),
            BodyPoses("foot", LATE_S, POSITIONS_M[::3], QUATERNIONS[::3]),
        ),
        "a.csv",
        start_unix_s=1.5e9,
    )


def test_it_keeps_the_contract_of_streams() -> None:
    check_stream(lambda: PoseLogStream(log()), rate_hz=50.0)


@pytest.mark.parametrize("repeats", [1, 9])
def test_each_pose_comes_once_at_its_time(repeats: int) -> None:
    bodies = [
        BodyPoses(
            body.name,
            np.concatenate([body.times_s + 7.0 * n for n in range(repeats)]),
            np.tile(body.positions_m, (repeats, 1)),
            np.tile(body.quaternions, (repeats, 1)),
        )
        for body in log().bodies
    ]
    frames = list(PoseLogStream(PoseLog(tuple(bodies), "a.csv")))
    received_s = np.array([frame.received_s for frame in frames])
    np.testing.assert_array_equal(received_s, np.unique(np.concatenate([body.times_s for body in bodies])))
    for n, body in enumerate(bodies):
        rows = [frame for frame in frames if frame.position_valid[n]]
        np.testing.assert_array_equal([frame.measured_s[n] for frame in rows], body.times_s)
        np.testing.assert_array_equal([frame.position_m[n] for frame in rows], body.positions_m)
        turned = np.array([frame.tracker_from_station[n] for frame in rows])
        assert rotations.angle_between_rad(turned, body.quaternions).max() < 1e-9
        assert all(frame.quality[n] == 1.0 and not frame.suspect[n] for frame in rows)


def test_the_wall_clock_is_that_of_the_source() -> None:
    assert PoseLogStream(log()).wall_s(2.0) == 1.5e9 + 2.0
    unknown = PoseLog(log().bodies, "a.csv")
    assert PoseLogStream(unknown).wall_s(2.0) == 2.0


def test_it_waits_for_the_clock_or_for_a_person(monkeypatch: pytest.MonkeyPatch) -> None:
    begin_s = time.monotonic()
    short = PoseLog((BodyPoses("a", TIMES_S[:11], POSITIONS_M[:11], QUATERNIONS[:11]),), "a.csv")
    assert len(list(PoseLogStream(short, 2.0))) == 11
    assert time.monotonic() - begin_s >= 0.1
    monkeypatch.setattr("sys.stdin", io.StringIO("\n\n"))
    assert len(list(PoseLogStream(short, "step"))) == 2


def test_poses_of_one_period_are_one_frame_with_the_latest_of_each_body() -> None:
    """Body a has two poses in the second period of 0.1 s, and body b none in the third."""
    times_s = {"a": [0.0, 0.08, 0.12, 0.2], "b": [0.01, 0.09, 0.31]}
    bodies = [
        BodyPoses(name, np.array(at), np.array(at)[:, None] * np.ones(3), np.tile([1.0, 0.0, 0.0, 0.0], (len(at), 1)))
        for name, at in times_s.items()
    ]
    frames = list(PoseLogStream(PoseLog(tuple(bodies), "a.csv"), period_s=0.1))
    assert [frame.received_s for frame in frames] == [0.01, 0.12, 0.2, 0.31]
    assert [frame.position_valid.tolist() for frame in frames] == [[True] * 2, [True] * 2, [True, False], [False, True]]
    np.testing.assert_array_equal(frames[1].measured_s, [0.12, 0.09])
    np.testing.assert_array_equal(frames[1].position_m[:, 0], [0.12, 0.09])
