"""Shared memory through which a live session hands poses to a viewer's process without waiting for it."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from harness.core.arrays import Floats
from harness.core.child_process import FunctionProcess
from harness.core.estimate import Status
from harness.live.pose import LivePose
from harness.stream import TrackerFrame

ViewerKind = Literal["window", "frames"]
_START_TIMEOUT_S = 60.0
READY, CLOSED = "ready", "its window was closed"
"""Messages of the viewer's process: the first picture was drawn; the user closed the window."""
CONFIGURATION = slice(3, 58)
"""Place of the configuration in the record of `SharedPose`; before it stand number, time and status."""
BESIDE, STILL_SHARE = slice(58, 113), 113
"""Place of a second configuration, NaN for none, and of the share of a hold that is complete, NaN for none."""
_RECORD_SIZE = 114


@dataclass(frozen=True)
class ViewerConfig:
    """What the viewer's process draws, and where."""

    kind: ViewerKind
    bone_m: Floats
    """(B, 3) bone vectors of the body [m]."""
    out: str
    """Folder of the pictures; empty for a window."""
    rate_hz: float
    """Most pictures per second [Hz]."""


def first_message(process: FunctionProcess) -> Any:
    """The first message of a viewer's process, or an OSError that says why there is none."""
    try:
        return process.receive(_START_TIMEOUT_S)
    except TimeoutError:
        return OSError("it does not answer")
    except EOFError:
        return OSError(f"its process ended with exit code {process.exit_code}")


class SharedPose:
    """The newest pose in memory that two processes share, and the performer beside it during a guided calibration."""

    def __init__(self, context: Any) -> None:
        """`context` is a `multiprocessing` context."""
        self._lock = context.Lock()
        self._memory = context.RawArray("d", _RECORD_SIZE)
        self._memory[0] = -1.0
        self._memory[BESIDE.start :] = [np.nan] * (_RECORD_SIZE - BESIDE.start)

    def put(self, pose: LivePose) -> None:
        """Store a pose, or drop it while the other process reads: this call never waits."""
        if self._lock.acquire(block=False):
            try:
                self._fill(pose.number, pose.measured_s, pose.estimate.status, pose.estimate.qpos)
            finally:
                self._lock.release()

    def set(self, number: int, qpos: Floats, beside: Floats | None = None, still_share: float = np.nan) -> None:
        """Store a configuration (55,) that belongs to no time, another (55,) that is drawn beside it, and the meter.

        Waits while the other process reads.
        """
        with self._lock:
            self._fill(number, 0.0, Status.SOLVED, qpos)
            self._memory[BESIDE] = np.full(55, np.nan) if beside is None else beside
            self._memory[STILL_SHARE] = still_share

    def _fill(self, number: int, time_s: float, status: Status, qpos: Floats) -> None:
        self._memory[:3] = [number, time_s, status]
        self._memory[CONFIGURATION] = qpos

    def get(self) -> Floats:
        """The record (114,): number, time [s], status, `qpos`, the configuration beside it, and the meter.

        The number is -1 before the first pose.
        """
        with self._lock:
            return np.array(self._memory)


_POSE, _SIGMA, _ROOM = slice(4, 59), slice(59, 107), slice(107, 114)
"""Places of configuration, standard deviations and room in a record of `PoseRing`; the stations follow."""
_STATION = 11
_CAPACITY = 1024
"""Frames: 8 s at 120 Hz."""


class PoseRing:
    """The last 1024 frames of S stations. One process writes and one reads; neither waits for the other.

    A record is: number, time at which the pose was ready [s], time from the frame's last byte to it [s], status, the
    configuration (55,), the stated standard deviations (48,) [rad], the tracker's origin (3,) [m] and orientation (4,)
    in the world, and for each station position (3,) [m] and orientation (4,) in the tracker's frame, quality, whether
    position and orientation are valid, and whether the reading is suspect. Standard deviations that the method does not
    state, and an unknown room, are NaN.
    """

    def __init__(self, context: Any, stations: int) -> None:
        """`context` is a `multiprocessing` context."""
        self.stations = stations
        self.size = _ROOM.stop + _STATION * stations
        self._records = context.RawArray("d", _CAPACITY * self.size)
        self._written = context.RawValue("q", 0)
        self._rows: Floats | None = None

    def __getstate__(self) -> dict[str, Any]:
        """Without the view of the memory, which another process makes of its own."""
        return self.__dict__ | {"_rows": None}

    def put(self, pose: LivePose) -> None:
        """Write a frame over the oldest one."""
        frame, count = pose.frame, self._written.value
        record = self._view()[count % _CAPACITY]
        record[: _POSE.start] = pose.number, pose.ready_s, pose.ready_s - frame.received_s, pose.estimate.status
        sigma_rad = pose.estimate.angle_sigma_rad
        record[_POSE], record[_SIGMA] = pose.estimate.qpos, np.nan if sigma_rad is None else sigma_rad
        room = record[_ROOM]
        room[:3], room[3:] = (np.nan, np.nan) if pose.room is None else pose.room
        stations = record[_ROOM.stop :].reshape(self.stations, _STATION)
        stations[:, :3], stations[:, 3:7], stations[:, 7] = frame.position_m, frame.tracker_from_station, frame.quality
        stations[:, 8], stations[:, 9] = frame.position_valid, frame.orientation_valid
        stations[:, 10] = frame.suspect
        self._written.value = count + 1

    def read(self, after: int) -> tuple[int, Floats]:
        """The number of frames written so far, and the records (N, size) after the first `after` of them.

        Frames that were overwritten are left out. So is the oldest slot, which may be being written.
        """
        count = int(self._written.value)
        first = max(after, count - _CAPACITY + 1)
        rows = self._view()[np.arange(first, count) % _CAPACITY].copy()
        overwritten = max(0, int(self._written.value) - _CAPACITY + 1 - first)
        return count, rows[overwritten:]

    def _view(self) -> Floats:
        if self._rows is None:
            self._rows = np.frombuffer(self._records, dtype=np.float64).reshape(_CAPACITY, self.size)
        return self._rows

    @staticmethod
    def qpos(records: Floats) -> Floats:
        """(N, 55) configurations of records."""
        out: Floats = records[:, _POSE]
        return out

    @staticmethod
    def sigma(record: Floats) -> Floats | None:
        """(48,) stated standard deviations of one record [rad]; None if the method states none."""
        return None if np.isnan(record[_SIGMA]).any() else record[_SIGMA]

    @staticmethod
    def room(record: Floats) -> tuple[Floats, Floats] | None:
        """The tracker's origin (3,) [m] and orientation (4,) in the world, of one record; None if not known."""
        room = record[_ROOM]
        return None if np.isnan(room).any() else (room[:3], room[3:])

    def station_columns(self, records: Floats) -> Floats:
        """(N, S, 11) columns of the stations of records."""
        out: Floats = records[:, _ROOM.stop :].reshape(len(records), self.stations, _STATION)
        return out

    @staticmethod
    def frame(head: Floats, columns: Floats) -> TrackerFrame:
        """The readings of a record: its first numbers (4,), and the columns (S, 11) of its stations."""
        times_s = np.full(len(columns), head[1])
        position_valid, orientation_valid = columns[:, 8] > 0.0, columns[:, 9] > 0.0
        return TrackerFrame(
            float(head[1]), times_s, columns[:, :3], columns[:, 3:7], position_valid, orientation_valid, columns[:, 7],
            columns[:, 10] > 0.0,
        )  # fmt: skip
