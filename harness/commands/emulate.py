"""The verb `emulate`: play a scenario as an IS-900 or a FASTRAK."""

import argparse
import shlex
from collections.abc import Sequence
from contextlib import ExitStack, closing, suppress
from typing import TYPE_CHECKING

from harness.commands.flags import (
    Verbs,
    add_verb,
    add_vrpn_flag,
    output_link,
    parse_characters,
    parse_items,
    positive_float,
    positive_int,
    refuse_flags,
    repeat_flags,
)
from harness.commands.output import print_result, print_status
from harness.commands.playback_flags import (
    DEFAULT_STATION_COUNT,
    PlaybackOptions,
    default_station_count,
    open_playback,
    parse_device_stations,
)
from harness.core.interrupts import defer_interrupts
from harness.core.network import FASTRAK_PREFIX, LOOPBACK
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.experiment.scenarios import Scenario
    from harness.stream import TrackerConfig
    from harness.stream.polhemus import EmulatorConfig
    from harness.stream.polhemus.codec import DeviceSamples


def add_emulate(verbs: Verbs) -> None:
    text = "play a scenario as a tracker in real time, at a pseudo terminal, a TCP port or a VRPN server, until Ctrl-C"
    verb = add_verb(verbs, "emulate", text, run_emulate, "seed", "mocap")
    verb.add_argument("scenario", help="a TOML file, or the name of a shipped one (see `harness list`)")
    text = "device to be: is900 (default), or fastrak with 1 to 4 stations, which share 120 records per second"
    verb.add_argument("--device", choices=["is900", "fastrak"], default="is900", help=text)
    where = verb.add_mutually_exclusive_group(required=True)
    text = "open a pseudo terminal, and link to it under this name"
    where.add_argument("--pty", type=output_link, metavar="LINK", help=text)
    where.add_argument("--tcp", metavar="HOST:PORT", help="listen at a TCP port; port 0 takes a free one")
    add_vrpn_flag(where, "the stations of the emulated device, which the harness itself then uses")
    text = "also broadcast UDP packets from the start, as after MEthUdp1; without HOST, to this computer"
    verb.add_argument("--udp", metavar="[HOST:]PORT", help=text)
    text = "accept connections from other computers, or broadcast to them"
    verb.add_argument("--anywhere", action="store_true", help=text)
    verb.add_argument("--clip", help="clip to play (default: the scenario's first)")
    text = "play the calibration poses of `harness calibrate`, held one after another, instead of the clip"
    verb.add_argument("--poses", action="store_true", help=text)
    text = (
        "number of the scenario's stations, or their names, or names with stations of the device: head=3,torso=1 "
        f"(default: the first {DEFAULT_STATION_COUNT})"
    )
    verb.add_argument("--stations", metavar="N|A,B|A=3,B=1", help=text)
    text = "records per second of each station (default: the scenario's)"
    verb.add_argument("--rate", type=positive_float, metavar="HZ", help=text)
    verb.add_argument("--noise", metavar="PRESET", help="clean, noise or default (default: the scenario's)")
    verb.add_argument(
        "--items",
        type=parse_items,
        metavar="A,B",
        help="output list that clients will request, to check that the line and its range carry the motion",
    )
    text = "bits per second of the line, which pace the data (default 115200)"
    verb.add_argument("--baud", type=positive_int, help=text)
    verb.add_argument("--unpaced", action="store_true", help="send without pacing, as over Ethernet")
    text = "pty: garble the data while the client has set another rate"
    verb.add_argument("--check-baud", action="store_true", help=text)
    verb.add_argument("--firmware", metavar="VERSION", help="firmware version (default 4.2301; 4.1105 has no item 40)")
    text = "length of item 16 (default 1, as in the manuals; InterSense's library and VRPN expect 2)"
    verb.add_argument("--stylus-bytes", type=int, choices=[1, 2], help=text)


def run_emulate(args: argparse.Namespace) -> Outcome:
    from harness.stream import open_emulator
    from harness.stream.polhemus import open_port, parse_udp_address, play_emulator
    from harness.stream.polhemus.codec import check_emulated_capacity, check_range, missing_items

    if args.pty and args.anywhere and not args.udp:
        raise BadInput("--anywhere with --pty.", "--anywhere is for --tcp and --udp: leave it out.")
    udp = None if args.udp is None else parse_udp_address(args.udp, args.anywhere)
    if args.check_baud and not args.pty:
        advice = "Only a pseudo terminal has a baud rate; --check-baud is for --pty."
        raise BadInput(f"--check-baud with {'--tcp' if args.tcp else '--vrpn'}.", advice)
    if args.vrpn and args.udp:
        raise BadInput("--udp with --vrpn.", "Give --tcp or --pty for a device that also broadcasts.")
    stations = parse_device_stations(args.stations)
    if args.device == "fastrak":
        _prepare_fastrak(args, stations)
    options = PlaybackOptions(
        args.scenario, stations, args.clip, args.rate, args.seed, args.mocap, args.noise, args.poses
    )
    playback = open_playback(options)
    scenario, tracker = playback.scenario, playback.tracker
    config = _config(args, scenario, udp[1] if udp else None)
    samples = playback.samples  # before the port opens: clients expect an open port to answer
    emulator = open_emulator(samples, config)
    items = args.items or config.usual_items or tracker.items
    check_range(args.items or (), playback.reach_m)
    if not (args.unpaced or tracker.overload):
        check_emulated_capacity(len(scenario.stations), tracker.rate_hz, items, config.baud, playback.reach_m)
    if args.vrpn:
        return _serve_vrpn(args, samples, config, items)
    with ExitStack() as opened:
        with defer_interrupts():
            port = open_port(args.pty, args.tcp, anywhere=args.anywhere, log=print_status)
            opened.enter_context(closing(port))
        characters = config.station_characters(len(samples.stations))
        names = ", ".join(f"{c} {name}" for c, name in zip(characters, samples.stations, strict=True))
        pace = f"{config.baud} baud" if config.paced else "unpaced"
        played = (
            f"the poses of {playback.clip_evaluation.part}'s performer" if args.poses else playback.clip_evaluation.part
        )
        print_status(f"{played} at {samples.rate_hz:g} Hz, {pace}; stations {names}")
        device = "a FASTRAK" if args.device == "fastrak" else "an IS-900"
        print_status(f"{device} at {port.name}{_access_note(args)}; Ctrl-C ends it")
        quality = not missing_items(items, float(config.firmware[:4]))
        print_status(f"next, in another terminal: {shlex.join(_following(args, port.name, quality=quality))}")
        if udp:
            print_status(f"broadcasts to udp://{udp[0]}:{udp[1]}")
        counts = play_emulator(emulator, port, udp[0] if udp else LOOPBACK)
    return print_result(args, counts, *(f"{name:20} {value:.6g}" for name, value in counts.items()))


def _serve_vrpn(
    args: argparse.Namespace, samples: "DeviceSamples", config: "EmulatorConfig", items: tuple[int, ...]
) -> Outcome:
    """Use the emulated device as its driver does, and serve what it reports."""
    from harness.stream import EventCounter, open_tracker_at, serve_emulator
    from harness.stream.fastrak import FastrakConfig, FastrakEmulatorConfig
    from harness.stream.is900 import DriverConfig
    from harness.stream.vrpn import RelayedStream, describe_sensors, open_server

    with ExitStack() as opened:
        with defer_interrupts():
            server = opened.enter_context(open_server(args.vrpn, anywhere=args.anywhere, log=print_status))
        device = opened.enter_context(serve_emulator(samples, config, tcp=f"{LOOPBACK}:0"))
        characters = config.station_characters(len(samples.stations))
        if isinstance(config, FastrakEmulatorConfig):
            driver: TrackerConfig = FastrakConfig(items=items, stations=samples.stations, characters=characters)
        else:
            driver = DriverConfig(items=items, stations=samples.stations, characters=characters)
        events = EventCounter(lambda text: print_status(f"line: {text}"))
        tracker = opened.enter_context(open_tracker_at(device.name, driver, on_event=events))
        sensors = describe_sensors(tracker.stations)
        print_status(f"VRPN: {server.names[0]} with the sensors {sensors} at {tracker.rate_hz:g} Hz; Ctrl-C ends it")
        following = ["harness", "record", f"vrpn:{server.names[0]}", "take.rec"]
        print_status(f"next, in another terminal: {shlex.join(following)}")
        with suppress(KeyboardInterrupt):
            for _ in RelayedStream(tracker, server, server.trackers[0], tracker.measured_unix_s):
                pass
        counts = {**tracker.counts, "reports": server.sent, "clients": server.clients}
    return print_result(args, counts, *(f"{name:20} {value:.6g}" for name, value in counts.items()))


def _following(args: argparse.Namespace, port: str, *, quality: bool) -> list[str]:
    """The command that uses the emulated device: a calibration for its poses, else a live session.

    `quality`: records can report it, which needs an item that older firmware does not have.
    """
    verb, use = (["calibrate"], ["--out", "me.toml"]) if args.poses else (["live"], ["--view", "browser"])
    flags = repeat_flags(args, "stations", "clip", "rate", "items", "mocap", *([] if args.poses else ["seed"]))
    flags += [] if quality else ["--quality", "mp"]
    prefix = FASTRAK_PREFIX if args.device == "fastrak" else ""
    return ["harness", *verb, "--port", f"{prefix}{args.pty or port}", "--scenario", args.scenario, *flags, *use]


def _prepare_fastrak(args: argparse.Namespace, stations: int | Sequence[str] | None) -> None:
    """Give a FASTRAK the rate that its number of stations leaves. BadInput for flags that are an IS-900's."""
    from harness.experiment.scenarios import load_scenario
    from harness.stream.polhemus.codec import MOST_DEVICE_HZ

    advice = "It is for an IS-900: leave it out."
    refuse_flags(args, ("udp", "firmware", "stylus_bytes"), "with --device fastrak", advice)
    count = stations if isinstance(stations, int) else len(stations or ())
    count = count or default_station_count(load_scenario(args.scenario))
    args.rate = args.rate or MOST_DEVICE_HZ["fastrak"] / count


def _config(args: argparse.Namespace, scenario: "Scenario", udp_port: int | None) -> "EmulatorConfig":
    from harness.stream.fastrak import FastrakEmulatorConfig
    from harness.stream.polhemus import EmulatorConfig

    options = {"firmware": args.firmware, "stylus_bytes": args.stylus_bytes, "udp_port": udp_port}
    options |= {"characters": parse_characters(args.stations)}
    return (FastrakEmulatorConfig if args.device == "fastrak" else EmulatorConfig)(
        **{name: value for name, value in options.items() if value is not None},
        baud=args.baud or scenario.tracker.baud,
        paced=not args.unpaced,
        udp=udp_port is not None,
        queue_records=scenario.tracker.queue_records,
        check_baud=args.check_baud,
        faults=scenario.fault,
        seed=scenario.seed,
    )


def _access_note(args: argparse.Namespace) -> str:
    if args.pty:
        return ""
    return ", open to other computers: it obeys every client" if args.anywhere else ", open to this computer only"
