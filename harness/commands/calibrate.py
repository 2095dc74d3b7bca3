"""The verb `calibrate`: find mounts and bone lengths of a performer."""

import argparse
import math
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.flags import (
    LINE_FLAGS,
    Verbs,
    add_line_flags,
    add_verb,
    output_file,
    output_folder,
    parse_names,
    positive_int,
    refuse_flags_of_others,
    repeat_flags,
    tracker_config,
)
from harness.commands.output import print_result, print_status
from harness.commands.playback_flags import DEVICE_STATIONS_HELP, default_station_count, parse_device_stations
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome, was_interrupted

if TYPE_CHECKING:
    from harness.calibrate import CalibrationOutcome, PoseDisplay

_SOURCES = ("recording", "port", "simulate", "sheet")
_SESSION_FLAGS = ("scenario", "stations", "kind", "clip", "out")
_FLAGS_BY_SOURCE = {
    "recording": _SESSION_FLAGS,
    "port": (*_SESSION_FLAGS, "rate", *LINE_FLAGS, "view", "pictures"),
    "simulate": ("miss", "noise", "seed"),
    "sheet": (),
}
"""Source -> flags that apply to it."""


def add_calibrate(verbs: Verbs) -> None:
    text = "estimate mounts and bone lengths from eight held poses, or mounts from a T-pose"
    verb = add_verb(verbs, "calibrate", text, run_calibrate, "seed", "mocap", "force")
    text = "recording of a performer who holds the poses (see `harness record`)"
    verb.add_argument("recording", nargs="?", type=Path, metavar="RECORDING", help=text)
    verb.add_argument(
        "--simulate", type=positive_int, metavar="N", help="calibrate N simulated performers and print the errors"
    )
    verb.add_argument("--sheet", type=output_folder, metavar="DIR", help="only draw the poses, as PNG files in DIR")
    text = "tracker, as for `harness live`; the poses are shown to the performer"
    verb.add_argument("--port", help=text)
    text = "scenario with the stations and their nominal mounts (see `harness list`)"
    verb.add_argument("--scenario", metavar="NAME", help=text)
    text = DEVICE_STATIONS_HELP.replace("4)", "4; a recording's own)")
    verb.add_argument("--stations", metavar="N|A,B|A=3,B=1", help=text)
    text = "poses: eight poses, for bone lengths and mounts; tpose: one, for mounts on a known body (default poses)"
    verb.add_argument("--kind", choices=["poses", "tpose"], help=text)
    verb.add_argument("--clip", help="with tpose: clip of the performer (default: the scenario's first)")
    verb.add_argument("--out", type=output_file, metavar="FILE", help="calibration file to write, in TOML")
    add_line_flags(verb)
    text = "show the poses in a window, or as PNG files in the folder --pictures"
    verb.add_argument("--view", choices=["window", "frames"], help=text)
    verb.add_argument("--pictures", type=output_folder, metavar="DIR", help="folder of --view frames")
    text = "with --simulate: standard deviation of each hinge from each pose [deg] (default 2.5)"
    verb.add_argument("--miss", type=float, metavar="DEG", help=text)
    verb.add_argument(
        "--noise", metavar="PRESET", help="with --simulate: clean, noise or default (the last is used if none is given)"
    )


def run_calibrate(args: argparse.Namespace) -> Outcome:
    given = [name for name in _SOURCES if getattr(args, name)]
    if len(given) != 1:
        problem = "No source of poses" if not given else f"{len(given)} sources: {', '.join(given)}"
        raise BadInput(f"{problem}.", "Give one: RECORDING, --port PORT, --simulate N or --sheet DIR.")
    refuse_flags_of_others(args, _FLAGS_BY_SOURCE, given[0])
    action = {"sheet": _draw_sheet, "simulate": _measure_accuracy}.get(given[0], _calibrate_performer)
    try:
        return action(args)
    except (KeyboardInterrupt, Exception) as error:
        if not was_interrupted(error):
            raise
        return print_result(args, {}, "stopped; nothing was calibrated", outcome=Outcome.INTERRUPTED)


def _draw_sheet(args: argparse.Namespace) -> Outcome:
    from harness.calibrate import POSES
    from harness.core.humanoid24 import standard_skeleton
    from harness.live import draw_poses

    paths = draw_poses(POSES, standard_skeleton(), args.sheet, force=args.force)
    poses = [{"name": pose.name, "instruction": pose.instruction} for pose in POSES]
    lines = [f"{number}  {pose.name}: {pose.instruction}" for number, pose in enumerate(POSES, 1)]
    content = {"poses": poses, "pictures": [str(path) for path in paths]}
    guide = "`harness calibrate --port PORT --scenario NAME --out FILE` guides a performer through them"
    return print_result(args, content, *lines, f"drawn in {args.sheet}; {guide}")


def _measure_accuracy(args: argparse.Namespace) -> Outcome:
    from harness.bench.calibration_accuracy import measure_calibration_accuracy
    from harness.simulate import noise_preset

    given = {"noise": args.noise, "seed": args.seed}
    if args.miss is not None:
        if not 0.0 <= args.miss <= 45.0:
            raise BadInput(f"--miss {args.miss:g}.", "Give 0 to 45 deg.")
        given["miss_rad"] = math.radians(args.miss)
    noise_preset(args.noise or "default")  # refuses an unknown preset before the calibration starts
    options = {key: value for key, value in given.items() if value is not None}
    with ProgressBar("performers") as bar:
        found = measure_calibration_accuracy(args.simulate, **options, folder=args.mocap, progress=bar)
    outcome = Outcome.PASS if not found.refused else Outcome.INCOMPLETE
    return print_result(args, found.as_dict(), *found.lines(), outcome=outcome)


def _calibrate_performer(args: argparse.Namespace) -> Outcome:
    from harness.calibrate import EXPECTED, write_calibration
    from harness.core.files import require_writable

    if args.out is None:
        raise BadInput("--out is missing.", "Name the file to write, such as --out me.toml.")
    if args.pictures is not None and args.view != "frames":
        raise BadInput("--pictures without --view frames.", "Give both, or neither.")
    require_writable(args.out, EXPECTED, force=args.force)
    found, use = _calibrate_from_device(args) if args.port else _calibrate_from_recording(args)
    write_calibration(args.out, found.file, force=args.force)
    following = [*use, *repeat_flags(args, "clip", "mocap"), "--calibration", args.out]
    content = {"file": str(args.out), **found.file.diagnostics}
    return print_result(args, content, *found.lines, "", f"{args.out}: written", following=following)


def _calibrate_from_device(args: argparse.Namespace) -> "tuple[CalibrationOutcome, list[str]]":
    """The calibration, and the command that uses it."""
    from harness.experiment import CalibrationSession, select_stations
    from harness.experiment.scenarios import load_scenario
    from harness.live import PoseTerminal, ViewerOutput
    from harness.stream import open_tracker_at

    if args.scenario is None:
        raise BadInput("--port without --scenario.", "Name the scenario with the stations: --scenario NAME.")
    scenario, asked = load_scenario(args.scenario), parse_device_stations(args.stations, args.port)
    stations = tuple(select_stations(scenario, default_station_count(scenario) if asked is None else asked))
    session = CalibrationSession(args.scenario, stations, args.kind or "poses", args.clip, args.mocap)
    with ExitStack() as opened:
        terminal = PoseTerminal(session.body.skeleton, sys.stderr)
        opened.callback(terminal.close)
        displays: list[PoseDisplay] = [terminal]
        if args.view is not None:
            view = ViewerOutput(args.view, session.body.skeleton, args.pictures, force=args.force)
            opened.callback(view.close)
            print_status(view.description)
            displays.append(view)
        config = tracker_config(args, args.port, stations)
        device = opened.enter_context(
            open_tracker_at(args.port, config, on_event=lambda event: print_status(f"line: {event.text}"))
        )
        where = f"{device.identification} at {args.port}"
        print_status(f"{where}; stations {device.station_list}; Ctrl-C ends it")
        print_status(device.setup_note)
        collector = session.collect_poses(device, print_status, displays)
    print_status("solving")
    use = ["live", "--port", args.port, *repeat_flags(args, "scenario", "stations", "rate", *LINE_FLAGS)]
    return session.solve(collector.holds, f"the tracker at {args.port}"), use


def _calibrate_from_recording(args: argparse.Namespace) -> "tuple[CalibrationOutcome, list[str]]":
    """The calibration, and the command that uses it."""
    from harness.experiment import CalibrationSession, name_recorded_stations
    from harness.stream.recording import RecordingStream

    stream = RecordingStream(args.recording)
    for lost in stream.recording.damage:
        print_status(f"lost: {lost}")
    note = stream.recording.note
    scenario, clip = args.scenario or note.get("scenario"), args.clip or note.get("clip")
    if scenario is None:
        raise BadInput(f"{args.recording} does not name its scenario.", "Name it with --scenario NAME.")
    names = None if args.stations is None else parse_names(args.stations)
    session = CalibrationSession(
        scenario, name_recorded_stations(stream, scenario, names), args.kind or "poses", clip, args.mocap
    )
    frames = iter(stream)
    collector = session.collect_poses(frames, print_status)
    if args.kind != "tpose":  # further held poses show that one was taken wrongly
        before = len(collector.rejected)
        for frame in frames:
            collector.add(frame)
        for passed in collector.rejected[before:]:
            print_status(str(passed))
    found = session.solve(collector.holds, str(args.recording))
    port = note.get("port")
    if not isinstance(port, str):
        flags = repeat_flags(args, "scenario", "stations")
        return found, ["replay", str(args.recording), *flags, "--methods", "ik,expert_map"]
    # a recording of a performer has no known motion to score: the next thing is a live session on the same line
    characters = stream.wire.characters.decode()
    worn = [f"{name}={character}" for name, character in zip(session.stations, characters, strict=True)]
    stations = session.stations if port.startswith("udp:") else worn
    return found, ["live", "--port", port, "--scenario", scenario, "--stations", ",".join(stations)]
