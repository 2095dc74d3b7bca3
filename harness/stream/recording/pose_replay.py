"""A pose log as a stream of frames."""

from collections.abc import Callable, Iterator, Sequence
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

    def __init__(
        self,
        log: PoseLog,
        speed: ReplaySpeed = "max",
        *,
        step: Callable[[], bool] = wait_for_enter,
        period_s: float | None = None,
    ) -> None:
        """`speed` and `step` are those of `RecordingStream`.

        With a period [s], the frame of each period holds the latest pose of each body in it.
        """
        self.log = log
        self._period_s = period_s
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
        instants = [self._instants(body.times_s) for body in self.log.bodies]
        distinct = np.unique(np.concatenate(instants))
        for begin in range(0, len(distinct), _FRAMES_PER_PART):
            yield from self._frames(distinct[begin : begin + _FRAMES_PER_PART], instants)

    def _instants(self, times_s: Floats) -> Floats:
        """What poses of one frame have in common: their time, or the number of their period."""
        return times_s if self._period_s is None else np.rint(times_s / self._period_s)

    def _frames(self, distinct: Floats, instants: Sequence[Floats]) -> list[TrackerFrame]:
        """Frames of consecutive instants, of all those of the bodies."""
        shape = len(distinct), len(self.log.bodies)
        measured_s = np.full(shape, np.nan)
        position_m, quaternion = np.full((*shape, 3), np.nan), np.full((*shape, 4), np.nan)
        for n, (body, own) in enumerate(zip(self.log.bodies, instants, strict=True)):
            part = slice(np.searchsorted(own, distinct[0]), np.searchsorted(own, distinct[-1], side="right"))
            rows = np.searchsorted(distinct, own[part])  # of poses in one period the last one is assigned
            measured_s[rows, n] = body.times_s[part]
            position_m[rows, n], quaternion[rows, n] = body.positions_m[part], body.quaternions[part]
        valid = np.isfinite(measured_s)
        suspect = np.zeros(shape, dtype=bool)
        quality = valid.astype(np.float64)
        received_s = np.nanmax(measured_s, axis=1).tolist()
        return split_frames(received_s, measured_s, position_m, quaternion, valid, valid, quality, suspect)
