"""Live output to a BVH file that stays readable: every frame that was saved is in it, however the program ends."""

from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.live.incremental_file import IncrementalFile
from harness.live.pose import LivePose
from harness.mocap.write.bvh import channel_values, format_row, hierarchy_lines

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
