"""Files of poses of every kind: recordings of them, text of other programs, clusters of markers."""

from collections.abc import Sequence
from pathlib import Path

from harness.errors import BadInput
from harness.mocap import CLIP_FORMATS
from harness.stream import PoseFileOptions
from harness.stream.recording import PoseRecording, is_pose_file, open_poses
from harness.study.trust.marker_poses import MARKER_SUFFIX, read_marker_poses


def holds_poses(path: Path) -> bool:
    """Whether a file may hold poses: a recording of them, rows of numbers, or markers; never motion of a skeleton."""
    kind = path.suffix.lower()
    if kind in (*(f".{kind}" for kind in CLIP_FORMATS), ".asf"):
        return kind == MARKER_SUFFIX and path.is_file()
    return is_pose_file(path)


def read_poses(paths: Sequence[Path], options: PoseFileOptions) -> PoseRecording:
    """Read a recording of poses, files of other programs, or clusters of markers. Raises BadFile or BadInput."""
    if not any(path.suffix.lower() == MARKER_SUFFIX for path in paths):
        return open_poses(paths, options)
    if len(paths) > 1:
        raise BadInput(f"{len(paths)} files with markers among them.", "Name one C3D file alone.")
    return PoseRecording(paths[0], read_marker_poses(paths[0], options).log, {})
