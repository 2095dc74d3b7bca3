"""What the verbs of the command line share: common flags, their parsers, and the printing of results."""

import argparse
import json
import shlex
import shutil
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from harness.commands.ending import print_data
from harness.commands.removed_flags import refuse_removed_flags
from harness.core.interrupts import refuse_interrupts
from harness.errors import BadInput, Outcome, was_interrupted

Verbs = Any  # argparse's subparsers object has no public type
MOST_PROCESSES = 1024
"""Most worker processes on one computer [choice]."""
DEFAULT_STATION_COUNT = 4
"""Default number of stations of a device: VRPN takes no more (docs/is900.md 11.1)."""
LINE_FLAGS = ("items", "baud", "quality", "keep_settings", "boresight", "alignment")
"""Flags of `add_line_flags`, as attributes of the parsed command line."""
STATION_CHARACTERS = "123456789ABC"
"""Characters of the stations that a device may have (docs/is900.md 5)."""
DEVICE_STATIONS_HELP = (
    "number of the scenario's stations, or their names, in the order of the device's active stations; or names with "
    "stations of the device: head=3,torso=1 (default: the first 4)"
)
Action = Callable[[argparse.Namespace], Outcome]


def add_verb(verbs: Verbs, name: str, text: str, action: Action, *flags: str) -> argparse.ArgumentParser:
    """Add a verb with flags that other verbs share: any of "seed", "out", "jobs" and "mocap"."""
    verb: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
    verb.set_defaults(action=action)
    verb.add_argument("--json", action="store_true", help="print JSON instead of text")
    if "seed" in flags:
        verb.add_argument("--seed", type=int, help="seed instead of the scenario's")
    if "out" in flags:
        verb.add_argument("--out", type=Path, metavar="DIR", help="folder to write")
    if "jobs" in flags:
        text = "clips computed at the same time (default 1, of the demo 2)"
        verb.add_argument("--jobs", type=process_count, default=1, metavar="N", help=text)
    if "mocap" in flags:
        add_mocap_flag(verb, "folder of real motion; may be repeated (default: those that HARNESS_MOCAP names)")
    refuse_removed_flags(name, verb)
    return verb


class _AddFolder(argparse.Action):
    """Keeps one folder as its path, and several as a tuple of paths."""

    def __call__(self, parser: Any, namespace: argparse.Namespace, values: Any, option: str | None = None) -> None:
        earlier = getattr(namespace, self.dest)
        several = earlier if isinstance(earlier, tuple) else (earlier,)
        setattr(namespace, self.dest, values if earlier is None else (*several, values))


def add_mocap_flag(verb: argparse.ArgumentParser, text: str) -> None:
    """Add `--mocap DIR`, which may be given more than once."""
    verb.add_argument("--mocap", type=Path, action=_AddFolder, metavar="DIR", help=text)


def repeat_flags(args: argparse.Namespace, *names: str) -> list[str]:
    """The words that give the flags of these names (`keep_settings`) their present values in another command line."""
    words = []
    for name in names:
        flag, value = f"--{name.replace('_', '-')}", getattr(args, name, None)
        if value is None or value is False or value == "":
            continue
        if value is True:
            words.append(flag)
        elif isinstance(value, tuple) and isinstance(value[0], Path):
            words += [word for folder in value for word in (flag, str(folder))]
        else:
            text = _format_value(value)
            words += [f"{flag}={text}"] if text.startswith("-") else [flag, text]  # argparse takes -1,0,0 for a flag
    return words


def _format_value(value: Any) -> str:
    if isinstance(value, tuple):
        return ",".join(map(_format_value, value))
    return f"{value:g}" if isinstance(value, float) and float(f"{value:g}") == value else str(value)


def add_line_flags(verb: argparse.ArgumentParser) -> None:
    """Add the flags of a verb that opens a device's line; `line_options` reads them."""
    verb.add_argument(
        "--items",
        type=parse_items,
        metavar="A,B",
        help="output list of the device (default 40,2,11,21,1; 40,18,19,21,1 is shorter, with a range of 3 m)",
    )
    verb.add_argument("--baud", type=positive_int, help="baud rate of a serial port (default: detected)")
    text = "how lost stations are reported: in records (item 40), or in replies to MP, for firmware before 4.13"
    verb.add_argument("--quality", choices=["record", "mp"], help=text + " (default record)")
    text = "use the device as other programs left it: tip offset, alignment, boresight and filters"
    verb.add_argument("--keep-settings", action="store_true", default=None, help=text)
    text = "set the heading of every station to zero at its present direction, when the device is set up"
    verb.add_argument("--boresight", action="store_true", default=None, help=text)
    text = "frame to report in: its origin, a point on +X and a point on +Y, nine numbers in the present frame [m]"
    verb.add_argument("--alignment", type=parse_alignment, metavar="X,Y,Z,X,Y,Z,X,Y,Z", help=text)


def line_options(args: argparse.Namespace) -> dict[str, Any]:
    """The driver options that those flags and `--stations head=3` give; BadInput for --baud without a serial port."""
    if args.baud is not None and "://" in args.port:
        raise BadInput(f"--baud with {args.port}.", "It is for a serial port: leave it out.")
    options = {name: getattr(args, name) for name in LINE_FLAGS if getattr(args, name) is not None}
    if options and args.port.startswith("udp:"):
        name = min(options).replace("_", "-")
        raise BadInput(f"--{name} with {args.port}.", "It needs commands, and UDP carries none: leave it out.")
    if characters := parse_characters(args.stations):
        options["characters"] = characters
    return options


def is_whole_number(text: str) -> bool:
    """Whether a text is one to nine digits. `str.isdigit` accepts `²`, and `int` refuses more than 4,300 digits."""
    return text.isascii() and text.isdecimal() and len(text) < 10


def positive_int(text: str) -> int:
    """A whole number above 0, for argparse."""
    if not is_whole_number(text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive whole number")
    return int(text)


def process_count(text: str) -> int:
    """A number of worker processes, for argparse."""
    count = positive_int(text)
    if count > MOST_PROCESSES:
        raise argparse.ArgumentTypeError(f"{text!r} processes; at most {MOST_PROCESSES:,} are started")
    return count


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


def parse_stations(args: argparse.Namespace, *, device: bool = False) -> int | list[str]:
    """The number of the scenario's stations, or their names, from `--stations`; BadInput for an empty name.

    With `device` the names may have stations of the device (`head=3`); they are then in the order of the device.
    """
    from harness.experiment.scenario import load_scenario

    if args.stations is None:
        return min(DEFAULT_STATION_COUNT, len(load_scenario(args.scenario).worn_stations))
    if is_whole_number(args.stations):
        return int(args.stations)
    return parse_device_names(args.stations) if device else parse_names(args.stations)


def parse_device_names(text: str) -> list[str]:
    """Names of stations with or without stations of the device, in the order of the device."""
    return list(parse_station_map(text)) if "=" in text else parse_names(text)


def parse_characters(text: str | None) -> str:
    """Characters of the device's stations that `--stations` names (`head=3,torso=1`), ascending; "" for none."""
    return "".join(parse_station_map(text).values()) if text is not None and "=" in text else ""


def parse_station_map(text: str) -> dict[str, str]:
    """Names with the characters of the device's stations, in the order of the device, from `head=3,torso=1`.

    BadInput for a name without a station, a station that no device has, and a name or station that occurs twice.
    """
    pairs = [tuple(part.strip() for part in entry.partition("=")[::2]) for entry in text.split(",")]
    advice = "Write NAME=STATION for each, such as head=3,torso=1; stations are 1 to 9 and A to C."
    for name, character in pairs:
        if not name or not character:
            raise BadInput(f"--stations {text!r}: {name or character or 'an entry'} has no counterpart.", advice)
        if len(character) != 1 or character.upper() not in STATION_CHARACTERS:
            raise BadInput(f"--stations {text!r}: {character!r} is no station of a device.", advice)
    for what, values in (("name", [name for name, _ in pairs]), ("station", [c.upper() for _, c in pairs])):
        for value in values:
            if values.count(value) > 1:
                raise BadInput(f"--stations {text!r}: {what} {value} occurs {values.count(value)} times.", advice)
    return dict(sorted(((name, c.upper()) for name, c in pairs), key=lambda pair: STATION_CHARACTERS.index(pair[1])))


def parse_names(text: str) -> list[str]:
    """Station names separated by commas; BadInput for an empty name."""
    names = [name.strip() for name in text.split(",")]
    if "=" in text:
        raise BadInput(f"--stations {text!r} names stations of a device.", "No device is read here: give names alone.")
    if not all(names):
        raise BadInput(f"--stations {text!r} names no station.", "Separate names by commas: head,torso.")
    return names


@contextmanager
def progress_note(out: Path) -> Iterator[None]:
    """Add to a fault or an interrupt that leaves the block how much of the work in `out` is kept, for it to resume."""
    try:
        yield
    except (KeyboardInterrupt, Exception) as error:
        kept = _describe_progress(out)
        resumes = was_interrupted(error) and out.is_dir()
        error.add_note(f"{kept.removesuffix('.')}, and the same command resumes." if resumes else kept)
        raise


@contextmanager
def recording_note(path: Path, more: str = ".") -> Iterator[None]:
    """Add to an interrupt that leaves the block whether a recording is kept; `more` ends the sentence if it is."""
    try:
        yield
    except (KeyboardInterrupt, Exception) as error:
        if was_interrupted(error):
            kept, nothing = f"What was recorded is kept in {path}{more}", f"Nothing was recorded into {path}."
            error.add_note(kept if path.exists() else nothing)
        raise


def _describe_progress(out: Path) -> str:
    from harness.experiment.status import read_status

    if not out.is_dir():
        return f"Nothing is kept in {out}."
    try:
        found = read_status(out)
    except Exception:  # no work has begun, or the fault concerns the index too
        return f"The finished cells in {out} are kept."
    return f"{found.finished:,} of {found.planned:,} cells in {out} are finished and kept."


def print_status(line: str) -> None:
    """Print a line to stderr, over the line of `show_progress`; stdout is for data."""
    print(f"\r{line}\033[K" if sys.stderr.isatty() else line, file=sys.stderr, flush=True)


def print_caveat(path: object, caveat: str) -> None:
    """Print what cannot be verified of a file, if there is anything."""
    if caveat:
        print_status(f"note: {path}: {caveat}")


def show_progress(line: str) -> None:
    """Replace the last line of stderr, if stderr is a terminal; what is too long for a line is cut."""
    if sys.stderr.isatty():
        line = line[: shutil.get_terminal_size().columns - 1]
        print(f"\r{line}\033[K", end="", file=sys.stderr, flush=True)


def print_result(
    args: argparse.Namespace,
    content: Mapping[str, Any],
    *lines: str,
    outcome: Outcome = Outcome.PASS,
    following: Sequence[object] = (),
) -> Outcome:
    """Print the lines, or with --json the content and the outcome's word; returns the outcome.

    `following` are the words of the command that a user would give next, without the program's name. It is printed to
    stderr, and with --json as "next".

    It is the last thing that a verb does: signals that come later change nothing.
    """
    refuse_interrupts()
    command = shlex.join(["harness", *map(str, following)]) if following else None
    if args.json:
        following_command = {"next": command} if command else {}
        print_data(json.dumps({**content, **following_command, "outcome": outcome.word}) + "\n")
        return outcome
    if print_data("\n".join(lines) + "\n") and command:
        print_status(f"next: {command}")
    return outcome


def this_words() -> list[str]:
    """The words of the command line as typed, without the program's name."""
    return sys.argv[1:]


def this_command() -> str:
    """The command line as it was typed."""
    return shlex.join(["harness", *this_words()])
