"""What the verbs of the command line share: their flags, and how they answer."""

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
"""Stations of a device where nothing is said: VRPN takes no more (docs/is900.md 11.1)."""
Action = Callable[[argparse.Namespace], Outcome]


def add_verb(verbs: Verbs, name: str, text: str, action: Action, *flags: str) -> argparse.ArgumentParser:
    """A verb with the flags it shares with others; they mean the same everywhere.

    `endless` is no flag: it goes on until Ctrl-C, which is then no interruption.
    """
    verb: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
    verb.set_defaults(action=action, endless="endless" in flags)
    verb.add_argument("--json", action="store_true", help="print JSON instead of text")
    if "seed" in flags:
        verb.add_argument("--seed", type=int, help="replaces the scenario's seed")
    if "out" in flags:
        verb.add_argument("--out", type=Path, metavar="DIR", help="folder to write")
    if "jobs" in flags:
        text = "clips at the same time (default 1; the demo's is 2)"
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


def add_line_flags(verb: argparse.ArgumentParser) -> None:
    """The flags of a verb that opens a device's line; `line_options` reads them."""
    verb.add_argument(
        "--items", type=parse_items, metavar="A,B", help="output list of the device (default 40,2,11,21,1)"
    )
    verb.add_argument("--baud", type=positive_int, help="of a serial port (default: found out)")
    text = "where lost stations show: in the records (item 40), or in answers to MP, for firmware before 4.13"
    verb.add_argument("--quality", choices=["record", "mp"], help=text + " (default record)")


def line_options(args: argparse.Namespace) -> dict[str, Any]:
    """What those flags ask of the driver, the rest left out; BadInput."""
    if args.baud is not None and "://" in args.port:
        raise BadInput(f"--baud with {args.port}.", "It is for a serial port; leave it out.")
    return {name: getattr(args, name) for name in ("items", "baud", "quality") if getattr(args, name) is not None}


def is_whole_number(text: str) -> bool:
    """Whether these are digits 0 to 9 and nothing else; `isdigit` alone takes `²` too."""
    return text.isascii() and text.isdecimal()


def positive_int(text: str) -> int:
    if not is_whole_number(text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is no positive whole number")
    return int(text)


def positive_float(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value < float("inf"):
        raise argparse.ArgumentTypeError(f"{text!r} is no positive number")
    return value


def parse_items(text: str) -> tuple[int, ...]:
    """An output list."""
    codes = text.split(",")
    if not all(is_whole_number(code.strip()) for code in codes):
        raise argparse.ArgumentTypeError(f"{text!r} is no list such as 40,2,11,21,1")
    return tuple(map(int, codes))


def parse_stations(args: argparse.Namespace) -> int | list[str]:
    """What `--stations` asks for: how many of the scenario's, or their names; `DEFAULT_STATION_COUNT` without. BadInput."""
    from harness.experiment.scenario import load_scenario

    if args.stations is None:
        return min(DEFAULT_STATION_COUNT, len(load_scenario(args.scenario).worn_stations))
    return int(args.stations) if is_whole_number(args.stations) else parse_names(args.stations)


def parse_names(text: str) -> list[str]:
    """Stations by name, as `--stations` has them; BadInput for an empty one."""
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise BadInput(f"--stations {text!r} names no station.", "Write names with commas between them: head,torso.")
    return names


def print_status(line: str) -> None:
    """To whoever sits there, over what `show_progress` left; stdout is data."""
    print(f"\r{line}\033[K" if sys.stderr.isatty() else line, file=sys.stderr, flush=True)


def show_progress(line: str) -> None:
    """One line that changes, for whoever watches a terminal."""
    if sys.stderr.isatty():
        print(f"\r{line}\033[K", end="", file=sys.stderr, flush=True)


@contextmanager
def sigterm_as_interrupt() -> Iterator[None]:
    """Whoever stops the program by SIGTERM means what Ctrl-C says."""

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
    """The command as typed, to print where it can be copied."""
    return shlex.join(["harness", *sys.argv[1:]])
