"""Verbs about recordings of a device's line: make one, play one."""

import argparse
import json
import math
import sys
from collections.abc import Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

from harness import __version__
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
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.experiment.score_recording import RecordingScore
    from harness.stream.recording.replay import RecordingStream


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
        "harness": __version__,
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
    note = {"source": "port", "port": args.port, "harness": __version__}
    with RecordingWriter(args.file, note) as writer, sigterm_as_interrupt():
        record_port(args.port, wanted, writer, seconds=args.seconds, say=print_status, progress=show_progress)
    return _print_recording(args, writer.counts)


def _print_recording(args: argparse.Namespace, counts: Mapping[str, int]) -> Outcome:
    content = {"file": str(args.file), "received_bytes": counts["recv"], "sent_bytes": counts["sent"]}
    content |= {"set_up": counts["conf"], "events": counts["evnt"]}
    text = f"{args.file}: {counts['recv']} bytes received, {counts['sent']} sent, set up {counts['conf']} times"
    if not args.file.exists():
        text = f"{args.file}: ended before the device was set up; nothing is kept"
    return print_result(args, content, text + (f", {counts['evnt']} events" if counts["evnt"] else ""))


def add_replay(verbs: Verbs) -> None:
    text = "play a recording to the same decoder; with --methods, to methods, scored where its motion is known"
    verb = add_verb(verbs, "replay", text, run_replay, "seed", "mocap")
    verb.add_argument("file", type=Path, help="written by `harness record`")
    text = "step (a frame for each Enter), max (default), or so many times as fast as it was: 1, 0.5, 4"
    verb.add_argument("--speed", default="max", metavar="SPEED", help=text)
    verb.add_argument("--frames", action="store_true", help="print every station of every frame, as CSV or JSON lines")
    verb.add_argument("--methods", metavar="A,B", help="names as in scenarios, such as ik,dynamic_map")
    text = "what it was played from, where the recording does not say so itself"
    verb.add_argument("--scenario", metavar="NAME", help=text)
    verb.add_argument("--clip", metavar="CLIP", help="which of its clips (default: the first)")
    verb.add_argument("--noise", metavar="LEVEL", help="replaces the scenario's noise")
    verb.add_argument("--rate", type=float, metavar="HZ", help="replaces the scenario's rate")
    text = "what methods are told of trackers, room and body (see `harness calibrate`; default: the truth)"
    verb.add_argument("--calibration", type=Path, metavar="FILE", help=text)


def run_replay(args: argparse.Namespace) -> Outcome:
    from harness.stream.recording.replay import RecordingStream, parse_speed

    stream = RecordingStream(args.file, parse_speed(args.speed))
    for lost in stream.recording.damage:
        print(f"lost: {lost}", file=sys.stderr)
    told = (args.methods, args.scenario, args.clip, args.noise, args.rate, args.seed, args.calibration)
    if any(value is not None for value in told):
        return _score_methods(args, stream)
    return _print_frames(args, stream)


def _print_frames(args: argparse.Namespace, stream: "RecordingStream") -> Outcome:
    from harness.stream.recording.frame_table import FRAME_COLUMNS, format_csv_row, frame_rows
    from harness.stream.recording.summary import StreamSummary

    summary = StreamSummary(stream.stations)
    if args.frames and not args.json:
        print(",".join(FRAME_COLUMNS))
    for frame in stream:
        summary.add(frame)
        for row in frame_rows(frame, stream.stations, stream.wall_s(frame.received_s)) if args.frames else ():
            print(json.dumps(row) if args.json else format_csv_row(row))
        if args.frames:
            sys.stdout.flush()
    recording = stream.recording
    content = {**summary.as_dict(), **stream.counts, "lost": recording.damage, "events": recording.events}
    lines = [
        str(summary),
        "",
        _format_counts(stream),
        *(f"{e['monotonic_s']:.3f} s: {e['text']}" for e in recording.events),
    ]
    if args.frames and not args.json:  # the frames are the data
        print(*lines, sep="\n", file=sys.stderr)
        return Outcome.PASS
    return print_result(args, content, *lines)


def _format_counts(stream: "RecordingStream") -> str:
    counts = stream.counts
    return (
        f"set up {counts['sessions']} times; {counts['records']} records, {counts['garbage_bytes']} bytes that belong "
        f"to nothing; the device's clock was set anew {counts['clock_resets']} times besides"
    )


def _score_methods(args: argparse.Namespace, stream: "RecordingStream") -> Outcome:
    from harness.calibrate.calibration_file import read_calibration
    from harness.core.options import expand_alternatives, split_outside_brackets
    from harness.experiment import score_recording

    told = {"scenario": args.scenario, "clip": args.clip, "rate_hz": args.rate, "noise": args.noise, "seed": args.seed}
    rehearsal = score_recording.find_playback(stream, **told, folder=args.mocap)
    if args.calibration is not None:
        rehearsal = rehearsal.with_calibration(read_calibration(args.calibration))
    methods = rehearsal.scenario.methods
    if args.methods is not None:
        methods = tuple(
            name for text in split_outside_brackets(args.methods, ",") for name in expand_alternatives(text)
        )
    with redirect_stdout(sys.stderr):  # what a method prints is talk
        judged = score_recording.score_methods(stream, rehearsal, methods)
    played = f"{rehearsal.scenario.name}, {rehearsal.clip_evaluation.part}"
    content = {"scenario": rehearsal.scenario.name, "clip": str(rehearsal.clip_evaluation.part), **stream.counts}
    content |= {"lost": stream.recording.damage, "methods": [one.as_dict() for one in judged]}
    measured = any(one.metrics["joint_angle_mean_deg"] is not None for one in judged)
    outcome = Outcome.PASS if measured else Outcome.NOT_COMPARABLE
    return print_result(args, content, f"played from {played}", "", format_score_table(judged), outcome=outcome)


def format_score_table(scores: "Sequence[RecordingScore]") -> str:
    """Table with one row per method."""
    from harness.report.run.text import COLUMNS

    lines = [["method", "matched", *(title for title, *_ in COLUMNS)]]
    for score in scores:
        figures = [_format_number(score.metrics[name], decimals) for _, name, decimals in COLUMNS]
        lines.append([score.method, f"{score.frames_matched}/{score.frames_expected}", *figures])
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            [words[0].ljust(widths[0]), *(word.rjust(w) for word, w in zip(words[1:], widths[1:], strict=True))]
        ).rstrip()
        for words in lines
    )


def _format_number(value: float | None, decimals: int) -> str:
    return "not measured" if value is None else f"{value:.{decimals}f}"
