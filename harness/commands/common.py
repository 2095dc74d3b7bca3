"""What the verbs of the command line share: common flags, their parsers, and the printing of results."""

import argparse
import json
import shlex
import signal
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from harness.errors import BadInput, Outcome

Verbs = Any  # argparse's subparsers object has no public type
DEFAULT_STATION_COUNT = 4
"""Default number of stations of a device: VRPN takes no more (docs/is900.md 11.1)."""
Action = Callable[[argparse.Namespace], Outcome]


def add_verb(verbs: Verbs, name: str, text: str, action: Action, *flags: str) -> argparse.ArgumentParser:
    """Add a verb with flags that other verbs share: any of "seed", "out", "jobs" and "mocap".

    "endless" is no flag: it marks a verb that runs until Ctrl-C, which is then the normal end.
    """
    verb: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
    verb.set_defaults(action=action, endless="endless" in flags)
    verb.add_argument("--json", action="store_true", help="print JSON instead of text")
    if "seed" in flags:
        verb.add_argument("--seed", type=int, help="seed instead of the scenario's")
    if "out" in flags:
        verb.add_argument("--out", type=Path, metavar="DIR", help="folder to write")
    if "jobs" in flags:
        text = "clips computed at the same time (default 1, of the demo 2)"
        verb.add_argument("--jobs", type=positive_int, default=1, metavar="N", help=text)
    if "mocap" in flags:
        add_mocap_flag(verb, "folder of real motion; may be repeated (default: those that HARNESS_MOCAP names)")
    return verb


class _AddFolder(argparse.Action):
    """Keeps one folder as its path, and several as a tuple of paths."""

    def __call__(self, parser: Any, namespace: argparse.Namespace, values: Any, option: str | None = None) -> None:
        earlier = getattr(namespace, self.dest)
        several = earlier if isinstance(earlier, tuple) else (earlier,)
        setattr(namespace, self.dest, values if earlier is None else (*several, values))


def add_mocap_flag(verb: argparse.ArgumentParser, text: str) -> None:
    """Add `--mocap DIR`, which may be given more than once (see `mocap_words`)."""
    verb.add_argument("--mocap", type=Path, action=_AddFolder, metavar="DIR", help=text)


def mocap_words(folders: Path | Sequence[Path] | None) -> list[str]:
    """The words of a command line that name these folders of real motion."""
    several = () if folders is None else (folders,) if isinstance(folders, Path) else folders
    return [word for folder in several for word in ("--mocap", str(folder))]


LINE_FLAGS = ("items", "baud", "quality", "boresight", "alignment")
"""Flags of a verb that opens a device's line, as attributes of the parsed command line."""


def add_line_flags(verb: argparse.ArgumentParser) -> None:
    """Add the flags of a verb that opens a device's line; `line_options` reads them."""
    verb.add_argument(
        "--items", type=parse_items, metavar="A,B", help="output list of the device (default 40,2,11,21,1)"
    )
    verb.add_argument("--baud", type=positive_int, help="baud rate of a serial port (default: detected)")
    text = "how lost stations are reported: in records (item 40), or in replies to MP, for firmware before 4.13"
    verb.add_argument("--quality", choices=["record", "mp"], help=text + " (default record)")
    text = "set the heading of every station to zero at its present direction, when the device is set up"
    verb.add_argument("--boresight", action="store_true", default=None, help=text)
    text = "frame to report in: its origin, a point on +X and a point on +Y, nine numbers in the present frame [m]"
    verb.add_argument("--alignment", type=parse_alignment, metavar="X,Y,Z,X,Y,Z,X,Y,Z", help=text)


def line_options(args: argparse.Namespace) -> dict[str, Any]:
    """The driver options that those flags give; BadInput for --baud without a serial port."""
    if args.baud is not None and "://" in args.port:
        raise BadInput(f"--baud with {args.port}.", "It is for a serial port: leave it out.")
    given = {name: getattr(args, name) for name in LINE_FLAGS if getattr(args, name) is not None}
    if given and args.port.startswith("udp:"):
        raise BadInput(f"--{min(given)} with {args.port}.", "It needs commands, and UDP carries none: leave it out.")
    return given


def is_whole_number(text: str) -> bool:
    """Whether a text consists of digits 0 to 9; `str.isdigit` alone accepts `²` too."""
    return text.isascii() and text.isdecimal()


def positive_int(text: str) -> int:
    """A whole number above 0, for argparse."""
    if not is_whole_number(text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive whole number")
    return int(text)


def positive_float(text: str) -> float:
    """A finite number above 0, for argparse."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    return value


def parse_items(text: str) -> tuple[int, ...]:
    """An output list such as 40,2,11,21,1."""
    codes = text.split(",")
    if not all(is_whole_number(code.strip()) for code in codes):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list such as 40,2,11,21,1")
    return tuple(map(int, codes))


def parse_alignment(text: str) -> tuple[tuple[float, ...], ...]:
    """Three points of an alignment frame, such as 0,0,0,1,0,0,0,1,0 [m]."""
    try:
        values = [float(number) for number in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 9 or not all(abs(value) < float("inf") for value in values):
        raise argparse.ArgumentTypeError(f"{text!r} is not nine numbers such as 0,0,0,1,0,0,0,1,0")
    return tuple(tuple(values[k : k + 3]) for k in (0, 3, 6))


def parse_stations(args: argparse.Namespace) -> int | list[str]:
    """The number of the scenario's stations, or their names, from `--stations`; BadInput for an empty name."""
    from harness.experiment.scenario import load_scenario

    if args.stations is None:
        return min(DEFAULT_STATION_COUNT, len(load_scenario(args.scenario).worn_stations))
    return int(args.stations) if is_whole_number(args.stations) else parse_names(args.stations)


def parse_names(text: str) -> list[str]:
    """Station names separated by commas; BadInput for an empty name."""
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise BadInput(f"--stations {text!r} names no station.", "Separate names by commas: head,torso.")
    return names


def print_status(line: str) -> None:
    """Print a line to stderr, over the line of `show_progress`; stdout is for data."""
    print(f"\r{line}\033[K" if sys.stderr.isatty() else line, file=sys.stderr, flush=True)


def show_progress(line: str) -> None:
    """Replace the last line of stderr, if stderr is a terminal."""
    if sys.stderr.isatty():
        print(f"\r{line}\033[K", end="", file=sys.stderr, flush=True)


@contextmanager
def sigterm_as_interrupt() -> Iterator[None]:
    """Treat SIGTERM as Ctrl-C in the block."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def print_result(
    args: argparse.Namespace, content: Mapping[str, Any], *lines: str, outcome: Outcome = Outcome.PASS
) -> Outcome:
    """Print the lines, or with --json the content and the outcome's word; returns the outcome."""
    print(json.dumps({**content, "outcome": outcome.word}) if args.json else "\n".join(lines))
    return outcome


def this_command() -> str:
    """The command line as it was typed."""
    return shlex.join(["harness", *sys.argv[1:]])
