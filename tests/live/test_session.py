"""A live session over streams that the test controls."""

import gc
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from harness.body import build_body, tpose
from harness.commands import live_summary
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.experiment import Playback, prepare_playback
from harness.live.pose import LivePose
from harness.live.scheduling_jitter import JitterProbe
from harness.live.session import LiveOptions, LiveResult, run_session, warm_up
from harness.stream import TrackerFrame, TrackerStream
from tests.live.posing import frame
from tests.live.streams import Broken, Paced
from tests.long_demo import write_long_demo

BODY = build_body()
WORN = Calibration(
    "exact", ("a", "b"), ("head", "lhand"), np.zeros((2, 3)), np.tile([1.0, 0, 0, 0], (2, 1)),
    np.array([1.0, 0, 0, 0]), np.zeros(3),
)  # fmt: skip
PLAN = LiveOptions(rate_hz=100.0)


class Counting:
    """A reconstructor and its session: returns the T-pose after a given time and stores the frames."""

    def __init__(self, takes_s: float = 0.0, fails_at: int | None = None) -> None:
        self.takes_s, self.fails_at = takes_s, fails_at
        self.seen: list[TrackerFrame] = []
        self.worn: Calibration | None = None

    def begin(self, calibration: Calibration) -> "Counting":
        self.worn = calibration
        return self

    def step(self, frame: TrackerFrame) -> Estimate:
        time.sleep(self.takes_s)
        self.seen.append(frame)
        if len(self.seen) == self.fails_at:
            raise ZeroDivisionError("the method failed")
        return Estimate(tpose(BODY.skeleton), Status.SOLVED)


class Kept:
    """An output that stores poses, and fails at a given one."""

    name = description = "kept"

    def __init__(self, fails_at: int | None = None, error: BaseException | None = None) -> None:
        self.fails_at, self.error = fails_at, error or OSError("no room")
        self.poses: list[LivePose] = []
        self.closed = 0

    def send(self, pose: LivePose) -> None:
        if len(self.poses) == self.fails_at:
            raise self.error
        self.poses.append(pose)

    def close(self) -> None:
        self.closed += 1


@pytest.fixture(autouse=True)
def _nothing_is_left() -> Iterator[None]:
    threads, interval, enabled = set(threading.enumerate()), sys.getswitchinterval(), gc.isenabled()
    yield
    assert set(threading.enumerate()) == threads
    assert (sys.getswitchinterval(), gc.isenabled(), gc.get_freeze_count()) == (interval, enabled, 0)


def performed(stream: TrackerStream, method: Counting, *outputs: Kept, plan: LiveOptions = PLAN) -> LiveResult:
    return run_session(stream, BODY, method, WORN, outputs, plan)


def frames(count: int) -> list[TrackerFrame]:
    return [frame(n / 100.0) for n in range(count)]


def test_every_frame_becomes_a_pose_when_there_is_time() -> None:
    stream, method, output = Paced(frames(20), 0.005), Counting(), Kept()
    done = performed(stream, method, output, plan=LiveOptions(100.0, queue_frames=100))
    assert (done.captured, done.poses, done.dropped) == (20, 20, 0)
    assert [float(f.measured_s[0]) for f in method.seen] == [n / 100.0 for n in range(20)]
    assert [pose.number for pose in output.poses] == list(range(20))
    assert all(p.frame.received_s <= p.taken_s <= p.ready_s for p in output.poses)
    assert output.closed == 1
    assert stream.closed.is_set()
    assert done.stages.to_pose.count == 20


def test_a_slow_method_gets_the_newest_and_capture_never_waits() -> None:
    method = Counting(takes_s=0.05)
    began_s = time.monotonic()
    done = performed(Paced(frames(200), 0.001), method, plan=LiveOptions(1000.0, queue_frames=2))
    assert done.captured == 200
    assert done.poses + done.dropped == 200
    assert done.dropped > 50
    assert float(method.seen[-1].measured_s[0]) == 1.99
    assert done.stages.missed == done.poses
    assert time.monotonic() - began_s < 30.0


def test_it_ends_after_its_time() -> None:
    stream = Paced(frames(3), ends=False)
    done = performed(stream, Counting(), plan=LiveOptions(100.0, seconds=0.3))
    assert (done.captured, done.stopped) == (3, False)
    assert stream.closed.is_set()


def test_ctrl_c_is_a_normal_end() -> None:
    """Ctrl-C interrupts the waiting thread, which reads the clock; tests of the command send real signals."""
    method, output, stream = Counting(), Kept(), Paced(frames(3), ends=False)
    waiting = threading.current_thread()

    def clock() -> float:
        if threading.current_thread() is waiting and len(output.poses) == 3:
            raise KeyboardInterrupt
        return time.monotonic()

    done = run_session(stream, BODY, method, WORN, [output], LiveOptions(100.0, seconds=60.0), clock=clock)
    assert done.captured == 3
    assert done.stopped
    assert output.closed == 1
    assert stream.closed.is_set()


def test_what_breaks_is_raised_after_all_is_closed() -> None:
    output = Kept()
    with pytest.raises(ArithmeticError, match="the stream broke"):
        performed(Broken(frames(2)), Counting(), output)
    with pytest.raises(ZeroDivisionError, match="the method failed"):
        performed(Paced(frames(5), ends=False), Counting(fails_at=2), output)
    assert output.closed == 2


def test_any_error_of_an_output_leaves_it_out() -> None:
    class Unclosable(Kept):
        name = told = "unclosable"

        def close(self) -> None:
            super().close()
            raise RuntimeError("stuck")

    good, bad, stuck, said = Kept(), Kept(2, ValueError("the library failed")), Unclosable(), list[str]()
    outputs = [good, bad, stuck]
    done = run_session(
        Paced(frames(5), 0.005), BODY, Counting(), WORN, outputs, LiveOptions(100.0, queue_frames=9), say=said.append
    )
    assert (len(good.poses), len(bad.poses), len(stuck.poses)) == (5, 2, 5)
    assert (good.closed, bad.closed, stuck.closed) == (1, 1, 1)
    assert done.failed == {"kept": "ValueError: the library failed", "unclosable": "RuntimeError: stuck"}
    assert said == ["kept: ValueError: the library failed; the session goes on without it"]


@pytest.fixture(scope="module")
def worn(tmp_path_factory: pytest.TempPathFactory) -> Playback:
    scenario = write_long_demo(tmp_path_factory.mktemp("scenario"))
    return prepare_playback(scenario, clip="boxing_p1_01", noise="clean")


def test_live_estimates_are_those_of_a_run(worn: Playback) -> None:
    from harness.reconstruct import make_method

    boxing = worn.simulation.frames[:60]
    reconstructor = worn.clip_evaluation.fit_method(make_method("ik"), "ik")
    warm_up(reconstructor, worn.calibration, boxing[:3])
    session = reconstructor.begin(worn.calibration)
    offline = [session.step(frame) for frame in boxing]
    output = Kept()
    stream = Paced(boxing, stations=worn.calibration.stations)
    run_session(stream, worn.body, reconstructor, worn.calibration, [output], LiveOptions(40.0, queue_frames=99))
    assert len(output.poses) == 60
    for pose, estimate in zip(output.poses, offline, strict=True):
        np.testing.assert_array_equal(pose.estimate.qpos, estimate.qpos)
        assert (pose.estimate.status, pose.estimate.origin) == (estimate.status, estimate.origin)


class Unsure(Counting):
    """States standard deviations of as many degrees as it has answers."""

    def step(self, frame: TrackerFrame) -> Estimate:
        return replace(super().step(frame), angle_sigma_rad=np.full(48, np.deg2rad(len(self.seen))))


def test_the_summary_has_the_mean_stated_standard_deviation() -> None:
    plan = LiveOptions(100.0, queue_frames=99)
    done = performed(Paced(frames(5), 0.005), Unsure(), plan=plan)
    assert live_summary.as_dict(done, {})["sigma_width_deg"] == pytest.approx(3.0)
    (line,) = [line for line in live_summary.lines(done, {}) if "95 % region" in line]
    assert line.startswith("stated 95 % region of hinge angles: ±8.0° on average")
    done = performed(Paced(frames(5), 0.005), Counting(), plan=plan)
    assert live_summary.as_dict(done, {})["sigma_width_deg"] is None
    assert "the method states no uncertainty" in live_summary.lines(done, {})
    without_poses = live_summary.lines(LiveResult(done.stages), {})
    assert not any("uncertainty" in line for line in without_poses)


class Late(Counting):
    """Answers two frames late, with a pose whose height is the number of the frame."""

    def step(self, frame: TrackerFrame) -> Estimate:
        super().step(frame)
        lag = min(len(self.seen) - 1, 2)
        qpos = tpose(BODY.skeleton).copy()
        qpos[2] = len(self.seen) - 1 - lag
        return Estimate(qpos, Status.SOLVED, lag=lag)


def test_a_late_pose_has_the_frame_that_it_answers() -> None:
    output = Kept()
    done = performed(Paced(frames(12), 0.005), Late(), output, plan=LiveOptions(100.0, queue_frames=99))
    assert [pose.root_m[2] for pose in output.poses] == [
        pytest.approx(100.0 * p.frame.measured_s[0]) for p in output.poses
    ]
    assert [pose.root_m[2] for pose in output.poses] == list(range(10)), "each frame once, the last two never"
    assert [pose.number for pose in output.poses] == list(range(10))
    assert np.all(np.diff([pose.measured_s for pose in output.poses]) > 0.0)
    assert (done.poses, done.lag_frames, done.lag_s) == (10, 2, 0.02)


def test_the_lag_is_added_to_the_latency() -> None:
    done = performed(Paced(frames(12), 0.005), Late(), plan=LiveOptions(100.0, queue_frames=99))
    content = live_summary.as_dict(done, {})
    assert (content["lag_frames"], content["lag_ms"]) == (2, 20.0)
    for name, ms in content["latency"]["last byte to pose"].items():
        assert content["latency_with_lag"][name] == pytest.approx(ms + 20.0)
    (line,) = [line for line in live_summary.lines(done, {}) if line.startswith("with the method's lag of 2 frames")]
    assert float(line.split()[-3]) == pytest.approx(content["latency"]["last byte to pose"]["p50_ms"] + 20.0, abs=0.006)
    causal = performed(Paced(frames(5), 0.005), Counting(), plan=LiveOptions(100.0, queue_frames=99))
    assert live_summary.as_dict(causal, {})["lag_ms"] == 0.0
    assert not any("lag" in line for line in live_summary.lines(causal, {}))


def test_a_summary_says_what_happened() -> None:
    done = performed(Paced(frames(5), 0.01), Counting(), plan=LiveOptions(100.0, queue_frames=9))
    times = {"p50_ms": 0.1, "p99_ms": 0.25, "max_ms": 7.5}
    beside = {"timer": times, "handover": times, "sleeps": 7}
    content = live_summary.as_dict(done, beside)
    assert (content["frames"], content["poses"], content["deadline_ms"]) == (5, 5, 10.0)
    assert content["floor"] == beside
    text = "\n".join(live_summary.lines(done, beside))
    for words in (
        "last byte to pose",
        "5 poses in",
        "5 model, 0 fallback, 0 bridged",
        "0 frames dropped",
        "after their deadline, 10.00 ms",
    ):
        assert words in text
    (late,) = [line for line in text.split("\n") if line.startswith("the computer: a timer is late")]
    assert late.split()[-3:] == ["0.10", "0.25", "7.50"]


def test_the_floor_is_measured_until_asked() -> None:
    with JitterProbe() as floor:
        time.sleep(1.0)
        found = floor.finish()
    assert found["sleeps"] > 0
    assert 0.0 <= found["timer"]["p50_ms"] <= found["timer"]["max_ms"]
    assert found["handover"]["p99_ms"] > 0.0
