"""Flags of verbs that read poses of other programs, and the reading: text files, recordings of poses, C3D clusters."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from harness.core.units import TIME_UNITS_S, parse_length_unit
from harness.errors import BadInput

if TYPE_CHECKING:
    from harness.stream import PoseFileOptions
    from harness.stream.recording import PoseRecording

POSE_FLAGS = ("columns", "unit", "quaternion", "up", "time_unit", "rate")
"""Flags of `add_pose_flags`, as attributes of the parsed command line."""
MARKER_SUFFIX = ".c3d"


def add_pose_flags(verb: argparse.ArgumentParser, *, shared: Sequence[str] = ()) -> None:
    """Add the flags by which a user overrides what a file of poses shows; `shared` ones the verb has already."""
    poses = verb.add_argument_group("of poses of other programs (TUM, EuRoC, CSV, matrices), in place of the evidence")
    text = "names of the columns in their order, such as time,x,y,z,qx,qy,qz,qw; - for others"
    poses.add_argument("--columns", metavar="A,B", help=text)
    poses.add_argument("--quaternion", metavar="ORDER", help="order of a quaternion: xyzw or wxyz")
    poses.add_argument("--up", metavar="AXIS", help="axis that points up: x, y, z, -x, -y or -z (write --up=-y)")
    poses.add_argument("--time-unit", metavar="U", help=f"unit of times: {', '.join(TIME_UNITS_S)}")
    if "unit" not in shared:
        text = "unit of length: mm, cm, m, in, ft, or metres per unit"
        poses.add_argument("--unit", metavar="M", type=parse_length_unit, help=text)
    if "rate" not in shared:
        poses.add_argument("--rate", metavar="HZ", type=float, help="samples per second of a file without times")


def pose_options(args: argparse.Namespace, *, untimed: bool = False) -> "PoseFileOptions":
    """What the flags say; `untimed` reads files without times and rate all the same. Raises BadInput."""
    from harness.stream import PoseFileOptions

    columns = None if args.columns is None else tuple(name.strip() for name in args.columns.split(","))
    return PoseFileOptions(columns, args.unit, args.quaternion, args.up, args.time_unit, args.rate, untimed)


def holds_poses(path: Path) -> bool:
    """Whether a file may hold poses: a recording of them, rows of numbers, or markers; never motion of a skeleton."""
    from harness.mocap import CLIP_FORMATS
    from harness.stream.recording import is_pose_file

    kind = path.suffix.lower()
    if kind in (*(f".{kind}" for kind in CLIP_FORMATS), ".asf"):
        return kind == MARKER_SUFFIX and path.is_file()
    return is_pose_file(path)


def holds_line(path: Path) -> bool:
    """Whether a file is a recording of a device's line."""
    from harness.stream.recording import FILE_HEADER

    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(FILE_HEADER)) == FILE_HEADER


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
