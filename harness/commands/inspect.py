"""The verb `inspect`: describe a motion file, a recording, poses of another program, or the coverage of emitters."""

import argparse
import sys
from pathlib import Path

from harness.commands.flags import (
    Verbs,
    add_verb,
    output_file,
    refuse_flags,
    repeat_flags,
)
from harness.commands.output import print_result
from harness.commands.pose_flags import POSE_FLAGS, add_pose_flags
from harness.core.file_kind import file_kind
from harness.core.input_file import check_input_file
from harness.core.number_format import count_noun
from harness.core.units import parse_length_unit
from harness.errors import Outcome

CONSTELLATION_SUFFIX = ".mcf"
_KINDS = "a motion file, poses, or a list of emitters"
_OF_CONSTELLATIONS = ("clip", "stations", "out", "force")
_OF_POSES = tuple(name for name in POSE_FLAGS if name not in ("rate", "unit"))


def add_inspect(verbs: Verbs) -> None:
    verb = add_verb(
        verbs,
        "inspect",
        "describe a motion file, a recording, poses of another program, or the coverage of a constellation of emitters",
        run_inspect,
        "mocap",
    )
    text = (
        "an AMC, BVH, MVNX, C3D or AMASS npz file, an MCF file of emitters, a recording, or poses of another "
        "program (TUM, EuRoC, CSV, matrices), one file or several on one clock"
    )
    verb.add_argument("file", type=Path, nargs="+", help=text)
    verb.add_argument("--rate", type=float, metavar="HZ", help="frames per second of a file that records no rate")
    text = "unit of length of a file that records none: mm, cm, m, in, ft, or metres per unit"
    verb.add_argument("--unit", metavar="M", type=parse_length_unit, help=text)
    add_pose_flags(verb, shared=("rate", "unit"))
    emitters = verb.add_argument_group("of an MCF file")
    text = "performer below the emitters: name of a clip, or a motion file; its stations are looked at"
    emitters.add_argument("--clip", metavar="CLIP", help=text)
    emitters.add_argument(
        "--stations", metavar="SET", help="set of stations that the performer wears (default liu2011)"
    )
    text = "page to write (default results/coverage/NAME.html, which is replaced)"
    emitters.add_argument("--out", type=output_file, metavar="PAGE", help=text)
    emitters.add_argument("--force", action="store_true", default=None, help="overwrite a page that --out names")


def run_inspect(args: argparse.Namespace) -> Outcome:
    paths, first = args.file, args.file[0]
    of_line = len(paths) == 1 and file_kind(first) == "a recording"
    if len(paths) > 1 or (_is_of_poses(first) and not of_line):
        from harness.commands.inspect_poses import inspect_poses

        refuse_flags(args, (*_OF_CONSTELLATIONS, "mocap"), "with poses", "It is for other files: leave it out.")
        for path in paths:
            check_input_file(path, _KINDS, sys.maxsize)
        return inspect_poses(args, paths)
    args.file = first
    if of_line:
        refuse_flags(args, (*_OF_CONSTELLATIONS, *POSE_FLAGS, "mocap"), f"with {first.name}", "It is for other files.")
        return _inspect_line(args)
    refuse_flags(args, _OF_POSES, f"with {first.name}", "It is for poses of another program.")
    if first.suffix.lower() == CONSTELLATION_SUFFIX:
        from harness.commands.inspect_constellation import inspect_constellation

        return inspect_constellation(args)
    refuse_flags(args, _OF_CONSTELLATIONS, f"with {first.name}", "It is for an MCF file of emitters.")
    from harness.mocap import folders_of_environment
    from harness.mocap import inspect_file as inspect

    library = args.mocap or folders_of_environment() or None
    found = inspect(first, rate_hz=args.rate, unit=args.unit, library=library)
    # a C3D file has markers only, and `view` takes no unit of length
    unseen = first.suffix.lower() == ".c3d" or args.unit is not None
    following = [] if unseen else ["view", first, *repeat_flags(args, "rate")]
    return print_result(args, found.as_dict(), *found.lines(), following=following)


def _is_of_poses(path: Path) -> bool:
    """Whether the name of a file is neither that of motion nor that of a constellation."""
    from harness.mocap import CLIP_FORMATS

    others = (*(f".{kind}" for kind in (*CLIP_FORMATS, "asf")), CONSTELLATION_SUFFIX)
    return path.suffix.lower() not in others


def _inspect_line(args: argparse.Namespace) -> Outcome:
    """Print what a recording of a device's line is of, and how its stations reported."""
    from harness.stream import StreamSummary
    from harness.stream.recording import RecordingStream, read_recording

    recording = read_recording(args.file)
    if not recording.formats:
        commands = count_noun(len(recording.answers), "command")
        text = f"{args.file}: a recording of {commands} and their answers, without frames"
        return print_result(args, {"answers": len(recording.answers)}, text, following=["replay", args.file])
    stream = RecordingStream(recording)
    summary = StreamSummary(stream.stations)
    for frame in stream:
        summary.add(frame)
    stretches = [str(mark["stretch"]) for mark in recording.marks if mark.get("stretch")]
    title = f"{args.file}: a recording of {stream.wire.describe()}"
    content = {"recording": title, "stretches": stretches, "lost": recording.damage, **summary.as_dict()}
    lines = [title, *([f"stretches: {', '.join(stretches)}"] if stretches else [])]
    lines += [f"lost: {lost}" for lost in recording.damage]
    following = ["characterize" if "static" in stretches else "replay", args.file]
    return print_result(args, content, *lines, "", str(summary), following=following)
