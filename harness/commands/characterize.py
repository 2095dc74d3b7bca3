"""The verb `characterize`: measure the errors, clock and line of a device without a reference."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.flags import (
    LINE_FLAGS,
    Verbs,
    add_line_flags,
    add_verb,
    parse_device_names,
    parse_pair,
    positive_float,
    refuse_flags,
    tracker_config,
)
from harness.commands.output import print_result, print_status, recording_note, show_progress, this_command
from harness.commands.pose_flags import OWN_POSE_FLAGS, add_pose_flags, pose_options
from harness.commands.unit_results import UnitOptions, add_unit_flags, departure_content, read_expected, write_unit
from harness.core.network import FASTRAK_PREFIX, VRPN_PREFIX
from harness.core.package_data import VERSION
from harness.core.progress import ProgressBar
from harness.errors import BadFile, BadInput, Outcome

if TYPE_CHECKING:
    from harness.measure import Bar
    from harness.stream.recording import Stretch

_DEFAULT_STATIC_MIN, _SWEEP_S, _COVERED_S = 17.0, 30.0, 20.0
"""Minutes at rest, in which six stations show a rate of one event a minute to 20 %; seconds of the other stretches."""
_PORT_ALONE = ("stations", "minutes", "yes", *LINE_FLAGS)
_PORT_FLAGS = (*_PORT_ALONE, "rate")


def add_characterize(verbs: Verbs) -> None:
    text = "measure the errors, clock and line of a device at rest, and write them as a unit file for scenarios"
    verb = add_verb(verbs, "characterize", text, run_characterize)
    verb.add_argument("source", help="a recording, a file of poses, or a port: a guided capture is then made")
    add_unit_flags(verb, "unit file to write; the page is written beside it")
    text = "two stations on one bar: they show errors in motion without a reference"
    verb.add_argument("--rigid", metavar="A,B", help=text)
    text = "--rigid: length of the bar from one station's origin to the other's, and its standard uncertainty"
    verb.add_argument("--length", type=parse_pair, metavar="MM,MM", help=text)
    text = "points, x y z [m] a line, on which one station rests in this order"
    verb.add_argument("--surveyed", type=Path, metavar="FILE", help=text)
    text = "--surveyed: standard uncertainty of a coordinate of the points"
    verb.add_argument("--surveyed-noise", type=positive_float, metavar="MM", help=text)
    text = f"port: minutes at rest (default {_DEFAULT_STATIC_MIN:g})"
    verb.add_argument("--minutes", type=positive_float, metavar="M", help=text)
    verb.add_argument("--yes", action="store_true", default=None, help="port: do not wait for Enter between stretches")
    verb.add_argument("--stations", metavar="A,B|A=3,B=1", help="port: names of the stations, as for `harness record`")
    add_line_flags(verb, "port, or poses without times: frames per second")
    add_pose_flags(verb, shared=("rate",))


def run_characterize(args: argparse.Namespace) -> Outcome:
    from harness.measure import compare_with_survey
    from harness.report.kit import render_text
    from harness.report.lab.unit_page import unit_page
    from harness.stream import PoseFileOptions
    from harness.stream.recording import CaptureReader
    from harness.study.trust.characterization import characterize_capture, characterize_log
    from harness.study.trust.pose_source import holds_poses, read_poses
    from harness.study.trust.survey_file import read_surveyed_points

    options = UnitOptions(args.out, args.expect, args.force)
    expected, bar = read_expected(options), _parse_bar(args.rigid, args.length)
    points_m = read_surveyed_points(args.surveyed) if args.surveyed else None
    deviation_m = 1e-3 * (args.surveyed_noise or 0.0)
    if deviation_m and points_m is None:
        raise BadInput("--surveyed-noise without --surveyed.", "Name the file of the points.")
    is_log = not _is_port(args.source) and holds_poses(Path(args.source))
    if is_log:
        refuse_flags(args, _PORT_ALONE, f"with the poses {args.source}", "It is for a port: leave it out.")
    source = Path(args.source) if is_log else _capture_of(args)
    with ProgressBar("parts") as progress:
        if holds_poses(source):  # of VRPN, the capture holds poses
            poses = read_poses([source], pose_options(args) if is_log else PoseFileOptions())
            found = characterize_log(poses, expected=expected, bar=bar, progress=progress)
        else:
            found = characterize_capture(CaptureReader(source), expected=expected, bar=bar, progress=progress)
    if points_m is not None:
        found = replace(found, survey=compare_with_survey(found.profile.places, points_m, deviation_m))
    page = unit_page(found.report, this_command(), options.out.name if options.out else "")
    lines, written = write_unit(options, found.unit, page)
    content = {
        "unit": found.unit.name,
        "parameters": {key: number.as_dict() for key, number in found.profile.parameters.items()},
        "timing": {key: number.as_dict() for key, number in found.profile.timing.all_stations.items()},
        "departures": departure_content(found.named, "p", "p_holm"),
        "budget": pair.budget.as_dict() if (pair := found.profile.rigid) else None,
        "survey": found.survey.budget.as_dict() if found.survey else None,
        "damage": list(found.profile.damage),
        "notes": list(found.profile.limits),
        **written,
    }
    return print_result(args, content, render_text(page), *lines)


def _parse_bar(text: str | None, length_mm: tuple[float, float] | None) -> "Bar | None":
    from harness.measure import Bar

    if text is None:
        if length_mm is not None:
            raise BadInput("--length without --rigid.", "Name the two stations on the bar: --rigid A,B.")
        return None
    names = [name.strip() for name in text.split(",")]
    if len(names) != 2 or not all(names):
        raise BadInput(f"--rigid {text!r}.", "Name the two stations on the bar: --rigid left_hand,right_hand.")
    stated_m = None if length_mm is None else (1e-3 * length_mm[0], 1e-3 * length_mm[1])
    return Bar((names[0], names[1]), stated_m)


def _is_port(source: str) -> bool:
    """Whether a source is the name of a port: an address, a device of the system, or COM3."""
    path = Path(source)
    named = "://" in source or source.startswith((FASTRAK_PREFIX, VRPN_PREFIX))
    return named or path.is_char_device() or (source.upper().startswith("COM") and source[3:].isdecimal())


def _capture_of(args: argparse.Namespace) -> Path:
    """The recording to measure; of a port it is made first."""
    refuse_flags(args, OWN_POSE_FLAGS, f"with {args.source}", "It is for poses of another program: leave it out.")
    if not _is_port(args.source):
        refuse_flags(args, _PORT_FLAGS, f"with the recording {args.source}", "It is for a port: leave it out.")
        return Path(args.source)
    if args.out is None:
        raise BadInput("A port without --out.", "Name the unit file: --out unit.toml.")
    return _record_stretches(args)


def _record_stretches(args: argparse.Namespace) -> Path:
    """Record the stretches of a device, or the rest of them; the recording's path."""
    from harness.measure import events_for_precision
    from harness.stream.recording import capture_stretches, finished_stretches

    path: Path = args.out.with_suffix(".rec")
    minutes = args.minutes or _DEFAULT_STATIC_MIN
    print_status(
        f"A rate known to 20 % takes {events_for_precision(0.2)} events: 17 minutes at rest of six stations with one "
        f"event a minute each. This capture rests for {minutes:g} minutes. Stop with Ctrl-C; the same command goes on."
    )
    stations = None if args.stations is None else parse_device_names(args.stations, args.source)
    config = tracker_config(args, args.source, stations)
    with recording_note(path, ", and the same command resumes."):
        capture_stretches(
            args.source,
            config,
            path,
            _stretches(60.0 * minutes),
            {"source": "port", "port": args.source, "purpose": "characterize", "harness": VERSION},
            ready=(lambda: True) if args.yes or not sys.stdin.isatty() else _wait_for_enter,
            log=print_status,
            progress=show_progress,
        )
    if "static" not in finished_stretches(path):
        raise BadFile(path, "no finished static stretch", "a capture", "Give the same command to go on with it.")
    return path


def _stretches(static_s: float) -> "tuple[Stretch, ...]":
    from harness.stream.recording import Stretch

    return (
        Stretch("static", static_s, "let all stations lie still, in sight of the emitters", True),
        Stretch("slow", _SWEEP_S, "sweep the stations slowly through the room, about all axes", False),
        Stretch("fast", _SWEEP_S, "sweep them fast, about all axes", False),
        Stretch("covered", _COVERED_S, "lay them down and cover them with a hand, one after another", True),
    )


def _wait_for_enter() -> bool:
    print_status("Press Enter when ready.")
    return bool(sys.stdin.readline())
