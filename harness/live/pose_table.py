"""Live output to a table of poses with the times of every frame, to join them with other recordings."""

from pathlib import Path

from harness.core.csv_text import csv_line
from harness.core.skeleton import Skeleton
from harness.live.incremental_file import IncrementalFile
from harness.live.pose import LivePose


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
