"""Poses as a table, with the times of every frame: for whoever joins them with what else was recorded."""

from pathlib import Path

from harness.core.skeleton import Skeleton
from harness.live.incremental_file import IncrementalFile
from harness.live.pose import LivePose


class PoseTableOutput:
    """An `Output`: one row of comma-separated values for each frame, numbers such that they are read back exactly.

    Times are of this computer's monotonic clock, which all programs on it share under Linux; those that begin with
    `device_s` are each station's stamps by the device's own.
    """

    def __init__(self, path: Path, own: Skeleton, stations: tuple[str, ...], *, force: bool = False) -> None:
        """BadFile when there is one and it is not to be written over, or when it cannot be written."""
        self.name, self.description = f"--poses {path}", f"table of poses: {path}"
        root = [f"root.{axis}_m" for axis in "xyz"] + [f"root.q{axis}" for axis in "wxyz"]
        hinges = [f"{own.dof_names[d]}_rad" for d in _hinges_in_qpos_order(own)]
        times = ["received_s", "taken_s", "ready_s", *(f"device_s.{name}" for name in stations)]
        head = ",".join(["frame", "status", *times, *root, *hinges]) + "\n"
        self._file = IncrementalFile(path, head.encode(), force=force)

    def send(self, pose: LivePose) -> None:
        frame = pose.frame
        times = (frame.received_s, pose.taken_s, pose.ready_s, *frame.measured_s.tolist())
        numbers = map(repr, (*times, *pose.estimate.qpos.tolist()))
        line = f"{pose.number},{pose.estimate.status.name.lower()},{','.join(numbers)}\n"
        if self._file.write(line.encode(), pose.ready_s):
            self._file.save()

    def close(self) -> None:
        self._file.close()


def _hinges_in_qpos_order(own: Skeleton) -> list[int]:
    """The skeleton's hinges in the order of a configuration, each bone's from the outermost (`core.humanoid24`)."""
    return [d for where in own.dof_of_bone for d in reversed(range(where.start, where.stop))]
