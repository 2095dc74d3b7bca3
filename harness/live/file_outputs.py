"""Live output to files: a table of poses with the times of every frame, and BVH.

Every frame that was saved is in them, however the program ends. Between two saves nothing is written, so that a file
ends with a whole line whenever the process is killed. An existing file is refused unless `force` is set, and is then
replaced when the first frame is saved.
"""

import os
from io import FileIO
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.csv_text import csv_line
from harness.core.fault_report import is_system_fault
from harness.core.files import require_writable
from harness.core.skeleton import Skeleton
from harness.errors import BadFile
from harness.live.pose import LivePose
from harness.mocap.write import channel_values, format_row, hierarchy_lines

_SAVE_PERIOD_S = 1.0


class IncrementalFile:
    """A file with a head, to which bytes are appended."""

    def __init__(self, path: Path, head: bytes, *, force: bool) -> None:
        """BadFile if the file exists and `force` is not set, or if it cannot be written."""
        require_writable(path, "a file of motion", force=force)
        self.path = path.resolve() if force else path  # the target of a link is replaced, not the link
        self._written_path = self.path.with_name(f".unfinished-{self.path.name}") if force else path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: FileIO = self._written_path.open("wb" if force else "xb", buffering=0)
        except OSError as error:
            if is_system_fault(error):
                raise
            raise BadFile(path, f"it cannot be written ({error.strerror})", "a file", "Name another.") from error
        self._pending = bytearray(head)
        self._saved_s: float | None = None

    def write(self, data: bytes, now_s: float) -> bool:
        """Append whole lines; True when it is time to call `save`, once a second."""
        self._pending += data
        due = self._saved_s is None or now_s - self._saved_s > _SAVE_PERIOD_S
        self._saved_s = now_s if due else self._saved_s
        return due

    def save(self, patch: bytes = b"", offset: int = 0) -> None:
        """Write what was appended, and then overwrite bytes of the head at `offset` with `patch`."""
        while self._pending:
            del self._pending[: self._file.write(self._pending)]
        if patch:
            self._file.seek(offset)
            self._file.write(patch)
            self._file.seek(0, os.SEEK_END)
        if self._written_path != self.path and self._saved_s is not None:
            self._replace_existing()

    def close(self) -> None:
        """Close the file; remove it if nothing was saved after its head."""
        try:
            if self._saved_s is not None and not self.closed:
                self.save()
        finally:
            self._file.close()
            if self._saved_s is None or self._written_path != self.path:
                self._written_path.unlink(missing_ok=True)

    def _replace_existing(self) -> None:
        """Move the file to its final path; it is closed meanwhile, since Windows cannot move open files."""
        self._file.close()
        os.replace(self._written_path, self.path)
        self._written_path = self.path
        self._file = self.path.open("r+b", buffering=0)
        self._file.seek(0, os.SEEK_END)

    @property
    def closed(self) -> bool:
        return self._file.closed


class PoseTableOutput:
    """An `Output` to comma-separated values, one row per frame; numbers are written so that they read back exactly.

    Times are on the host's monotonic clock, which all programs share under Linux. Columns that begin with `device_s`
    are the stations' time stamps on the device's clock.
    """

    def __init__(self, path: Path, skeleton: Skeleton, stations: tuple[str, ...], *, force: bool = False) -> None:
        """BadFile if the file exists and `force` is not set, or if it cannot be written."""
        self.name, self.description = f"--poses {path}", f"table of poses: {path}"
        root = [f"root.{axis}_m" for axis in "xyz"] + [f"root.q{axis}" for axis in "wxyz"]
        hinges = [f"{skeleton.dof_names[d]}_rad" for d in hinges_in_qpos_order(skeleton)]
        times = ["received_s", "taken_s", "ready_s", *(f"device_s.{name}" for name in stations)]
        head = csv_line(["frame", "status", "origin", *times, *root, *hinges])
        self._file = IncrementalFile(path, head.encode(), force=force)

    def send(self, pose: LivePose) -> None:
        frame = pose.frame
        times = (frame.received_s, pose.taken_s, pose.ready_s, *frame.measured_s.tolist())
        numbers = map(repr, (*times, *pose.estimate.qpos.tolist()))
        estimate = pose.estimate
        states = f"{estimate.status.name.lower()},{estimate.origin.name.lower()}"
        line = f"{pose.number},{states},{','.join(numbers)}\n"
        if self._file.write(line.encode(), pose.ready_s):
            self._file.save()

    def close(self) -> None:
        self._file.close()


def hinges_in_qpos_order(skeleton: Skeleton) -> list[int]:
    """Indices of the skeleton's hinges in the order of `qpos`, where a bone's outermost hinge is first."""
    return [d for dofs in skeleton.dof_of_bone for d in reversed(range(dofs.start, dofs.stop))]


_FRAME_COUNT_LINE = "Frames: {:>10}"
"""Line of constant width, so that the count can be overwritten in place."""
_MAX_GAP_S = 10.0
"""Longer gaps, and jumps of the device clock, are not filled with repeated frames."""


class BvhOutput:
    """An `Output` to a file with the joints, axes and units of `harness export --format bvh`.

    BVH has a constant rate and no times, so the last frame is repeated for dropped frames. After a gap of more than
    10 s, or a reset of the device clock, no frame is repeated. Frames are written before their count, so that a killed
    process leaves a file with as many frames as announced, or a few more, which `harness.mocap.read.bvh` reads too.
    """

    def __init__(self, path: Path, skeleton: Skeleton, rate_hz: float, *, force: bool = False) -> None:
        """BadFile if the file exists and `force` is not set, or if it cannot be written."""
        self.name, self.description = f"--bvh {path}", f"BVH: {path}"
        self._skeleton, self._rate_hz = skeleton, rate_hz
        head = "\n".join([*hierarchy_lines(skeleton), "MOTION", ""])
        self._count_offset = len(head)
        head += f"{_FRAME_COUNT_LINE.format(0)}\nFrame Time: {1.0 / rate_hz:.9f}\n"
        self._file = IncrementalFile(path, head.encode(), force=force)
        self._frames = 0
        self._device_s = -np.inf
        self._values: Floats = np.zeros(0)
        self._row = b""

    def send(self, pose: LivePose) -> None:
        elapsed_s = pose.device_s - self._device_s
        missing = max(round(elapsed_s * self._rate_hz) - 1, 0) if elapsed_s < _MAX_GAP_S else 0
        values = self._channel_values(pose)
        if self._frames:
            change_deg = values[3:] - self._values[3:]
            values[3:] -= 360.0 * np.round(change_deg / 360.0)
        previous_row, self._row = self._row, (format_row(values) + "\n").encode()
        self._values, self._device_s = values, pose.device_s
        self._frames += missing + 1
        if self._file.write(previous_row * missing + self._row, pose.ready_s):
            self._save()

    def close(self) -> None:
        try:
            if not self._file.closed:
                self._save()
        finally:
            self._file.close()

    def _channel_values(self, pose: LivePose) -> Floats:
        _, world_from_bone = pose.bones
        root, bones = rotations.to_matrix(pose.world_from_root), rotations.to_matrix(world_from_bone)
        out: Floats = channel_values(self._skeleton, pose.root_m[None], root[None], bones[None])[0]
        return out

    def _save(self) -> None:
        self._file.save(_FRAME_COUNT_LINE.format(self._frames).encode(), self._count_offset)
