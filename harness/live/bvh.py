"""Poses into a BVH file as they come: every frame that was written is in the file, however the program ends."""

from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.live.incremental_file import IncrementalFile
from harness.live.pose import LivePose
from harness.mocap.write.bvh import channel_values, format_row, hierarchy_lines

_FRAME_COUNT_LINE = "Frames: {:>10}"
"""As wide for any number, since it stands before the frames and grows with them."""
_MAX_GAP_S = 10.0


class BvhOutput:
    """An `Output`: joints, axes and numbers of `harness export --format bvh`.

    BVH has an even rate and no times, so where frames were dropped the one before is repeated; a break of more than
    10 s, or a device that set its clock anew, is one frame.
    """

    def __init__(self, path: Path, own: Skeleton, rate_hz: float, *, force: bool = False) -> None:
        """BadFile when there is one and it is not to be written over, or when it cannot be written."""
        self.name, self.description = f"--bvh {path}", f"BVH: {path}"
        self._skeleton, self._rate_hz = own, rate_hz
        head = "\n".join([*hierarchy_lines(own), "MOTION", ""])
        self._count_at = len(head)
        head += f"{_FRAME_COUNT_LINE.format(0)}\nFrame Time: {1.0 / rate_hz:.9f}\n"
        self._file = IncrementalFile(path, head.encode(), force=force)
        self._frames = 0
        self._device_s = -np.inf
        self._numbers: Floats = np.zeros(0)
        self._row = b""

    def send(self, pose: LivePose) -> None:
        passed_s = pose.device_s - self._device_s
        missing = max(round(passed_s * self._rate_hz) - 1, 0) if passed_s < _MAX_GAP_S else 0
        numbers = self._channels(pose)
        if self._frames:
            turned = numbers[3:] - self._numbers[3:]
            numbers[3:] -= 360.0 * np.round(turned / 360.0)
        before, self._row = self._row, (format_row(numbers) + "\n").encode()
        self._numbers, self._device_s = numbers, pose.device_s
        self._frames += missing + 1
        if self._file.write(before * missing + self._row, pose.ready_s):
            self._save()

    def close(self) -> None:
        try:
            if not self._file.closed:
                self._save()
        finally:
            self._file.close()

    def _channels(self, pose: LivePose) -> Floats:
        _, world_from_bone = pose.bones
        root, bones = rotations.to_matrix(pose.world_from_root), rotations.to_matrix(world_from_bone)
        out: Floats = channel_values(self._skeleton, pose.root_m[None], root[None], bones[None])[0]
        return out

    def _save(self) -> None:
        self._file.save(_FRAME_COUNT_LINE.format(self._frames).encode(), self._count_at)
