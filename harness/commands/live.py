"""The verb that turns a tracker into moving bodies, as it happens."""

import argparse
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.common import (
    Verbs,
    add_line_flags,
    add_verb,
    line_options,
    parse_stations,
    positive_float,
    print_result,
    print_status,
    show_progress,
    sigterm_as_interrupt,
)
from harness.errors import BadInput, Outcome, UnknownName, was_interrupted

if TYPE_CHECKING:
    from harness.calibrate.calibration_file import CalibrationFile
    from harness.calibrate.guided_calibration import Calibrator
    from harness.core.calibration import Calibration
    from harness.experiment.playback import Playback
    from harness.live.pose import Output
    from harness.stream.driver import Is900, LineEvent

_CALIBRATION_KINDS = ("exact", "tpose", "poses")
_WARM_UP_FRAMES = 200
_RATE_TOLERANCE = 0.02
"""How far a device may be off the rate that a method learnt at, as a share [choice]."""


def add_live(verbs: Verbs) -> None:
    text = "reconstruct from a tracker in real time: a view, VMC, LSL, BVH; Ctrl-C ends it"
    verb = add_verb(verbs, "live", text, run_live, "seed", "mocap", "endless")
    verb.add_argument(
        "--port", required=True, help="/dev/ttyUSB0, COM3, the link of an emulator's pty, tcp://HOST:PORT"
    )
    text = "names the stations and where they are worn, the body and the examples (see `harness list`)"
    verb.add_argument("--scenario", required=True, metavar="NAME", help=text)
    verb.add_argument("--method", default="dynamic_map", metavar="NAME", help="(default dynamic_map)")
    verb.add_argument("--clip", help="whose body, and what is not learnt from (default: the scenario's first)")
    text = "how many of the scenario's stations, or their names (default: the first 4)"
    verb.add_argument("--stations", metavar="N|A,B", help=text)
    text = "frames per second of the tracker, and of what is learnt (default: the scenario's)"
    verb.add_argument("--rate", type=positive_float, metavar="HZ", help=text)
    add_line_flags(verb)
    text = (
        "exact: worn as the scenario says, by whom it says; tpose: as a T-pose in the first seconds tells; poses: as "
        "eight poses tell, held first; or a file that `harness calibrate` wrote (default exact)"
    )
    verb.add_argument("--calibration", metavar="exact|tpose|poses|FILE", default="exact", help=text)
    text = "window: as it moves; frames: PNG files in the folder --out"
    verb.add_argument("--view", choices=["window", "frames"], help=text)
    verb.add_argument("--out", type=Path, metavar="DIR", help="folder of --view frames")
    verb.add_argument("--vmc", metavar="[HOST:]PORT", help="send VMC split by UDP; to this computer without HOST")
    verb.add_argument("--lsl", metavar="NAME", help="streams NAME-qpos and NAME-joints of the Lab Streaming Layer")
    verb.add_argument("--lsl-network", action="store_true", help="announce them to the network too")
    verb.add_argument("--bvh", type=Path, metavar="FILE", help="write the motion")
    verb.add_argument("--poses", type=Path, metavar="FILE", help="write a table: poses, and the times of each frame")
    verb.add_argument("--force", action="store_true", help="write over files that exist")
    verb.add_argument("--seconds", type=positive_float, metavar="S", help="end after so long")
    text = "from the last byte to the pose (default: a period of the tracker)"
    verb.add_argument("--deadline", type=positive_float, metavar="MS", help=text)


def run_live(args: argparse.Namespace) -> Outcome:
    with sigterm_as_interrupt():
        try:
            return _reconstruct_live(args)
        except (KeyboardInterrupt, Exception) as error:
            if not was_interrupted(error):
                raise
            return print_result(args, {"poses": 0}, "stopped before it began")


def _reconstruct_live(args: argparse.Namespace) -> Outcome:
    from harness.calibrate.calibration_file import read_calibration
    from harness.experiment.playback import prepare_playback
    from harness.live import summary
    from harness.live.scheduling_jitter import JitterProbe
    from harness.live.session import LiveOptions, run_session, warm_up
    from harness.reconstruct import registry

    told = {"clip": args.clip, "rate_hz": args.rate, "seed": args.seed, "folder": args.mocap}
    rehearsal = prepare_playback(args.scenario, stations=parse_stations(args), **told)
    if args.calibration not in _CALIBRATION_KINDS:
        if not Path(args.calibration).suffix:
            raise UnknownName("file or kind of calibration", args.calibration, _CALIBRATION_KINDS)
        rehearsal = rehearsal.with_calibration(read_calibration(args.calibration))
    method = registry.resolve(args.method)
    events: list[LineEvent] = []
    if args.calibration == "poses":
        rehearsal = rehearsal.with_calibration(_calibrate_by_poses(args, rehearsal, events))
    with ExitStack() as opened:
        outputs = _open_outputs(args, rehearsal, opened)
        device = opened.enter_context(_open_device(args, rehearsal, events))
        rate_hz = rehearsal.tracker.rate_hz
        print_status(
            f"learning {args.method} from {len(rehearsal.clip_evaluation.subject.example_names)} clips of {rehearsal.scenario.name}"
        )
        with redirect_stdout(sys.stderr):  # what a method prints is talk
            reconstructor = rehearsal.clip_evaluation.fit_method(method, args.method)
            warm_up(reconstructor, rehearsal.calibration, rehearsal.simulation.frames[:_WARM_UP_FRAMES])
            floor = opened.enter_context(JitterProbe())
            print_status("Ctrl-C ends it")
            plan = LiveOptions(rate_hz, args.deadline and 1e-3 * args.deadline, args.seconds)
            done = run_session(
                device,
                rehearsal.performer_calibration.body,
                reconstructor,
                _initial_calibration(args, rehearsal),
                outputs,
                plan,
                say=print_status,
            )
        beside = floor.finish()
        content = {
            "method": args.method,
            "scenario": rehearsal.scenario.name,
            "stations": list(rehearsal.scenario.stations),
            "rate_hz": rate_hz,
            **summary.as_dict(done, beside),
            "line": device.counts,
            "events": [asdict(event) for event in events],
        }
    kinds = Counter(event.kind for event in events)
    line = [f"{name} {count}" for name, count in (device.counts | kinds).items()]
    outcome = Outcome.PASS if done.poses and not done.failed else Outcome.INCOMPLETE
    return print_result(args, content, *summary.lines(done, beside), f"line: {', '.join(line)}", outcome=outcome)


@contextmanager
def _open_device(args: argparse.Namespace, rehearsal: "Playback", events: "list[LineEvent]") -> "Iterator[Is900]":
    """The tracker, set up; BadInput when it is not the one that the scenario has."""
    from harness.stream.driver import DriverConfig, Is900

    def happened(event: "LineEvent") -> None:
        events.append(event)
        print_status(f"line: {event.text}")

    tracker = rehearsal.tracker
    stations = tuple(rehearsal.scenario.stations)
    wanted = DriverConfig(**{"items": tracker.items, **line_options(args)}, stations=stations, rate_hz=args.rate)
    with Is900(args.port, wanted, on_event=happened) as device:
        runs_hz = device.wire.rate_hz
        if abs(runs_hz - tracker.rate_hz) > _RATE_TOLERANCE * tracker.rate_hz:
            raise BadInput(
                f"The device sends {runs_hz:.1f} frames per second, {rehearsal.scenario.name} has {tracker.rate_hz:g}.",
                f"Say --rate {runs_hz:.0f}: a method learns at the tracker's rate.",
            )
        worn = ", ".join(f"{number} {name}" for number, name in enumerate(stations, 1))
        print_status(f"{device.identification or 'an IS-900'} at {args.port}, {tracker.rate_hz:g} Hz; stations {worn}")
        yield device


def _open_outputs(args: argparse.Namespace, rehearsal: "Playback", opened: ExitStack) -> "list[Output]":
    """What is asked for; closed again when something after it is refused."""
    from harness.live.bvh import BvhOutput
    from harness.live.lsl import LslOutput
    from harness.live.pose_table import PoseTableOutput
    from harness.live.viewer import ViewerOutput
    from harness.live.vmc import VmcOutput

    if args.out is not None and args.view != "frames":
        raise BadInput("--out without --view frames.", "Say both, or neither.")
    if args.lsl_network and args.lsl is None:
        raise BadInput("--lsl-network without --lsl.", "Name the streams with --lsl.")
    own, rate_hz = rehearsal.performer_calibration.body.skeleton, rehearsal.tracker.rate_hz
    stations = tuple(rehearsal.scenario.stations)
    wanted: dict[str, Any] = {
        "vmc": lambda: VmcOutput(args.vmc, own),
        "lsl": lambda: LslOutput(args.lsl, own, rate_hz, network=args.lsl_network),
        "bvh": lambda: BvhOutput(args.bvh, own, rate_hz, force=args.force),
        "poses": lambda: PoseTableOutput(args.poses, own, stations, force=args.force),
        "view": lambda: ViewerOutput(args.view, own, args.out, force=args.force),
    }
    outputs: list[Output] = []
    for name, make in wanted.items():
        if getattr(args, name) is not None:
            outputs.append(make())
            opened.callback(outputs[-1].close)
            print_status(outputs[-1].description)
    return outputs


def _calibrate_by_poses(
    args: argparse.Namespace, rehearsal: "Playback", events: "list[LineEvent]"
) -> "CalibrationFile":
    """What eight poses tell, held before anything is learnt: methods learn on the bones that are found."""
    from harness.experiment.calibration_session import CalibrationSession

    posing = CalibrationSession(args.scenario, tuple(rehearsal.scenario.stations), folder=args.mocap)
    with _open_device(args, rehearsal, events) as device:
        held = posing.collect_poses(device, print_status, watch=show_progress).holds
    found = posing.solve(held, args.port)
    for line in found.lines:
        print_status(line)
    return found.file


def _initial_calibration(args: argparse.Namespace, rehearsal: "Playback") -> "Calibration | Calibrator":
    from harness.calibrate.guided_calibration import TPoseCalibrator

    if args.calibration == "tpose":
        return TPoseCalibrator(rehearsal.body, rehearsal.mounts)
    return rehearsal.calibration
