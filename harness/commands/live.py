"""The verb `live`: reconstruct motion from a tracker in real time."""

import argparse
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.flags import (
    LINE_FLAGS,
    Verbs,
    add_line_flags,
    add_verb,
    add_vrpn_flag,
    output_file,
    output_folder,
    positive_float,
    repeat_flags,
    tracker_config,
)
from harness.commands.output import print_caveat, print_result, print_status, show_progress
from harness.commands.playback_flags import DEVICE_STATIONS_HELP, PlaybackOptions, open_playback, parse_device_stations
from harness.core.interrupts import defer_interrupts
from harness.errors import BadInput, Outcome, UnknownName, was_interrupted

if TYPE_CHECKING:
    from harness.calibrate import CalibrationFile
    from harness.experiment import CalibrationSession, Playback
    from harness.stream import EventCounter, OpenTracker, TrackerConfig
    from harness.stream.recording import RecordingSwitch

_CALIBRATION_KINDS = ("exact", "tpose", "poses")
_WARM_UP_FRAMES = 200
_TPOSES = 5
"""Number of T-poses that may fail before calibration is given up [choice]."""
_RATE_TOLERANCE = 0.02
"""Relative difference allowed between the device's rate and the rate that a method learnt at [choice]."""


def add_live(verbs: Verbs) -> None:
    text = "reconstruct from a tracker in real time, to a viewer, VMC, LSL or BVH, until Ctrl-C"
    verb = add_verb(verbs, "live", text, run_live, "seed", "mocap", "force")
    verb.add_argument(
        "--port",
        required=True,
        help="/dev/ttyUSB0, COM3, the link of an emulated pseudo terminal, tcp://HOST:PORT, udp://HOST:PORT, "
        "fastrak:PORT, vrpn:TRACKER@HOST[:PORT]",
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
        "exact: the scenario's mounts and body; tpose: mounts from a T-pose, held first; poses: mounts and "
        "bone lengths from eight poses, held first; FILE: written by `harness calibrate` (default exact)"
    )
    verb.add_argument("--calibration", metavar="exact|tpose|poses|FILE", default="exact", help=text)
    text = "show the motion in a window or in the browser, or write PNG files into the folder --out"
    verb.add_argument("--view", choices=["window", "browser", "frames"], help=text)
    verb.add_argument("--no-browser", action="store_true", help="print the address of --view browser alone")
    text = "folder of --view frames, and of recordings and calibrations that --view browser starts (default: this one)"
    verb.add_argument("--out", type=output_folder, metavar="DIR", help=text)
    text = "send the VMC protocol over UDP; without HOST, to this computer"
    verb.add_argument("--vmc", metavar="[HOST:]PORT", help=text)
    text = "open the streams NAME-qpos and NAME-joints of the Lab Streaming Layer"
    verb.add_argument("--lsl", metavar="NAME", help=text)
    add_vrpn_flag(verb, "the stations, and of the joints as NAME-joints")
    verb.add_argument("--anywhere", action="store_true", help="open --lsl and --vrpn to other computers too")
    verb.add_argument("--bvh", type=output_file, metavar="FILE", help="write the motion to a BVH file")
    verb.add_argument("--poses", type=output_file, metavar="FILE", help="write a CSV table of poses and frame times")
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
    from harness.commands import live_summary
    from harness.core.files import require_writable
    from harness.core.package_data import VERSION
    from harness.experiment.methods import DEFAULT_ISOLATION, resolve_method
    from harness.live import (
        JitterProbe,
        LiveOptions,
        OutputOptions,
        SessionControl,
        SessionSetup,
        VrpnOutput,
        open_outputs,
        run_session,
        warm_up,
    )
    from harness.stream import EventCounter
    from harness.stream.recording import RecordingSwitch

    output_options = OutputOptions(
        vmc=args.vmc,
        lsl=args.lsl,
        vrpn=args.vrpn,
        anywhere=args.anywhere,
        bvh=args.bvh,
        poses=args.poses,
        view=args.view,
        no_browser=args.no_browser,
        out=args.out,
        force=args.force,
    )
    for path in filter(None, (args.bvh, args.poses)):  # before the performer holds poses
        require_writable(path, "motion", force=args.force)
    stations = parse_device_stations(args.stations, args.port)
    playback_options = PlaybackOptions(args.scenario, stations, args.clip, args.rate, args.seed, args.mocap)
    playback = open_playback(playback_options)
    config = _driver_config(args, playback)
    method = resolve_method(args.method, DEFAULT_ISOLATION)
    events = EventCounter(lambda text: print_status(f"line: {text}"))
    if args.calibration not in _CALIBRATION_KINDS:
        stored = _read_calibration(args.calibration)
        playback = playback.with_calibration(stored, named=isinstance(stations, list), say=print_status)
    if guided := _guided_calibrations(args, playback).get(args.calibration):
        playback = playback.with_calibration(_calibrate_performer(args.port, config, playback, events, guided))
    body, calibration = playback.performer_calibration.body, playback.calibration
    names, title = tuple(playback.scenario.stations), f"{args.method} on {args.port}"
    calibrations = _guided_calibrations(args, playback)
    setup = SessionSetup(body.skeleton, names, playback.tracker.rate_hz, title, calibrations)
    with ExitStack() as opened:
        note = {"source": "live", "port": args.port, "harness": VERSION}
        control = SessionControl(RecordingSwitch(note))
        outputs = open_outputs(output_options, setup, control, opened, print_status)
        device = opened.enter_context(_open_device(args.port, config, playback, events, control.recorder))
        device.pause()  # learning takes a while
        examples = len(playback.clip_evaluation.subject.example_names)
        print_status(f"learning {args.method} from {examples} clips of {playback.scenario.name}")
        with redirect_stdout(sys.stderr):  # a method may print; stdout is for data
            reconstructor = playback.clip_evaluation.fit_method(method, args.method)
            warm_up(reconstructor, calibration, playback.simulation.frames[:_WARM_UP_FRAMES])
            with defer_interrupts():
                probe = opened.enter_context(JitterProbe())
            print_status("Ctrl-C ends it")
            options = LiveOptions(setup.rate_hz, args.deadline and 1e-3 * args.deadline, args.seconds)
            relays = [output.relay(device) for output in outputs if isinstance(output, VrpnOutput)]
            result = run_session(
                relays[0] if relays else device,
                body,
                reconstructor,
                calibration,
                outputs,
                options,
                control=control,
                say=print_status,
                progress=show_progress,
            )
        jitter = probe.finish()
        content = {
            "method": args.method,
            "scenario": playback.scenario.name,
            "stations": list(setup.stations),
            "rate_hz": setup.rate_hz,
            **live_summary.as_dict(result, jitter),
            "line": device.counts,
            "events": [asdict(event) for event in events.events],
        }
    line = [f"{name} {count}" for name, count in (device.counts | events.counts()).items()]
    outcome = Outcome.PASS if result.poses and not result.failed else Outcome.INCOMPLETE
    if result.stopped and not result.poses and not result.failed:
        outcome = Outcome.INTERRUPTED
    lines = (*live_summary.lines(result, jitter), f"line: {', '.join(line)}")
    worn = args.stations if "=" in (args.stations or "") else ",".join(setup.stations)
    following = ["record", args.port, "take.rec", "--stations", worn, *repeat_flags(args, "rate", *LINE_FLAGS)]
    return print_result(args, content, *lines, outcome=outcome, following=following)


def _driver_config(args: argparse.Namespace, playback: "Playback") -> "TrackerConfig":
    """How the tracker is set up for the stations and the motion of a playback."""
    from harness.stream.polhemus.codec import position_range_m

    items = args.items or playback.tracker.items
    reach_m = playback.reach_m if position_range_m(items) else None  # it takes a simulation
    return tracker_config(args, args.port, playback.scenario.stations, items=items, reach_m=reach_m)


@contextmanager
def _open_device(
    port: str,
    config: "TrackerConfig",
    playback: "Playback",
    events: "EventCounter",
    recorder: "RecordingSwitch | None" = None,
) -> "Iterator[OpenTracker]":
    """Open and set up the tracker; BadInput when its rate is not the scenario's."""
    from harness.stream import open_tracker_at

    rate_hz = playback.tracker.rate_hz
    with open_tracker_at(port, config, observer=recorder, on_event=events) as device:
        runs_hz = device.rate_hz
        if abs(runs_hz - rate_hz) > _RATE_TOLERANCE * rate_hz:
            raise BadInput(
                f"The device sends {runs_hz:.1f} frames per second, {playback.scenario.name} has {rate_hz:g}.",
                f"Say --rate {runs_hz:.0f}: a method learns at the tracker's rate.",
            )
        where = f"{device.identification} at {port}, {rate_hz:g} Hz"
        print_status(f"{where}; stations {device.station_list}")
        print_status(device.setup_note)
        yield device


def _read_calibration(name: str) -> "CalibrationFile":
    """A calibration by `harness calibrate`; UnknownName for what names neither a file nor a kind."""
    from harness.calibrate import read_calibration

    if not Path(name).suffix:
        raise UnknownName("file or kind of calibration", name, _CALIBRATION_KINDS)
    calibration = read_calibration(name)
    print_caveat(name, calibration.caveat)
    return calibration


def _guided_calibrations(args: argparse.Namespace, playback: "Playback") -> "dict[str, CalibrationSession]":
    """Calibrations by held poses, by kind, of the stations of a playback; `tpose` is of its body."""
    from harness.experiment import CalibrationSession

    stations, skeleton = tuple(playback.scenario.stations), playback.performer_calibration.body.skeleton
    return {
        "tpose": CalibrationSession(args.scenario, stations, "tpose", folder=args.mocap, skeleton=skeleton),
        "poses": CalibrationSession(args.scenario, stations, folder=args.mocap),
    }


def _calibrate_performer(
    port: str, config: "TrackerConfig", playback: "Playback", events: "EventCounter", session: "CalibrationSession"
) -> "CalibrationFile":
    """Calibrate by held poses before methods learn, so that they learn on the performer's bone lengths.

    A T-pose that cannot be used is asked for again, up to `_TPOSES` times.
    """
    from harness.calibrate import UnusableHold
    from harness.live import PoseTerminal

    with _open_device(port, config, playback, events) as device:
        for left in reversed(range(_TPOSES if session.kind == "tpose" else 1)):
            terminal = PoseTerminal(session.body.skeleton, sys.stderr)
            try:
                found = session.solve(session.collect_poses(device, print_status, [terminal]).holds, port)
                break
            except UnusableHold as error:
                if not left:
                    raise
                print_status(f"{error} Trying again.")
            finally:
                terminal.close()
    for line in found.lines:
        print_status(line)
    return found.file
