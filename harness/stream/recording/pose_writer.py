"""Recording of a tracker that reports poses instead of bytes, while it streams (`pose_recording.py` has the format)."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from harness.errors import BadFile
from harness.stream.frame import TrackerFrame
from harness.stream.line_events import LineEvent, TrackedBodies
from harness.stream.ports import TrackerConfig
from harness.stream.poses.pose_log import FileFinding
from harness.stream.recording.block_content import PLAN_FILE, block_content, note_values
from harness.stream.recording.blocks import (
    BODIES,
    EVENT,
    MARK,
    NOTE,
    POSES,
    POSES_HEADER,
    POSES_VERSION,
    RecordingBlock,
    read_version,
)
from harness.stream.recording.pose_recording import EXPECTED_POSES, POSE_ROW, encode_bodies
from harness.stream.recording.recording import whole_blocks
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.vrpn import VrpnConfig


class PoseRecordingWriter(RecordingWriter):
    """Appends the poses of a tracker to a recording of poses; it is a `PoseObserver`.

    Times of a recording that is continued go on by the server's clock. A pose that is not later than the body's last
    one cannot be part of a log: `counts` has their number as `left_out`. Raises BadFile as `RecordingWriter`.
    """

    _header = POSES_HEADER

    def __init__(self, path: Path | str, note: Mapping[str, Any] | None = None) -> None:
        self._latest_s: dict[int, float] = {}
        """Time of the last pose of each body [s], by its number."""
        self._start_unix_s: float | None = None
        self._shift_s = 0.0
        """What is added to a tracker's times [s]."""
        super().__init__(path, note)
        self.counts |= {POSES: 0, "left_out": 0}

    @property
    def empty(self) -> bool:
        return not self.counts[POSES]

    def on_bodies(self, bodies: TrackedBodies) -> None:
        """Write what the poses that follow are of. Raises BadFile for other bodies than before."""
        self._keep_stations(bodies.names)
        if self._start_unix_s is not None:
            self._shift_s = bodies.start_unix_s - self._start_unix_s
            return
        self._start_unix_s = bodies.start_unix_s
        findings = [FileFinding(name, *told, assumed=True) for name, told in bodies.assumed.items()]
        content = encode_bodies(bodies.names, bodies.source, bodies.clock, bodies.start_unix_s, findings)
        self._append(self._block(BODIES, content, 0.0))

    def on_frame(self, frame: TrackerFrame) -> None:
        """Write the poses of a frame that have a place and a direction."""
        rows = np.flatnonzero(frame.position_valid & frame.orientation_valid & np.isfinite(frame.measured_s))
        times_s = frame.measured_s[rows] + self._shift_s
        later = [n for n, row in enumerate(rows) if times_s[n] > self._latest_s.get(int(row), -np.inf)]
        self.counts["left_out"] += len(rows) - len(later)
        if not later:
            return
        rows, times_s = rows[later], times_s[later]
        order = np.argsort(times_s, kind="stable")
        rows, times_s = rows[order], times_s[order]
        content = np.empty(len(rows), dtype=POSE_ROW)
        content["body"], content["time_s"] = rows, times_s
        content["position_m"], content["quaternion"] = frame.position_m[rows], frame.tracker_from_station[rows]
        self._append(self._block(POSES, content.tobytes(), float(times_s[0])))
        self._latest_s.update(zip(rows.tolist(), times_s.tolist(), strict=True))
        self.counts[POSES] += len(rows)

    def on_event(self, event: LineEvent) -> None:
        """Write an event, at the time of the latest pose."""
        self._append(self._block(EVENT, json.dumps({"kind": event.kind, "text": event.text}).encode(), self._now_s))
        self.counts[EVENT] += 1

    def on_mark(
        self, content: Mapping[str, Any], monotonic_s: float | None = None, wall_s: float | None = None
    ) -> None:
        """Write a mark between the latest pose and the next one."""
        at_s = float(np.nextafter(self._now_s, np.inf)) if self._latest_s else 0.0
        self._append(self._block(MARK, json.dumps(content).encode(), at_s))
        self.counts[MARK] += 1

    @property
    def _now_s(self) -> float:
        """Time of the latest pose [s]; 0 before the first."""
        return max(self._latest_s.values(), default=0.0)

    def _block(self, kind: str, payload: bytes, at_s: float) -> RecordingBlock:
        return RecordingBlock(kind, at_s, (self._start_unix_s or 0.0) + at_s, payload)

    def _read_existing(self, file: BinaryIO) -> None:
        """Read the bodies, and the time of the last pose of each. Raises BadFile."""
        head = file.read(len(POSES_HEADER))
        if read_version(head) != POSES_VERSION and head != POSES_HEADER[: len(head)]:
            raise BadFile(self.path, "no recording of poses", EXPECTED_POSES, "Record into another file.")
        notes = list[RecordingBlock]()
        for block in whole_blocks(file):
            if block.kind == NOTE:
                notes.append(block)
            elif block.kind == BODIES:
                content = block_content(self.path, block)
                self._stations = tuple(map(str, content.get("bodies") or ()))
                start_s = content.get("start_unix_s")
                if not isinstance(start_s, float):
                    advice = "Its times cannot go on: record into another file."
                    raise BadFile(self.path, "poses without a time of day", "a recording of a live tracker", advice)
                self._start_unix_s = start_s
            elif block.kind == POSES and len(block.payload) % POSE_ROW.itemsize == 0:
                rows = np.frombuffer(block.payload, dtype=POSE_ROW)
                self._latest_s.update(zip(rows["body"].tolist(), rows["time_s"].tolist(), strict=True))
        self._check_plan(note_values(self.path, notes, PLAN_FILE))


def open_writer(path: Path, note: Mapping[str, Any], config: TrackerConfig) -> RecordingWriter:
    """The writer of a recording of such a tracker: of poses for VRPN, else of bytes. Raises BadFile."""
    return PoseRecordingWriter(path, note) if isinstance(config, VrpnConfig) else RecordingWriter(path, note)
