"""The verb `live`: reconstruct motion from a tracker in real time."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.flags import (
    DEVICE_STATIONS_HELP,
    LINE_FLAGS,
    Verbs,
    add_line_flags,
    add_verb,
    is_whole_number,
    line_options,
    open_playback,
    parse_stations,
    positive_float,
    repeat_flags,
)
from harness.commands.output import print_caveat, print_result, print_status, show_progress
from harness.core.interrupts import defer_interrupts
from harness.errors import BadInput, Outcome, UnknownName, was_interrupted

if TYPE_CHECKING:
    from harness.calibrate.calibration_file import CalibrationFile
    from harness.calibrate.guided_calibration import Calibrator
    from harness.core.calibration import Calibration
    from harness.experiment.playback import Playback
    from harness.live.pose import Output
    from harness.stream.is900.driver import Tracker
    from harness.stream.line_events import EventCounter
    from harness.stream.recording.recorder import RecordingSwitch

_CALIBRATION_KINDS = ("exact", "tpose", "poses")
_WARM_UP_FRAMES = 200
_RATE_TOLERANCE = 0.02
"""Relative difference allowed between the device's rate and the rate that a method learnt at [choice]."""


def add_live(verbs: Verbs) -> None:
    text = "reconstruct from a tracker in real time, to a viewer, VMC, LSL or BVH, until Ctrl-C"
    verb = add_verb(verbs, "live", text, run_live, "seed", "mocap", "force")
    verb.add_argument(
        "--port",
        required=True,
        help="/dev/ttyUSB0, COM3, the link of an emulated pseudo terminal, tcp://HOST:PORT, udp://HOST:PORT",
    )
    text = "scenario with the stations, their mounts, the body and the examples (see `harness list`)"
    verb.add_argument("--scenario", required=True, metavar="NAME", help=text)
    text = "method that reconstructs (default expert_map)"
    verb.add_argument("--method", default="expert_map", metavar="NAME", help=text)
    text = "clip whose performer wears the tracker; it is no example (default: the scenario's first)"
    verb.add_argument("--clip", help=text)
    verb.add_argument("--stations", metavar="N|A,B|A=3,B=1", help=DEVICE_STATIONS_HELP)
    text = "frames per second of the tracker and of the examples (default: the scenario's)"
    add_line_flags(verb, text)
    text = (
        "exact: the scenario's mounts and body; tpose: mounts from a T-pose in the first seconds; poses: mounts and "
        "bone lengths from eight poses, held first; FILE: written by `harness calibrate` (default exact)"
    )
    verb.add_argument("--calibration", metavar="exact|tpose|poses|FILE", default="exact", help=text)
    text = "show the motion in a window or in the browser, or write PNG files into the folder --out"
    verb.add_argument("--view", choices=["window", "browser", "frames"], help=text)
    verb.add_argument("--no-browser", action="store_true", help="print the address of --view browser alone")
    text = "folder of --view frames, and of recordings that --view browser starts (default: this one)"
    verb.add_argument("--out", type=Path, metavar="DIR", help=text)
    text = "send the VMC protocol over UDP; without HOST, to this computer"
    verb.add_argument("--vmc", metavar="[HOST:]PORT", help=text)
    text = "open the streams NAME-qpos and NAME-joints of the Lab Streaming Layer"
    verb.add_argument("--lsl", metavar="NAME", help=text)
    verb.add_argument("--anywhere", action="store_true", help="announce the streams of --lsl to other computers too")
    verb.add_argument("--bvh", type=Path, metavar="FILE", help="write the motion to a BVH file")
    verb.add_argument("--poses", type=Path, metavar="FILE", help="write a CSV table of poses and frame times")
    verb.add_argument("--seconds", type=positive_float, metavar="S", help="stop after S seconds")
    text = "allowed latency from the last byte of a frame to its pose (default: one period of the tracker)"
    verb.add_argument("--deadline", type=positive_float, metavar="MS", help=text)


def run_live(args: argparse.Namespace) -> Outcome:
    try:
        return _reconstruct_live(args)
    except (KeyboardInterrupt, Exception) as error:
        if not was_interrupted(error):
            raise
        return print_result(args, {"poses": 0}, "stopped before the first pose", outcome=Outcome.INTERRUPTED)


def _reconstruct_live(args: argparse.Namespace) -> Outcome:
    from harness.calibrate.calibration_file import read_calibration
    from harness.experiment.methods.isolation import DEFAULT_ISOLATION
    from harness.experiment.methods.remote_method import resolve_method
    from harness.live import summary
    from harness.live.scheduling_jitter import JitterProbe
    from harness.live.session import LiveOptions, run_session, warm_up
    from harness.stream.line_events import EventCounter
    from harness.stream.recording.recorder import RecordingSwitch

    playback = open_playback(args, parse_stations(args, device=True))
    if args.calibration not in _CALIBRATION_KINDS:
        if not Path(args.calibration).suffix:
            raise UnknownName("file or kind of calibration", args.calibration, _CALIBRATION_KINDS)
        named = args.stations is not None and not is_whole_number(args.stations)
        calibration = read_calibration(args.calibration)
        print_caveat(args.calibration, calibration.caveat)
        playback = playback.with_calibration(calibration, named=named, say=print_status)
    method = resolve_method(args.method, DEFAULT_ISOLATION)
    events = EventCounter(lambda text: print_status(f"line: {text}"))
    if args.calibration == "poses":
        playback = playback.with_calibration(_calibrate_by_poses(args, playback, events))
    with ExitStack() as opened:
        recorder = RecordingSwitch()
        outputs = _open_outputs(args, playback, recorder, opened)
        device = opened.enter_context(_open_device(args, playback, events, recorder))
        rate_hz = playback.tracker.rate_hz
        examples = len(playback.clip_evaluation.subject.example_names)
        print_status(f"learning {args.method} from {examples} clips of {playback.scenario.name}")
        with redirect_stdout(sys.stderr):  # a method may print; stdout is for data
            reconstructor = playback.clip_evaluation.fit_method(method, args.method)
            warm_up(reconstructor, playback.calibration, playback.simulation.frames[:_WARM_UP_FRAMES])
            with defer_interrupts():
                floor = opened.enter_context(JitterProbe())
            print_status("Ctrl-C ends it")
            plan = LiveOptions(rate_hz, args.deadline and 1e-3 * args.deadline, args.seconds)
            done = run_session(
                device,
                playback.performer_calibration.body,
                reconstructor,
                _initial_calibration(args, playback),
                outputs,
                plan,
                say=print_status,
                progress=show_progress,
            )
        beside = floor.finish()
        content = {
            "method": args.method,
            "scenario": playback.scenario.name,
            "stations": list(playback.scenario.stations),
            "rate_hz": rate_hz,
            **summary.as_dict(done, beside),
            "line": device.counts,
            "events": [asdict(event) for event in events.events],
        }
    line = [f"{name} {count}" for name, count in (device.counts | events.counts()).items()]
    outcome = Outcome.PASS if done.poses and not done.failed else Outcome.INCOMPLETE
    if done.stopped and not done.poses and not done.failed:
        outcome = Outcome.INTERRUPTED
    lines = (*summary.lines(done, beside), f"line: {', '.join(line)}")
    stations = args.stations if "=" in (args.stations or "") else ",".join(playback.scenario.stations)
    following = ["record", args.port, "take.rec", "--stations", stations, *repeat_flags(args, "rate", *LINE_FLAGS)]
    return print_result(args, content, *lines, outcome=outcome, following=following)


@contextmanager
def _open_device(
    args: argparse.Namespace,
    playback: "Playback",
    events: "EventCounter",
    recorder: "RecordingSwitch | None" = None,
) -> "Iterator[Tracker]":
    """Open and set up the tracker; BadInput when its rate is not the scenario's."""
    from harness.stream.is900.codec.items import position_range_m
    from harness.stream.is900.driver import DriverConfig, open_tracker

    tracker = playback.tracker
    stations = tuple(playback.scenario.stations)
    options = {"items": tracker.items, **line_options(args)}
    reach_m = playback.reach_m if position_range_m(options["items"]) else None  # it takes a simulation
    config = DriverConfig(**options, stations=stations, rate_hz=args.rate, reach_m=reach_m)
    with open_tracker(args.port, config, observer=recorder, on_event=events) as device:
        runs_hz = device.wire.rate_hz
        if abs(runs_hz - tracker.rate_hz) > _RATE_TOLERANCE * tracker.rate_hz:
            raise BadInput(
                f"The device sends {runs_hz:.1f} frames per second, {playback.scenario.name} has {tracker.rate_hz:g}.",
                f"Say --rate {runs_hz:.0f}: a method learns at the tracker's rate.",
            )
        where = f"{device.identification or 'an IS-900'} at {args.port}, {tracker.rate_hz:g} Hz"
        print_status(f"{where}; stations {device.station_list}")
        print_status(device.setup_note)
        yield device


def _open_outputs(
    args: argparse.Namespace, playback: "Playback", recorder: "RecordingSwitch", opened: ExitStack
) -> "list[Output]":
    """Open the requested outputs; `opened` closes them again, also when a later one is refused."""
    from harness.live.file_outputs import BvhOutput, PoseTableOutput
    from harness.live.lsl import LslOutput
    from harness.live.viewer import ViewerOutput
    from harness.live.vmc import VmcOutput

    if args.out is not None and args.view not in ("frames", "browser"):
        raise BadInput("--out without --view frames or browser.", "Give both, or neither.")
    if args.no_browser and args.view != "browser":
        raise BadInput("--no-browser without --view browser.", "Give both, or neither.")
    if args.anywhere and args.lsl is None:
        raise BadInput("--anywhere without --lsl.", "Name the streams with --lsl.")
    skeleton, rate_hz = playback.performer_calibration.body.skeleton, playback.tracker.rate_hz
    stations = tuple(playback.scenario.stations)
    config: dict[str, Any] = {
        "vmc": lambda: VmcOutput(args.vmc, skeleton),
        "lsl": lambda: LslOutput(args.lsl, skeleton, rate_hz, network=args.anywhere),
        "bvh": lambda: BvhOutput(args.bvh, skeleton, rate_hz, force=args.force),
        "poses": lambda: PoseTableOutput(args.poses, skeleton, stations, force=args.force),
        "view": lambda: (
            _open_browser(args, playback, recorder)
            if args.view == "browser"
            else ViewerOutput(args.view, skeleton, args.out, force=args.force)
        ),
    }
    outputs: list[Output] = []
    for name, make in config.items():
        if getattr(args, name) is not None:
            with defer_interrupts():
                outputs.append(make())
                opened.callback(outputs[-1].close)
            print_status(outputs[-1].description)
    return outputs


def _open_browser(args: argparse.Namespace, playback: "Playback", recorder: "RecordingSwitch") -> "Output":
    """Show the session on a page, and open it in the browser unless --no-browser."""
    import webbrowser

    from harness.live.browser_view import BrowserOutput

    room = playback.calibration.world_from_tracker, playback.calibration.tracker_origin_m
    output = BrowserOutput(
        playback.performer_calibration.body.skeleton,
        tuple(playback.scenario.stations),
        None if args.calibration == "tpose" else room,  # found in the session's first seconds
        recorder,
        args.out or Path(),
        f"{args.method} on {args.port}",
    )
    if not args.no_browser and not webbrowser.open(output.url):
        print_status("No browser was found: open the address in one.")
    return output


def _calibrate_by_poses(args: argparse.Namespace, playback: "Playback", events: "EventCounter") -> "CalibrationFile":
    """Calibrate from eight poses before methods learn, so that they learn on the performer's bone lengths."""
    from harness.experiment.calibration_session import CalibrationSession
    from harness.live.pose_terminal import PoseTerminal

    session = CalibrationSession(args.scenario, tuple(playback.scenario.stations), folder=args.mocap)
    with _open_device(args, playback, events) as device:
        terminal = PoseTerminal(session.body.skeleton, sys.stderr)
        try:
            held = session.collect_poses(device, print_status, [terminal]).holds
        finally:
            terminal.close()
    found = session.solve(held, args.port)
    for line in found.lines:
        print_status(line)
    return found.file


def _initial_calibration(args: argparse.Namespace, playback: "Playback") -> "Calibration | Calibrator":
    from harness.calibrate.guided_calibration import TPoseCalibrator

    if args.calibration == "tpose":
        return TPoseCalibrator(playback.body, playback.mounts)
    return playback.calibration
