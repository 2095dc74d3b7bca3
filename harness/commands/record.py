"""The verb `record`: record a device's line, a simulated one, or poses of another program."""

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.flags import (
    LINE_FLAGS,
    Verbs,
    add_line_flags,
    add_verb,
    is_whole_number,
    line_config,
    output_link,
    parse_device_names,
    parse_names,
    refuse_flags,
    tracker_config,
)
from harness.commands.output import print_result, print_status, recording_note, show_progress
from harness.commands.playback_flags import PlaybackOptions, open_playback
from harness.commands.pose_flags import OWN_POSE_FLAGS, add_pose_flags, pose_options
from harness.core.network import VRPN_PREFIX
from harness.core.package_data import VERSION
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.stream.recording import RecordingWriter

SIMULATION_PREFIX = "sim:"
"""Prefix of a scenario's name in place of a port: the simulated line is recorded."""


def add_record(verbs: Verbs) -> None:
    text = (
        "record both directions of a device's line until Ctrl-C, appending to a recording in the same file; or keep "
        "poses of another program as a recording"
    )
    verb = add_verb(verbs, "record", text, run_record, "seed", "mocap")
    text = (
        "/dev/ttyUSB0, COM3, tcp://HOST:PORT, udp://HOST:PORT, fastrak:PORT, vrpn:TRACKER@HOST[:PORT], sim:SCENARIO "
        "for a simulated line, or files of poses (TUM, EuRoC, CSV, matrices, C3D)"
    )
    verb.add_argument("port", nargs="+", help=text)
    verb.add_argument("file", type=Path, help="the recording to write")
    text = (
        "names of the device's active stations, in order, or names with stations of the device (head=3,torso=1); "
        "with sim: names or number of the scenario's stations"
    )
    verb.add_argument("--stations", metavar="A,B|A=3,B=1", help=text)
    add_line_flags(verb)
    verb.add_argument("--seconds", type=float, metavar="N", help="stop after N seconds")
    text = (
        "send this command and print its answer, instead of setting the device up; may be repeated. ^K is a control "
        "character. If C is the last one, what it streams is recorded"
    )
    verb.add_argument("--send", action="append", metavar="CMD", help=text)
    text = "allow --send of commands that write the device's memory, restart it, or are in no source"
    verb.add_argument("--allow-writes", action="store_true", help=text)
    text = (
        "another program configures and uses the device, at a pseudo terminal under this name, while everything is "
        "recorded"
    )
    verb.add_argument("--serve", type=output_link, metavar="LINK", help=text)
    verb.add_argument("--clip", metavar="CLIP", help="with sim: clip to play (default: the scenario's first)")
    verb.add_argument("--noise", metavar="PRESET", help="with sim: clean, noise or default (default: the scenario's)")
    text = "with sim: play the calibration poses of `harness calibrate` instead of the clip"
    verb.add_argument("--poses", action="store_true", default=None, help=text)
    text = "plan of a trust study that the recording is made for: its digest is written into it"
    verb.add_argument("--plan", type=Path, metavar="PLAN.toml", help=text)
    add_pose_flags(verb, shared=("rate",))
    text = "files of poses: the stretch NAME begins at S seconds after the first pose; may be repeated"
    verb.add_argument("--mark", action="append", metavar="NAME=S", help=text)


def run_record(args: argparse.Namespace) -> Outcome:
    from harness.study.trust.pose_source import holds_poses

    paths = [Path(port) for port in args.port]
    if len(paths) > 1 or holds_poses(paths[0]):
        return _record_poses(args, paths)
    args.port = args.port[0]
    refuse_flags(args, (*OWN_POSE_FLAGS, "mark"), f"with {args.port}", "It is for files of poses: leave it out.")
    with recording_note(args.file):
        return _record(args)


def _record(args: argparse.Namespace) -> Outcome:
    if args.seconds is not None and not 0.0 < args.seconds < math.inf:
        raise BadInput(f"--seconds {args.seconds:g}.", "Give a positive number.")
    if args.port.startswith(SIMULATION_PREFIX):
        advice = "It is for a device; a simulated line takes it from the scenario."
        refuse_flags(args, (*LINE_FLAGS, "send", "serve"), f"with {args.port}", advice)
        return _record_simulation(args, args.port.removeprefix(SIMULATION_PREFIX))
    advice = f"It is for {SIMULATION_PREFIX}SCENARIO: leave it out."
    refuse_flags(args, ("clip", "noise", "poses", "seed"), f"with {args.port}", advice)
    if args.allow_writes and args.send is None:
        raise BadInput("--allow-writes without --send.", "It is for commands that --send names: leave it out.")
    if args.plan is not None and args.send is not None:
        raise BadInput("--plan with --send.", "A plan is for a recording of motion: leave one of them out.")
    return _record_line(args)


def _record_simulation(args: argparse.Namespace, scenario: str) -> Outcome:
    from harness.mocap.synthetic import stretch_marks
    from harness.stream.polhemus import add_byte_faults, unapplied_kinds
    from harness.stream.recording import RecordingWriter, record_capture

    plan = _plan_note(args)
    RecordingWriter(args.file, plan).close()  # refuses a file that cannot be written before a long simulation
    stations = args.stations
    if stations is not None:
        stations = int(stations) if is_whole_number(stations) else parse_names(stations)
    posing = bool(args.poses)
    options = PlaybackOptions(
        scenario, stations, args.clip, args.rate, args.seed, args.mocap, args.noise, posing, every_station=True
    )
    playback = open_playback(options)
    played, simulation = playback.scenario, playback.simulation
    note = {
        "source": "simulation",
        "scenario": scenario,
        "clip": str(playback.clip_evaluation.part),
        "seed": played.seed,
        "noise": played.noise,
        "stations": list(played.stations),
        "rate_hz": played.tracker.rate_hz,
        "posing": playback.posing,
        "harness": VERSION,
        **plan,
    }
    seconds = math.inf if args.seconds is None else args.seconds
    if left_out := unapplied_kinds(played.fault):
        print_status(f"faults of the scenario that need a line, and are left out: {', '.join(left_out)}")
    wire = add_byte_faults(simulation.wire, played.fault, played.seed)
    marks = () if playback.posing else stretch_marks(str(playback.clip_evaluation.part))
    written = record_capture(args.file, simulation.wire_format, wire, note, seconds=seconds, marks=marks)
    return _print_recording(args, written)


def _record_poses(args: argparse.Namespace, paths: Sequence[Path]) -> Outcome:
    """Keep poses of another program in the recording format, whole or not at all."""
    from harness.stream.recording import write_pose_recording
    from harness.study.trust.pose_source import read_poses

    lines = (*LINE_FLAGS, "seconds", "send", "allow_writes", "serve", "clip", "noise", "poses", "seed")
    refuse_flags(args, lines, "with a file of poses", "It is for a line: leave it out.")
    found = read_poses(paths, pose_options(args))
    log = found.log if args.stations is None else found.log.select(parse_names(args.stations))
    marks = found.marks if args.mark is None else _parse_marks(args.mark, log.duration_s)
    note = {**found.note, "source": "poses", "file": log.source, "harness": VERSION, **_plan_note(args)}
    write_pose_recording(args.file, log, note, marks)
    poses = sum(len(body.times_s) for body in log.bodies)
    content = {"file": str(args.file), "poses": poses, "bodies": log.names, "marks": len(marks)}
    content |= {"findings": [str(finding) for finding in log.findings]}
    text = f"{args.file}: {poses:,} poses of {', '.join(log.names)} in {log.duration_s:.2f} s"
    return print_result(args, content, *map(str, log.findings), text, following=["inspect", args.file])


def _parse_marks(texts: Sequence[str], duration_s: float) -> list[tuple[float, str]]:
    """The times [s] and names of `--mark NAME=S`, in the order of time. Raises BadInput."""
    marks = []
    for text in texts:
        name, equals, at = text.rpartition("=")
        try:
            at_s = float(at) if equals else math.nan
        except ValueError:
            at_s = math.nan
        if not 0.0 <= at_s <= duration_s:
            raise BadInput(f"--mark {text!r}.", f"Write NAME=S with S from 0 to {duration_s:.2f}, as static=0.")
        marks.append((at_s, name.strip()))
    return sorted(marks)


def _plan_note(args: argparse.Namespace) -> dict[str, str]:
    """The entry of a recording's note that names the plan it was made for; none without a plan."""
    if args.plan is None:
        return {}
    from harness.stream.recording import PLAN_FILE
    from harness.study.trust.plan import plan_digest

    return {PLAN_FILE: plan_digest(args.plan)}


def _record_line(args: argparse.Namespace) -> Outcome:
    """Record a device that is set up here, that another program uses, or that is sent commands."""
    from harness.stream.recording import (
        RecordingWriter,
        check_commands,
        format_exchanges,
        open_writer,
        record_commands,
        record_port,
        serve_line,
    )

    settings = [name for name in LINE_FLAGS if name != "baud"]
    if args.serve is not None:
        advice = "The other program configures the device: leave it out."
        refuse_flags(args, ("send", *settings), "with --serve", advice)
    if args.send is not None:
        advice = "--send sets nothing but what it names: leave it out."
        refuse_flags(args, ("stations", *settings), "with --send", advice)
    if args.port.startswith(("udp:", VRPN_PREFIX)):
        advice = f"{'UDP' if args.port.startswith('udp:') else 'VRPN'} carries no commands: name the serial line."
        refuse_flags(args, ("serve", "send"), f"with {args.port}", advice)
    if args.send is not None:
        check_commands(args.send, args.allow_writes)
    stations = None if args.stations is None else parse_device_names(args.stations, args.port)
    source = "served" if args.serve is not None else "port" if args.send is None else "commands"
    note = {"source": source, "port": args.port, "harness": VERSION, **_plan_note(args)}
    options: dict[str, Any] = {"seconds": args.seconds, "log": print_status, "progress": show_progress}
    if args.serve is None and args.send is None:
        tracker = tracker_config(args, args.port, stations)
        with open_writer(args.file, note, tracker) as writer:
            line = record_port(args.port, tracker, writer, **options)
        show = _print_poses if args.port.startswith(VRPN_PREFIX) else _print_recording
        return show(args, writer, line)
    config = line_config(args, args.port, stations)
    with RecordingWriter(args.file, note) as writer:
        if args.send is not None:
            exchanges = record_commands(args.port, args.send, config, writer, **options)
            more: Mapping[str, Any] = {"exchanges": exchanges}
            lines = format_exchanges(exchanges)
        else:
            counts = serve_line(args.port, args.serve, config, writer, **options)
            unread, lost = counts["unread"], counts["undelivered"]
            more, lines = counts, [f"{unread} bytes were not read by a program"] if unread else []
            lines += [f"{lost} bytes of a program found no device"] if lost else []
    return _print_recording(args, writer, more=more, lines=lines)


def _print_poses(args: argparse.Namespace, writer: "RecordingWriter", line: Mapping[str, int]) -> Outcome:
    """Print what was recorded of a tracker that reports poses; `line` are the counts of its client."""
    poses, outcome = writer.counts["pose"], Outcome.PASS
    line = {**line, "left_out": writer.counts["left_out"]}
    content = {"file": str(args.file), "poses": poses, "events": writer.counts["evnt"], **line}
    text = f"{args.file}: {poses:,} poses"
    if writer.empty:
        text = f"{args.file}: stopped before a pose was recorded into it"
        outcome = Outcome.INTERRUPTED if line.get("interrupted") else Outcome.NOT_COMPARABLE
    counted = {"reconnects": "reconnects", "copies": "redundant reports", "clock_resets": "resets of its clock"}
    counted["lost"] = "messages lost by UDP"
    counted["left_out"] = "poses left out that were not later than the one before"
    text += "".join(f", {line[name]} {words}" for name, words in counted.items() if line.get(name))
    following = ["inspect", args.file] if args.file.exists() else []
    return print_result(args, content, text, outcome=outcome, following=following)


def _print_recording(
    args: argparse.Namespace,
    writer: "RecordingWriter",
    line: Mapping[str, int] | None = None,
    *,
    more: Mapping[str, Any] | None = None,
    lines: Sequence[str] = (),
) -> Outcome:
    """Print what was recorded; `line` are the counts of the driver, where it set the device up."""
    counts, out_of_range = writer.counts, (line or {}).get("out_of_range", 0)
    content = {"file": str(args.file), "received_bytes": counts["recv"], "sent_bytes": counts["sent"]}
    content |= {"set_up": counts["conf"], "events": counts["evnt"], "out_of_range": out_of_range}
    text = f"{args.file}: {counts['recv']} bytes received, {counts['sent']} sent, set up {counts['conf']} times"
    outcome = Outcome.PASS
    if writer.empty:
        text, outcome = f"{args.file}: stopped before anything was recorded into it", Outcome.INTERRUPTED
    elif line is not None and not line.get("records"):
        text += ", not a single record of a station"
        outcome = Outcome.INTERRUPTED if line.get("interrupted") else Outcome.NOT_COMPARABLE
    text += f", {counts['evnt']} events" if counts["evnt"] else ""
    text += f", {out_of_range} positions beyond the range of the list" if out_of_range else ""
    following = ["replay", args.file] if args.file.exists() else []
    return print_result(args, {**content, **(more or {})}, *lines, text, outcome=outcome, following=following)
