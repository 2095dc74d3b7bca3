"""Commands to a running session: heading, calibration and recordings, while frames go on."""

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.body import build_body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.errors import BadInput
from harness.live.heading import UNTURNED
from harness.live.pose import LivePose
from harness.live.session import LiveOptions, run_session
from harness.live.session_control import SessionControl, new_path
from harness.stream import TrackerFrame
from harness.stream.polhemus.codec import WireFormat
from tests.live.posing import configuration, frame
from tests.live.streams import Paced

BODY = build_body()
WORN = Calibration(
    "exact", ("a", "b"), ("head", "lhand"), np.zeros((2, 3)), np.tile([1.0, 0, 0, 0], (2, 1)),
    np.array([1.0, 0, 0, 0]), np.array([0.5, 0.0, 2.5]),
)  # fmt: skip


class Turned:
    """A method of a body at (1, 2) that faces 40 deg to the left, a millimetre higher in each frame."""

    def __init__(self, status: Status = Status.SOLVED, lag: int = 0) -> None:
        self.status, self.lag, self.steps = status, lag, 0
        self.calibrations: list[Calibration] = []

    def begin(self, calibration: Calibration) -> "Turned":
        self.calibrations.append(calibration)
        self.steps = 0
        return self

    def step(self, frame: TrackerFrame) -> Estimate:
        lag, qpos = min(self.steps, self.lag), np.array(tpose(BODY.skeleton))
        self.steps += 1
        qpos[:3] += [1.0, 2.0, 0.0]
        qpos[3:7] = rotations.about_z(np.deg2rad(40.0))
        return Estimate(qpos, self.status, lag=lag)


class Kept:
    name = description = "kept"

    def __init__(self) -> None:
        self.poses: list[LivePose] = []

    def send(self, pose: LivePose) -> None:
        self.poses.append(pose)

    def close(self) -> None: ...


class Running:
    """A session in a thread, of frames that come until it is closed."""

    def __init__(self, method: Turned) -> None:
        self.control, self.kept, self.sending = SessionControl(), Kept(), True
        self.stream = Paced(self._frames(), 0.004)
        options = LiveOptions(100.0, queue_frames=99)
        arguments = (self.stream, BODY, method, WORN, [self.kept], options)
        self._thread = threading.Thread(target=run_session, args=arguments, kwargs={"control": self.control})
        self._thread.start()

    def _frames(self) -> Iterator[TrackerFrame]:
        for n in range(100_000):
            while not self.sending and not self.stream.closed.is_set():
                time.sleep(0.001)
            yield frame(n / 100.0)

    def more(self, count: int = 10) -> LivePose:
        """The newest pose when this many more have come."""
        wanted, until_s = len(self.kept.poses) + count, time.monotonic() + 20.0
        while len(self.kept.poses) < wanted:
            assert time.monotonic() < until_s
            time.sleep(0.002)
        return self.kept.poses[-1]

    def pause(self) -> None:
        """Send no more frames, and wait until all that were sent are solved."""
        self.sending, solved = False, -1
        while solved != len(self.kept.poses):
            solved = len(self.kept.poses)
            time.sleep(0.5)

    def close(self) -> None:
        self.stream.close()
        self._thread.join()


@pytest.fixture
def start() -> Iterator[Callable[[Turned], Running]]:
    sessions: list[Running] = []

    def begin(method: Turned) -> Running:
        sessions.append(Running(method))
        return sessions[-1]

    yield begin
    for session in sessions:
        session.close()


def test_the_performer_faces_forward_where_they_stand(start: Callable[[Turned], Running]) -> None:
    session = start(Turned())
    before = session.more()
    turn_rad = session.control.reset_heading()
    after = session.more()
    np.testing.assert_allclose(np.rad2deg(turn_rad), -40.0, atol=1e-9)
    np.testing.assert_allclose(rotations.yaw_rad(after.world_from_root), 0.0, atol=1e-12)
    np.testing.assert_allclose(after.root_m, before.root_m, atol=1e-12)
    np.testing.assert_array_equal(after.estimate.qpos[7:], before.estimate.qpos[7:])
    assert before.room is not None
    assert after.room is not None
    np.testing.assert_allclose(from_root(after, after.room[0]), from_root(before, before.room[0]), atol=1e-12)
    assert session.control.reset_heading() == pytest.approx(0.0, abs=1e-12)
    assert [pose.number for pose in session.kept.poses] == list(range(len(session.kept.poses)))


def from_root(pose: LivePose, point_m: Floats) -> Floats:
    """A point as the performer sees it: it must stay where it is when the world is turned."""
    return rotations.rotate(rotations.inverse(pose.world_from_root), point_m - pose.root_m)


def test_turns_add_up(rng: np.random.Generator) -> None:
    qpos = configuration(rng)
    qpos[3:7] = rotations.multiply(rotations.about_z(2.5), rotations.exp(np.array([0.0, 0.3, 0.2])))
    turned = UNTURNED.forward(qpos)
    assert turned is not None
    later = np.array(qpos)
    later[:2] += [0.3, -0.2]
    later[3:7] = rotations.multiply(rotations.about_z(0.7), later[3:7])
    again = turned.forward(turned.qpos(later))
    assert again is not None
    facing = rotations.rotate(again.qpos(later)[3:7], np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(facing[1], 0.0, atol=1e-12)
    assert facing[0] > 0.5
    np.testing.assert_allclose(again.qpos(later)[:3], turned.qpos(later)[:3], atol=1e-12)


def test_nobody_knows_where_a_lost_or_lying_performer_faces(start: Callable[[Turned], Running]) -> None:
    session = start(Turned(Status.LOST))
    session.more()
    with pytest.raises(BadInput, match="no heading is known"):
        session.control.reset_heading()
    lying = np.array(tpose(BODY.skeleton))
    lying[3:7] = rotations.exp(np.array([0.0, 1.5, 0.0]))
    assert UNTURNED.forward(lying) is None
    assert UNTURNED.forward(np.full(55, np.nan)) is None


def test_another_calibration_is_used_from_the_next_frame_on(start: Callable[[Turned], Running]) -> None:
    method = Turned(lag=2)
    session = start(method)
    session.more()
    session.control.reset_heading()
    session.control.use_calibration(replace(WORN, tracker_origin_m=np.array([9.0, 0.0, 2.0])))
    pose = session.more()
    assert len(method.calibrations) == 2
    assert pose.room is not None
    np.testing.assert_array_equal(pose.room[0], [9.0, 0.0, 2.0])
    np.testing.assert_allclose(rotations.yaw_rad(pose.world_from_root), np.deg2rad(40.0))  # it has its own forward
    measured_s = [float(pose.frame.measured_s[0]) for pose in session.kept.poses]
    assert np.all(np.diff(measured_s) > 0.0), "no frame is answered twice"


def test_nothing_happens_without_frames_and_nothing_later(
    start: Callable[[Turned], Running], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("harness.live.session_control._ANSWER_TIMEOUT_S", 0.5)
    session = start(Turned())
    session.more()
    session.pause()
    with ThreadPoolExecutor(8) as threads:
        asked = [threads.submit(session.control.reset_heading) for _ in range(8)]
        errors = [str(one.exception()) for one in asked]
    heads = sorted(text.partition(",")[0].partition(".")[0] for text in errors)
    assert heads == 4 * ["4 commands wait already"] + 4 * ["No frame arrives"]
    session.sending = True
    np.testing.assert_allclose(rotations.yaw_rad(session.more().world_from_root), np.deg2rad(40.0))
    session.control.reset_heading()


def test_a_session_that_has_not_begun_takes_no_calibration() -> None:
    with pytest.raises(BadInput, match="has not begun"):
        SessionControl().use_calibration(WORN)


def test_recordings_of_one_second_have_files_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("time.strftime", lambda text: text.replace("%Y%m%d_%H%M%S", "now"))
    control = SessionControl()
    control.recorder.on_configured(WireFormat(("a", "b"), 40.0))
    for name in ("live_now.rec", "live_now_2.rec", "live_now_3.rec"):
        assert control.start_recording(tmp_path) == tmp_path / name
        control.recorder.stop()
    (tmp_path / "calibration_now.toml").write_text("mine")
    assert new_path(tmp_path, "calibration", ".toml").name == "calibration_now_2.toml"
