"""Shared memory through which a live session hands every frame to a viewer's process without waiting for it."""

from typing import Any

import numpy as np

from harness.core.arrays import Floats
from harness.live.pose import LivePose
from harness.stream.frame import TrackerFrame

_HEAD, _QPOS, _STATION = 4, 55, 10
_CAPACITY = 1024
"""Frames: 8 s at 120 Hz."""


class PoseRing:
    """The last 1024 frames of S stations. One process writes and one reads; neither waits for the other.

    A record is: number, time at which the pose was ready [s], time from the frame's last byte to it [s], status, the
    configuration (55,), and for each station position (3,) [m] and orientation (4,) in the tracker's frame, quality,
    and whether position and orientation are valid.
    """

    def __init__(self, context: Any, stations: int) -> None:
        """`context` is a `multiprocessing` context."""
        self.stations = stations
        self.size = _HEAD + _QPOS + _STATION * stations
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
        record[:_HEAD] = pose.number, pose.ready_s, pose.ready_s - frame.received_s, pose.estimate.status
        record[_HEAD : _HEAD + _QPOS] = pose.estimate.qpos
        stations = record[_HEAD + _QPOS :].reshape(self.stations, _STATION)
        stations[:, :3], stations[:, 3:7], stations[:, 7] = frame.position_m, frame.tracker_from_station, frame.quality
        stations[:, 8], stations[:, 9] = frame.position_valid, frame.orientation_valid
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
        out: Floats = records[:, _HEAD : _HEAD + _QPOS]
        return out

    def station_columns(self, records: Floats) -> Floats:
        """(N, S, 10) columns of the stations of records."""
        out: Floats = records[:, _HEAD + _QPOS :].reshape(len(records), self.stations, _STATION)
        return out

    @staticmethod
    def frame(head: Floats, columns: Floats) -> TrackerFrame:
        """The readings of a record: its first numbers (4,), and the columns (S, 10) of its stations."""
        times_s, nothing = np.full(len(columns), head[1]), np.zeros(len(columns), bool)
        position_valid, orientation_valid = columns[:, 8] > 0.0, columns[:, 9] > 0.0
        return TrackerFrame(
            float(head[1]), times_s, columns[:, :3], columns[:, 3:7], position_valid, orientation_valid, columns[:, 7],
            nothing,
        )  # fmt: skip
