"""A live session: frames of a tracker into poses and out again, as they come.

Two threads. One reads the tracker and never waits for anything else; the other takes frames from a queue that drops
the oldest, solves and sends. Whoever calls waits, and ends it by Ctrl-C.
"""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Event, Thread

from harness.body.humanoid import Body
from harness.body.kinematics import Kinematics
from harness.calibrate.guided_calibration import Calibrator, Notifier
from harness.core.calibration import Calibration
from harness.core.estimate import Status
from harness.live.capture import CapturedFrame, CaptureThread
from harness.live.clock import HostClockEstimator
from harness.live.dropping_queue import DroppingQueue
from harness.live.latency import StageLatencies
from harness.live.low_latency import collect_garbage, low_latency_mode
from harness.live.pose import LivePose, Output
from harness.reconstruct.contract import Reconstructor, Session
from harness.stream.frame import TrackerFrame, TrackerStream

QUEUE_FRAMES = 32
"""What waits for a pose that takes long: a quarter of a second at 120 Hz. Solving is several times faster than frames
come, so that it has soon caught up, and methods do not like gaps [choice]."""
_COLLECT_PERIOD_S = 1.0
_POLL_PERIOD_S = 0.1


@dataclass(frozen=True)
class LiveOptions:
    """How a session goes."""

    rate_hz: float
    """Frames per second that the tracker is to send."""
    deadline_s: float | None = None
    """From the last byte to the pose; by default a period."""
    seconds: float | None = None
    """After so long it ends by itself, calibration not counted."""
    queue_frames: int = QUEUE_FRAMES
    host_timestamps: bool = True
    """Whether frames are stamped by this computer's monotonic clock as they come. Those of a recording are not, and
    their way is timed from where they leave the stream."""


@dataclass(frozen=True, eq=False)
class LiveResult:
    """What became of a session."""

    captured: int
    """Frames that the stream gave."""
    frames_before: int
    """Those that went by until the trackers were calibrated and the method ready for them."""
    dropped: int
    """Those that waited too long for their turn and were never solved."""
    status: dict[str, int]
    """Poses by how far they rest on readings."""
    seconds: float
    """From the first pose to the last."""
    stages: StageLatencies
    failed: dict[str, str]
    """Outputs that could not go on, and why."""

    @property
    def poses(self) -> int:
        return sum(self.status.values())


def warm_up(reconstructor: Reconstructor, calibration: Calibration, frames: Sequence[TrackerFrame]) -> None:
    """Step through frames in a session that is thrown away, so that everything is compiled and at hand."""
    session = reconstructor.begin(calibration)
    for frame in frames:
        session.step(frame)


def run_session(
    stream: TrackerStream,
    body: Body,
    reconstructor: Reconstructor,
    worn: Calibration | Calibrator,
    outputs: Sequence[Output],
    plan: LiveOptions,
    *,
    say: Notifier = lambda text: None,
    clock: Callable[[], float] = time.monotonic,
) -> LiveResult:
    """Until the stream ends, the plan's time is over or Ctrl-C; stream and outputs are closed then.

    What ends a stream or a method unexpectedly is raised, after all is closed. An output that fails is left out, and
    said so; the others go on.
    """
    queue: DroppingQueue[CapturedFrame] = DroppingQueue(plan.queue_frames)
    capture = CaptureThread(stream, queue, clock)
    solver = _SolverThread(queue, body, reconstructor, worn, outputs, plan, say, clock)
    thread = Thread(target=solver.run, name="reconstruct")
    try:
        with low_latency_mode():
            solver.prepare()
            thread.start()
            capture.start()
            while not solver.done.wait(_POLL_PERIOD_S):
                if plan.seconds is not None and clock() - solver.began_s >= plan.seconds:
                    break
    except KeyboardInterrupt:
        say("stopped")
    finally:
        capture.stop()
        queue.end()
        if thread.ident is not None:
            thread.join()
        solver.close()
    if error := solver.error or capture.error:
        raise error
    return solver.result(capture.frames)


class _SolverThread:
    """What the second thread does, and what it has to tell afterwards."""

    def __init__(
        self,
        queue: DroppingQueue[CapturedFrame],
        body: Body,
        reconstructor: Reconstructor,
        worn: Calibration | Calibrator,
        outputs: Sequence[Output],
        plan: LiveOptions,
        say: Notifier,
        clock: Callable[[], float],
    ) -> None:
        self._queue, self._reconstructor, self._calibration = queue, reconstructor, worn
        self._outputs, self._plan, self._say, self._clock = list(outputs), plan, say, clock
        self._kinematics = Kinematics(body)
        self._host_time = HostClockEstimator()
        self._stages = StageLatencies(1.0 / plan.rate_hz if plan.deadline_s is None else plan.deadline_s)
        self._status: Counter[str] = Counter()
        self._failed: dict[str, str] = {}
        self._session: Session | None = None
        self._frames_calibrated = self._frames_discarded = 0
        """Frames that were calibrated from, and that went by meanwhile."""
        self._first_s = self._last_s = 0.0
        self.began_s = float("inf")
        """When calibration was over [s]."""
        self.done = Event()
        self.error: Exception | None = None

    def prepare(self) -> None:
        """What can be done before the first frame."""
        if isinstance(self._calibration, Calibration):
            self._session = self._reconstructor.begin(self._calibration)

    def run(self) -> None:
        try:
            session = self._session
            if not isinstance(self._calibration, Calibration):
                session = self._calibrate(self._calibration)
            if session is not None:
                self.began_s = self._clock()
                self._solve(session)
        except Exception as error:  # whoever waits for this thread raises it again
            self.error = error
        finally:
            self.done.set()

    def close(self) -> None:
        """Finish what the outputs have begun."""
        while self._outputs:
            self._close(self._outputs.pop())

    def _close(self, output: Output) -> None:
        try:
            output.close()
        except Exception as error:  # whatever it is, the others are closed too
            self._failed.setdefault(output.name, _error_text(error))

    def result(self, captured: int) -> LiveResult:
        return LiveResult(
            captured=captured,
            frames_before=self._frames_calibrated + self._frames_discarded,
            dropped=self._queue.dropped - self._frames_discarded,
            status={state.name.lower(): self._status[state.name] for state in Status},
            seconds=self._last_s - self._first_s,
            stages=self._stages,
            failed=self._failed,
        )

    def _calibrate(self, calibrator: Calibrator) -> Session | None:
        """A session for trackers as the stream shows them to be worn; None when it ended before."""
        calibrator.begin(self._say)
        found: Calibration | None = None
        while found is None:
            if (captured := self._queue.take()) is None:
                self._say("calibration: the stream ended before it was done")
                return None
            self._frames_calibrated += 1
            found = calibrator.add(captured.frame, self._say)
        session = self._reconstructor.begin(found)  # a method may take its time to learn how trackers are worn
        self._queue.drop_all()
        self._frames_discarded = self._queue.dropped
        return session

    def _solve(self, session: Session) -> None:
        number, tidied_s = 0, self._clock()
        while (captured := self._queue.take()) is not None:
            taken_s = self._clock()
            frame = captured.frame
            estimate = session.step(frame)
            ready_s = self._clock()
            measured_s = self._host_time.measured_s(frame)
            pose = LivePose(number, frame, taken_s, ready_s, measured_s, estimate, self._kinematics)
            self._send(pose)
            sent_s = self._clock()
            came_s = frame.received_s if self._plan.host_timestamps else captured.captured_s
            self._stages.add(came_s, taken_s, ready_s, sent_s)
            self._status[estimate.status.name] += 1
            self._first_s, self._last_s = self._first_s or ready_s, ready_s
            number += 1
            if len(self._queue) == 0 and sent_s - tidied_s > _COLLECT_PERIOD_S:
                tidied_s = sent_s
                collect_garbage()

    def _send(self, pose: LivePose) -> None:
        for output in list(self._outputs):
            try:
                output.send(pose)
            except Exception as error:  # a library's own too: no output ends the session
                self._failed[output.name] = _error_text(error)
                self._outputs.remove(output)
                self._say(f"{output.name}: {_error_text(error)}; the session goes on without it")
                self._close(output)


def _error_text(error: Exception) -> str:
    """An OSError speaks for itself; of others the kind has to be said."""
    return str(error) if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
