"""A pose log as a stream of frames."""

from collections.abc import Callable, Iterator
from threading import Event

import numpy as np

from harness.core.arrays import Floats
from harness.stream.frame import TrackerFrame, split_frames
from harness.stream.poses.pose_log import PoseLog
from harness.stream.recording.replay import ReplaySpeed, pace_frames, wait_for_enter

_FRAMES_PER_PART = 1000


class PoseLogStream:
    """A `TrackerStream` over a pose log: a frame for each time at which a body has a pose; every iteration starts anew.

    A log has no period, so bodies that the source sampled at different times come in different frames, in which the
    others are not valid. `received_s` and `measured_s` are times of the log [s]. A pose has the quality 1, because a
    log has none, and is never suspect.
    """

    def __init__(self, log: PoseLog, speed: ReplaySpeed = "max", *, step: Callable[[], bool] = wait_for_enter) -> None:
        """`speed` and `step` are those of `RecordingStream`."""
        self.log = log
        self._speed, self._step = speed, step
        self._closed = Event()

    @property
    def stations(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return self.log.names

    def close(self) -> None:
        """End the iteration; may be called from any thread."""
        self._closed.set()

    def wall_s(self, received_s: float) -> float:
        """Wall clock at a time of the log [s]; the time itself where the log does not tell."""
        return received_s + (self.log.start_unix_s or 0.0)

    def __iter__(self) -> Iterator[TrackerFrame]:
        frames = ((frame.received_s, frame) for frame in self._all_frames())
        return pace_frames(frames, self._speed, self._step, self._closed)

    def _all_frames(self) -> Iterator[TrackerFrame]:
        times_s = np.unique(np.concatenate([body.times_s for body in self.log.bodies]))
        for begin in range(0, len(times_s), _FRAMES_PER_PART):
            yield from self._frames(times_s[begin : begin + _FRAMES_PER_PART])

    def _frames(self, times_s: Floats) -> list[TrackerFrame]:
        """Frames at these times, which are all those of the bodies between the first and the last."""
        shape = len(times_s), len(self.log.bodies)
        measured_s = np.full(shape, np.nan)
        position_m, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
        for n, body in enumerate(self.log.bodies):
            first, last = np.searchsorted(body.times_s, [times_s[0], times_s[-1]], side="left")
            part = slice(first, last + (last < len(body.times_s) and body.times_s[last] == times_s[-1]))
            rows = np.searchsorted(times_s, body.times_s[part])
            measured_s[rows, n] = body.times_s[part]
            position_m[rows, n], quaternion[rows, n] = body.positions_m[part], body.quaternions[part]
        valid = np.isfinite(measured_s)
        suspect = np.zeros(shape, dtype=bool)
        quality = valid.astype(np.float64)
        return split_frames(times_s.tolist(), measured_s, position_m, quaternion, valid, valid, quality, suspect)
