"""A live session: reads frames from a tracker, reconstructs poses and sends them to outputs, in real time.

It has two threads. One reads the tracker and never waits for anything else. The other takes frames from a queue that
drops its oldest frames, solves and sends. Between two frames it carries out commands (`session_control`). The caller's
thread waits, and Ctrl-C ends the session.
"""

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from threading import Event, Thread

import numpy as np

from harness.body import Body, Kinematics
from harness.calibrate import Notifier
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import HINGE_COUNT, Estimate, Origin, Status
from harness.core.number_format import count_noun
from harness.errors import BadInput
from harness.live.capture import CaptureThread, DroppingQueue
from harness.live.heading import UNTURNED, WorldTurn
from harness.live.latency import StageLatencies, collect_garbage, low_latency_mode
from harness.live.live_statistics import LiveStatistics
from harness.live.pose import LivePose, Output
from harness.live.session_control import SessionControl, SessionRequest
from harness.reconstruct import Reconstructor, Session
from harness.stream import HostClockEstimator, TrackerFrame, TrackerStream

QUEUE_FRAMES = 32
"""Length of the queue of frames, a quarter of a second at 120 Hz. Solving is several times faster than the frame rate,
so the queue empties soon after a slow pose, without a gap in the frames [choice]."""
_COLLECT_PERIOD_S = 1.0
_POLL_PERIOD_S = 0.1
_STATUS_PERIOD_S = 1.0


@dataclass(frozen=True)
class LiveOptions:
    """Settings of a live session."""

    rate_hz: float
    """Expected frame rate of the tracker [Hz]."""
    deadline_s: float | None = None
    """Longest allowed time from the last byte to the pose [s]; one frame period by default."""
    seconds: float | None = None
    """Duration after which the session ends [s]; unlimited by default."""
    queue_frames: int = QUEUE_FRAMES
    """Length of the queue between the two threads."""


@dataclass(eq=False)
class LiveResult:
    """Result of a live session."""

    stages: StageLatencies
    captured: int = 0
    """Frames that the stream delivered."""
    dropped: int = 0
    """Frames that the queue dropped."""
    status: dict[str, int] = field(default_factory=lambda: {state.name.lower(): 0 for state in Status})
    """Number of poses by status."""
    origin: dict[str, int] = field(default_factory=lambda: {part.name.lower(): 0 for part in Origin})
    """Number of poses by origin."""
    seconds: float = 0.0
    """Time from the first to the last pose [s]."""
    failed: dict[str, str] = field(default_factory=dict)
    """Error of each output that failed, by its name."""
    lag_frames: int = 0
    """Number of frames by which the method answers later than it could, see `core.estimate.Estimate.lag`."""
    lag_s: float = 0.0
    """The lag times the expected frame period [s]. No stage contains it, but every pose is so much older."""
    sigma_sum_rad: Floats = field(default_factory=lambda: np.zeros(HINGE_COUNT))
    """(48,) sums of the stated standard deviations of all poses, in the order of `qpos` [rad]; 0 if none are stated."""
    stopped: bool = False
    """Whether Ctrl-C or another signal ended the session."""

    @property
    def lag_text(self) -> str:
        """The lag in words, such as "lag of 2 frames"."""
        return f"lag of {count_noun(self.lag_frames, 'frame')}"

    @property
    def poses(self) -> int:
        return sum(self.status.values())

    @property
    def mean_sigma_rad(self) -> Floats | None:
        """(48,) mean stated standard deviation of each hinge angle [rad]; None if none are stated."""
        return self.sigma_sum_rad / self.poses if self.sigma_sum_rad.any() else None


def warm_up(reconstructor: Reconstructor, calibration: Calibration, frames: Sequence[TrackerFrame]) -> None:
    """Solve some frames in a discarded session, so that code is compiled and caches are filled."""
    session = reconstructor.begin(calibration)
    for frame in frames:
        session.step(frame)


def run_session(
    stream: TrackerStream,
    body: Body,
    reconstructor: Reconstructor,
    calibration: Calibration,
    outputs: Sequence[Output],
    options: LiveOptions,
    *,
    control: SessionControl | None = None,
    say: Notifier = lambda text: None,
    progress: Notifier = lambda text: None,
    clock: Callable[[], float] = time.monotonic,
) -> LiveResult:
    """Run until the stream ends, the time of `options` is over or Ctrl-C; then close stream and outputs.

    An error of the stream or the method is raised after everything is closed. An output that fails is closed and
    reported through `say`; the others continue. `control` takes commands of other threads. `progress` receives the
    status line about once a second, and `say` which stations are lost or back.
    """
    queue: DroppingQueue[TrackerFrame] = DroppingQueue(options.queue_frames)
    capture = CaptureThread(stream, queue)
    statistics = LiveStatistics(stream.stations, clock)
    control = control or SessionControl()
    control.reconstructor = reconstructor
    solver = _SolverThread(queue, body, reconstructor, calibration, outputs, options, control, say, clock, statistics)
    thread = Thread(target=solver.run, name="reconstruct")
    stopped = False
    try:
        with low_latency_mode():
            solver.prepare()
            thread.start()
            capture.start()
            start_s = shown_s = clock()
            while not solver.done.wait(_POLL_PERIOD_S):
                for message in statistics.update(queue.dropped):
                    say(message)
                if clock() - shown_s >= _STATUS_PERIOD_S:
                    shown_s = clock()
                    progress(statistics.status_line())
                if options.seconds is not None and clock() - start_s >= options.seconds:
                    break
    except KeyboardInterrupt:
        stopped = True
        say("stopped")
    finally:
        capture.stop()
        queue.end()
        if thread.ident is not None:
            thread.join()
        solver.close()
        progress("")
    if error := solver.error or capture.error:
        raise error
    solver.result.captured, solver.result.dropped = capture.frames, queue.dropped
    solver.result.stopped = stopped
    return solver.result


class _SolverThread:
    """The work of the solving thread, and its results."""

    def __init__(
        self,
        queue: DroppingQueue[TrackerFrame],
        body: Body,
        reconstructor: Reconstructor,
        calibration: Calibration,
        outputs: Sequence[Output],
        options: LiveOptions,
        control: SessionControl,
        say: Notifier,
        clock: Callable[[], float],
        statistics: LiveStatistics,
    ) -> None:
        self._statistics = statistics
        self._queue, self._reconstructor = queue, reconstructor
        self._outputs, self._options, self._say, self._clock = list(outputs), options, say, clock
        self._control = control
        self._newest: Estimate | None = None
        self._kinematics = Kinematics(body)
        self._host_clock = HostClockEstimator()
        deadline_s = 1.0 / options.rate_hz if options.deadline_s is None else options.deadline_s
        self.result = LiveResult(StageLatencies(deadline_s))
        self._session: Session | None = None
        self._place(calibration, UNTURNED)
        self._first_s = 0.0
        self._waiting: deque[tuple[TrackerFrame, float]] = deque()
        """The frame that was answered last and those after it, with their times of measurement [s]."""
        self.done = Event()
        self.error: Exception | None = None

    def prepare(self) -> None:
        """Begin the method's session."""
        self._session = self._reconstructor.begin(self._calibration)

    def run(self) -> None:
        try:
            if self._session is not None:
                self._solve(self._session)
        except Exception as error:  # `run_session` raises it again
            self.error = error
        finally:
            self.done.set()

    def close(self) -> None:
        """Close all outputs."""
        while self._outputs:
            self._close(self._outputs.pop())

    def _close(self, output: Output) -> None:
        try:
            output.close()
        except Exception as error:  # the other outputs must be closed too
            self.result.failed.setdefault(output.name, _error_text(error))

    def _place(self, calibration: Calibration, turn: WorldTurn) -> None:
        """Set the calibration and the turn of the world by which outputs see bodies, and the place of the tracker."""
        self._calibration, self._world_turn = calibration, turn
        self._room = turn.pose(calibration.tracker_origin_m, calibration.world_from_tracker)

    def _carry_out(self, request: SessionRequest) -> None:
        """Carry out a command between two frames."""
        if request.calibration is not None:
            self._waiting.clear()
            self._place(request.calibration, UNTURNED)
            request.answer.set_result(0.0)
            return
        pose, before = self._newest, self._world_turn
        turned = None if pose is None or pose.status is Status.LOST else before.forward(pose.qpos)
        if turned is None:
            advice = "Stand upright and in sight of the tracker, then try again."
            request.answer.set_exception(BadInput("The performer is lost, or lies: no heading is known.", advice))
            return
        self._place(self._calibration, turned)
        request.answer.set_result(float(rotations.wrap_angle(np.array(turned.yaw_rad - before.yaw_rad))))

    def _solve(self, session: Session) -> None:
        number, lag, collected_s, done = 0, 0, self._clock(), self.result
        while (frame := self._queue.take()) is not None:
            taken_s = self._clock()
            if (request := self._control.next_request()) is not None:
                if request.session is not None:
                    session, lag = request.session, 0
                self._carry_out(request)
            estimate = session.step(frame)
            if self._world_turn is not UNTURNED:
                estimate = replace(estimate, qpos=self._world_turn.qpos(estimate.qpos))
            self._newest, ready_s = estimate, self._clock()
            self._waiting.append((frame, self._host_clock.measured_s(frame)))
            if estimate.lag > lag:  # the first frames: the first one is answered again
                lag = done.lag_frames = estimate.lag
                done.lag_s = lag / self._options.rate_hz
                continue
            while len(self._waiting) > estimate.lag + 1:
                self._waiting.popleft()
            answered, measured_s = self._waiting[0]
            pose = LivePose(number, answered, taken_s, ready_s, measured_s, estimate, self._kinematics, self._room)
            self._send(pose)
            sent_s = self._clock()
            done.stages.add(frame.received_s, taken_s, ready_s, sent_s)
            self._statistics.add(frame, estimate.status, ready_s - frame.received_s)
            done.status[estimate.status.name.lower()] += 1
            done.origin[estimate.origin.name.lower()] += 1
            if estimate.angle_sigma_rad is not None:
                done.sigma_sum_rad += estimate.angle_sigma_rad
            self._first_s = self._first_s or ready_s
            done.seconds = ready_s - self._first_s
            number += 1
            if len(self._queue) == 0 and sent_s - collected_s > _COLLECT_PERIOD_S:
                collected_s = sent_s
                collect_garbage()

    def _send(self, pose: LivePose) -> None:
        for output in list(self._outputs):
            try:
                output.send(pose)
            except Exception as error:  # no error of an output ends the session
                self.result.failed[output.name] = _error_text(error)
                self._outputs.remove(output)
                self._say(f"{output.name}: {_error_text(error)}; the session goes on without it")
                self._close(output)


def _error_text(error: Exception) -> str:
    """The message of an OSError; type and message of another error."""
    return str(error) if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
