"""The verb `record`: record a device's line, or a simulated one."""

import argparse
import math
from collections.abc import Mapping
from pathlib import Path

from harness.commands.common import (
    Verbs,
    add_line_flags,
    add_verb,
    is_whole_number,
    line_options,
    parse_names,
    positive_float,
    print_result,
    print_status,
    show_progress,
    sigterm_as_interrupt,
)
from harness.core.package_data import VERSION
from harness.errors import BadInput, Outcome

SIMULATION_PREFIX = "sim:"
"""What a scenario's name follows where the simulator takes the place of a port."""


def add_record(verbs: Verbs) -> None:
    text = "record a device's line, both ways, until Ctrl-C; goes on behind an earlier recording in the same file"
    verb = add_verb(verbs, "record", text, run_record, "seed", "mocap", "endless")
    verb.add_argument(
        "port", help="/dev/ttyUSB0, COM3, tcp://HOST:PORT, or sim:SCENARIO for what a simulated line carries"
    )
    verb.add_argument("file", type=Path, help="the recording to write")
    text = "names of the device's active stations, the first first; of sim: those stations, or the first so many"
    verb.add_argument("--stations", metavar="A,B", help=text)
    text = "frames per second, where the device does not tell"
    verb.add_argument("--rate", type=positive_float, metavar="HZ", help=text)
    add_line_flags(verb)
    verb.add_argument("--seconds", type=float, metavar="N", help="stop by itself after so long")
    verb.add_argument("--clip", metavar="CLIP", help="of sim: which of its clips (default: the first)")
    verb.add_argument("--noise", metavar="LEVEL", help="of sim: replaces the scenario's noise")
    text = "of sim: the performer holds the poses of `harness calibrate`, in the session of that clip"
    verb.add_argument("--poses", action="store_true", default=None, help=text)


def run_record(args: argparse.Namespace) -> Outcome:
    if args.seconds is not None and not 0.0 < args.seconds < math.inf:
        raise BadInput(f"--seconds {args.seconds:g}.", "It is a positive number.")
    if args.port.startswith(SIMULATION_PREFIX):
        for name in ("items", "baud", "quality"):
            if getattr(args, name) is not None:
                raise BadInput(
                    f"--{name} with {args.port}.", "It is for a device; the scenario says what is simulated."
                )
        return _record_simulation(args, args.port.removeprefix(SIMULATION_PREFIX))
    for name in ("clip", "noise", "poses", "seed"):
        if getattr(args, name) is not None:
            raise BadInput(
                f"--{name} with {args.port}.", f"It is for {SIMULATION_PREFIX}SCENARIO; a device does what it does."
            )
    return _record_port(args)


def _record_simulation(args: argparse.Namespace, scenario: str) -> Outcome:
    from harness.experiment.playback import prepare_playback
    from harness.stream.recording.recording import RecordingWriter, record_capture

    RecordingWriter(args.file).close()  # refuses what is no place to record into before a long simulation
    stations = args.stations
    if stations is not None:
        stations = int(stations) if is_whole_number(stations) else parse_names(stations)
    rehearsal = prepare_playback(
        scenario,
        clip=args.clip,
        stations=stations,
        rate_hz=args.rate,
        noise=args.noise,
        seed=args.seed,
        folder=args.mocap,
        posing=bool(args.poses),
    )
    asked, simulation = rehearsal.scenario, rehearsal.simulation
    note = {
        "source": "simulation",
        "scenario": scenario,
        "clip": str(rehearsal.clip_evaluation.part),
        "seed": asked.seed,
        "noise": asked.noise,
        "stations": list(asked.stations),
        "rate_hz": asked.tracker.rate_hz,
        "posing": rehearsal.posing,
        "harness": VERSION,
    }
    seconds = math.inf if args.seconds is None else args.seconds
    written = record_capture(args.file, simulation.wire_format, simulation.wire, note, seconds=seconds)
    return _print_recording(args, written.counts)


def _record_port(args: argparse.Namespace) -> Outcome:
    from harness.stream.driver import DriverConfig
    from harness.stream.recording.recorder import record_port
    from harness.stream.recording.recording import RecordingWriter

    stations = None if args.stations is None else tuple(parse_names(args.stations))
    wanted = DriverConfig(stations=stations, rate_hz=args.rate, **line_options(args))
    note = {"source": "port", "port": args.port, "harness": VERSION}
    with RecordingWriter(args.file, note) as writer, sigterm_as_interrupt():
        record_port(args.port, wanted, writer, seconds=args.seconds, log=print_status, progress=show_progress)
    return _print_recording(args, writer.counts)


def _print_recording(args: argparse.Namespace, counts: Mapping[str, int]) -> Outcome:
    content = {"file": str(args.file), "received_bytes": counts["recv"], "sent_bytes": counts["sent"]}
    content |= {"set_up": counts["conf"], "events": counts["evnt"]}
    text = f"{args.file}: {counts['recv']} bytes received, {counts['sent']} sent, set up {counts['conf']} times"
    if not args.file.exists():
        text = f"{args.file}: ended before the device was set up; nothing is kept"
    return print_result(args, content, text + (f", {counts['evnt']} events" if counts["evnt"] else ""))
