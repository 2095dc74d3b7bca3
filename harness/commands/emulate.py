"""The verb that plays a tracker."""

import argparse
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.common import (
    DEFAULT_STATION_COUNT,
    Verbs,
    add_verb,
    parse_items,
    parse_stations,
    positive_float,
    positive_int,
    print_result,
    print_status,
    sigterm_as_interrupt,
)
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.experiment.scenario import Scenario
    from harness.stream.emulator.config import EmulatorConfig


def add_emulate(verbs: Verbs) -> None:
    text = "play a scenario as an IS-900 in real time, on a pty or a TCP port; Ctrl-C ends it"
    verb = add_verb(verbs, "emulate", text, run_emulate, "seed", "mocap", "endless")
    verb.add_argument("scenario", help="a TOML file, or the name of a shipped one (see `harness list`)")
    where = verb.add_mutually_exclusive_group(required=True)
    where.add_argument("--pty", type=Path, metavar="LINK", help="pseudo terminal, reached through a link of this name")
    where.add_argument("--tcp", metavar="HOST:PORT", help="TCP port; 0 takes a free one")
    verb.add_argument("--anywhere", action="store_true", help="let a TCP port be reached from other computers")
    verb.add_argument("--clip", help="a clip to play (default: the scenario's first)")
    text = (
        "the performer holds the poses of `harness calibrate` instead, one after another, in the session of that clip"
    )
    verb.add_argument("--poses", action="store_true", help=text)
    text = f"how many of the scenario's stations, or their names (default: the first {DEFAULT_STATION_COUNT})"
    verb.add_argument("--stations", metavar="N|A,B", help=text)
    verb.add_argument("--rate", type=positive_float, metavar="HZ", help="records per second of each station")
    verb.add_argument("--noise", help="clean, noise or default, instead of the scenario's")
    verb.add_argument(
        "--items",
        type=parse_items,
        metavar="A,B",
        help="list that clients will ask for, to see whether the line carries it",
    )
    verb.add_argument("--baud", type=positive_int, help="rate of the line, which paces what is sent (default 115200)")
    verb.add_argument("--unpaced", action="store_true", help="send at once, as over Ethernet")
    verb.add_argument("--overload", action="store_true", help="play more than the line carries; records are dropped")
    text = "pty: garble everything while the client has set another rate"
    verb.add_argument("--check-baud", action="store_true", help=text)
    verb.add_argument("--firmware", metavar="VERSION", help="such as 4.1105, which has no item 40 (default 4.2301)")
    verb.add_argument("--restart", type=float, metavar="S", help="silence after a restart [s] (default 0.25)")
    verb.add_argument("--no-faults", dest="faults", action="store_false", help="leave out the scenario's faults")


def run_emulate(args: argparse.Namespace) -> Outcome:
    from harness.experiment.playback import prepare_playback
    from harness.stream.emulator.capacity import check_capacity
    from harness.stream.emulator.server import open_port, play_samples

    if args.pty and args.anywhere:
        raise BadInput("--anywhere with --pty.", "It is for --tcp: leave it out.")
    if args.tcp and args.check_baud:
        raise BadInput("--check-baud with --tcp.", "A connection has no rate, it is for --pty: leave it out.")
    rehearsal = prepare_playback(
        args.scenario,
        clip=args.clip,
        stations=parse_stations(args),
        rate_hz=args.rate,
        noise=args.noise,
        seed=args.seed,
        folder=args.mocap,
        posing=args.poses,
    )
    scenario, tracker = rehearsal.scenario, rehearsal.tracker
    config = _config(args, scenario)
    if not (args.unpaced or args.overload):
        check_capacity(len(scenario.stations), tracker.rate_hz, args.items or tracker.items, config.baud)
    samples = rehearsal.samples  # before the port, which clients take for a device that answers
    port = open_port(args.pty, args.tcp, anywhere=args.anywhere, log=print_status)
    with closing(port), sigterm_as_interrupt():
        worn = ", ".join(f"{number} {name}" for number, name in enumerate(samples.stations, 1))
        pace = f"{config.baud} baud" if config.paced else "unpaced"
        played = (
            f"the poses of {rehearsal.clip_evaluation.part}'s performer"
            if args.poses
            else rehearsal.clip_evaluation.part
        )
        print_status(f"{played} at {samples.rate_hz:g} Hz, {pace}; stations {worn}")
        print_status(f"an IS-900 at {port.name}{_access_note(args)}; Ctrl-C ends it")
        counts = play_samples(samples, config, port)
    return print_result(args, counts, *(f"{name:20} {value:.6g}" for name, value in counts.items()))


def _config(args: argparse.Namespace, scenario: "Scenario") -> "EmulatorConfig":
    from harness.stream.emulator.config import EmulatorConfig

    given = {"firmware": args.firmware, "restart_s": args.restart}
    return EmulatorConfig(
        **{name: value for name, value in given.items() if value is not None},
        baud=args.baud or scenario.tracker.baud,
        paced=not args.unpaced,
        queue_records=scenario.tracker.queue_records,
        check_baud=args.check_baud,
        faults=scenario.fault if args.faults else (),
        seed=scenario.seed,
    )


def _access_note(args: argparse.Namespace) -> str:
    if args.pty:
        return ""
    return ", reached from anywhere: nothing asks who commands it" if args.anywhere else ", from this computer alone"
