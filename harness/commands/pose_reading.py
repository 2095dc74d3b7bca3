"""Poses that a user names: a recording of them, files of other programs, or clusters of markers in a C3D file."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from harness.errors import BadInput

if TYPE_CHECKING:
    from harness.stream import PoseFileOptions
    from harness.stream.recording import PoseRecording

MARKER_SUFFIX = ".c3d"


def holds_poses(path: Path) -> bool:
    """Whether a file may hold poses: a recording of them, rows of numbers, or markers; never motion of a skeleton."""
    from harness.mocap import CLIP_FORMATS
    from harness.stream.recording import is_pose_file

    kind = path.suffix.lower()
    if kind in (*(f".{kind}" for kind in CLIP_FORMATS), ".asf"):
        return kind == MARKER_SUFFIX and path.is_file()
    return is_pose_file(path)


def read_poses(paths: Sequence[Path], options: "PoseFileOptions") -> "PoseRecording":
    """Read a recording of poses, files of other programs, or clusters of markers. Raises BadFile or BadInput."""
    from harness.stream import PoseFileOptions
    from harness.stream.recording import PoseRecording, open_poses

    if not any(path.suffix.lower() == MARKER_SUFFIX for path in paths):
        return open_poses(paths, options)
    if len(paths) > 1:
        raise BadInput(f"{len(paths)} files with markers among them.", "Name one C3D file alone.")
    if options != PoseFileOptions(unit_m=options.unit_m, untimed=options.untimed):
        raise BadInput(f"Options of text files for {paths[0].name}.", "A C3D file takes --unit alone.")
    from harness.study.trust.marker_poses import read_marker_poses

    return PoseRecording(paths[0], read_marker_poses(paths[0], options.unit_m), {})
