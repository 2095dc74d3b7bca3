"""Flags and arguments that verbs of the command line share, their parsers, and flags that verbs had once."""

import argparse
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.core.network import FASTRAK_PREFIX, VRPN_PREFIX
from harness.core.options import expand_alternatives, split_outside_brackets
from harness.core.output_place import place_fault
from harness.errors import BadFile, BadInput, Outcome

if TYPE_CHECKING:
    from harness.experiment.methods import Isolation
    from harness.stream import TrackerConfig
    from harness.stream.fastrak import FastrakConfig
    from harness.stream.is900 import DriverConfig

Verbs = Any  # argparse's subparsers object has no public type
MOST_PROCESSES = 1024
"""Most worker processes on one computer [choice]."""
LINE_FLAGS = ("items", "baud", "quality", "keep_settings", "boresight", "alignment")
"""Flags of `add_line_flags`, as attributes of the parsed command line."""
STATION_CHARACTERS = "123456789ABC"
"""Characters of the stations that a device may have (docs/is900.md 5)."""
Action = Callable[[argparse.Namespace], Outcome]
_SCENARIO = "Copy the scenario, {}, and name the copy"
_MOVIE = "`harness view RUN --clip CLIP --methods METHOD --save FILE.mp4` makes a movie of any clip"

REMOVED_FLAGS: Mapping[str, Mapping[str, str]] = {
    "calibrate": {"--live": "--port alone reads a tracker: leave --live out"},
    "characterize": {
        "--name": "A unit has the name of its recording: rename the recording",
        "--capture": "The recording lies beside --out with the suffix .rec: move it afterwards",
    },
    "emulate": {
        "--overload": _SCENARIO.format("set tracker.overload = true in it"),
        "--no-faults": _SCENARIO.format("remove its tables [[fault]]"),
        "--restart": "A restart takes 0.25 s; in Python write EmulatorConfig(restart_s=15.0)",
        "--controls": "Buttons and joystick move in turn; in Python write EmulatorConfig(controls='still')",
    },
    "live": {"--lsl-network": "Write --anywhere, as for `harness emulate`"},
    "plot": {"--format": "The suffix of --out is the format: --out FILE.svg"},
    "report": {"--movie": _MOVIE},
    "run": {"--movie": _MOVIE},
}
"""Verb -> flag that it had once -> what to write instead; no help shows it."""


def add_verb(verbs: Verbs, name: str, text: str, action: Action, *flags: str) -> argparse.ArgumentParser:
    """Add a verb with flags that other verbs share: any of "seed", "out", "jobs", "mocap" and "force"."""
    verb: argparse.ArgumentParser = verbs.add_parser(name, help=text, description=text[0].upper() + text[1:] + ".")
    verb.set_defaults(action=action)
    verb.add_argument("--json", action="store_true", help="print JSON instead of text")
    if "seed" in flags:
        verb.add_argument("--seed", type=int, help="seed instead of the scenario's")
    if "out" in flags:
        verb.add_argument("--out", type=output_folder, metavar="DIR", help="folder to write")
    if "jobs" in flags:
        text = "clips computed at the same time (default 1, of the demo 2)"
        verb.add_argument("--jobs", type=process_count, default=1, metavar="N", help=text)
    if "mocap" in flags:
        add_mocap_flag(verb, "folder of real motion; may be repeated (default: those that HARNESS_MOCAP names)")
    if "force" in flags:
        verb.add_argument("--force", action="store_true", help="overwrite files that exist")
    for flag, advice in REMOVED_FLAGS.get(name, {}).items():  # refused with or without a value
        verb.add_argument(flag, action=_Refuse, nargs="?", const=advice, help=argparse.SUPPRESS, dest=argparse.SUPPRESS)
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


def add_line_flags(
    verb: argparse.ArgumentParser, rate: str = "frames per second, for a device that does not report its rate"
) -> None:
    """Add `--rate`, with this help, and the flags of a verb that opens a device's line; `line_options` reads them."""
    verb.add_argument("--rate", type=positive_float, metavar="HZ", help=rate)
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


def add_vrpn_flag(verb: Any, text: str) -> None:
    """Add `--vrpn NAME`, which serves this text."""
    verb.add_argument(
        "--vrpn",
        metavar="NAME[@HOST:PORT]",
        help=f"serve VRPN clients as the tracker NAME: {text} (default port 3883 of this computer; 0 takes a free one)",
    )


def refuse_flags(args: argparse.Namespace, names: Iterable[str], where: str, advice: str) -> None:
    """BadInput for the first of these flags (`keep_settings`) that is given; `where` follows its name."""
    for name in names:
        if getattr(args, name) is not None and getattr(args, name) is not False:
            raise BadInput(f"--{name.replace('_', '-')} {where}.", advice)


def refuse_flags_of_others(args: argparse.Namespace, flags_by_use: Mapping[str, Sequence[str]], use: str) -> None:
    """BadInput for a flag that applies to other uses of a verb than the present one; `flags_by_use` lists all."""
    for name in sorted({name for names in flags_by_use.values() for name in names} - set(flags_by_use[use])):
        users = " or ".join(other for other, names in flags_by_use.items() if name in names)
        refuse_flags(args, [name], f"with {use}", f"It applies to {users}: leave it out.")


def line_options(args: argparse.Namespace, port: str) -> dict[str, Any]:
    """The driver options that those flags and `--stations head=3` give; BadInput for flags that no such port takes."""
    if args.baud is not None and "://" in port:
        raise BadInput(f"--baud with {port}.", "It is for a serial port: leave it out.")
    if port.startswith(("udp:", VRPN_PREFIX)):
        advice = f"It needs commands, and {'UDP' if port.startswith('udp:') else 'VRPN'} carries none: leave it out."
        refuse_flags(args, sorted(LINE_FLAGS), f"with {port}", advice)
    if port.startswith(FASTRAK_PREFIX):
        advice = "It is for an IS-900: leave it out."
        refuse_flags(args, sorted({*LINE_FLAGS} - {"items", "baud"}), f"with {port}", advice)
    options = {name: getattr(args, name) for name in LINE_FLAGS if getattr(args, name) is not None}
    if not port.startswith(VRPN_PREFIX) and (characters := parse_characters(args.stations)):
        options["characters"] = characters
    return options


def tracker_config(args: argparse.Namespace, port: str, stations: Iterable[str] | None, **more: Any) -> "TrackerConfig":
    """The settings of the tracker at a port that those flags give; `more` is for the line of an IS-900."""
    if not port.startswith(VRPN_PREFIX):
        return line_config(args, port, stations, **more)
    from harness.stream.vrpn import VrpnConfig

    line_options(args, port)  # refuses the flags of lines
    mapped = parse_station_map(args.stations, port) if "=" in (args.stations or "") else {}
    names = None if stations is None else tuple(stations)
    return VrpnConfig(names, tuple(map(int, mapped.values())) or None, args.rate)


def line_config(
    args: argparse.Namespace, port: str, stations: Iterable[str] | None, **more: Any
) -> "DriverConfig | FastrakConfig":
    """The settings of a device on a line that those flags give; `more` is for an IS-900."""
    names, options = None if stations is None else tuple(stations), line_options(args, port)
    if port.startswith(FASTRAK_PREFIX):
        from harness.stream.fastrak import FastrakConfig

        return FastrakConfig(**options, stations=names, rate_hz=args.rate)
    from harness.stream.is900 import DriverConfig

    return DriverConfig(**{**more, **options}, stations=names, rate_hz=args.rate)


def output_folder(text: str) -> Path:
    """A folder that can be written, or made, for argparse: a verb that works for long refuses another at once."""
    return _place(text, place_fault(Path(text)), "a folder to write")


def folder_of(args: argparse.Namespace, name: str) -> Path:
    """The folder of `--out`, or `results/NAME`; BadFile where that cannot be written."""
    out: Path = args.out or output_folder(str(Path("results") / name))
    return out


def output_file(text: str) -> Path:
    """A file that can be written, for argparse; the verb itself refuses one that exists and may not be replaced."""
    path = Path(text)
    fault = "it is not a file" if path.exists() and not path.is_file() else place_fault(path.parent)
    return _place(text, fault, "a file to write")


def output_link(text: str) -> Path:
    """A name for the link of a pseudo terminal, in a folder that exists, for argparse."""
    folder = Path(text).parent
    fault = place_fault(folder) or ("" if folder.is_dir() else f"there is no folder {folder}")
    return _place(text, fault, "a link to make")


def _place(text: str, fault: str, expected: str) -> Path:
    if fault:
        raise BadFile(text, fault, expected, "Choose another.")
    return Path(text)


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


def _numbers(text: str) -> list[float]:
    """Numbers that commas separate; NaN for other words."""
    try:
        return [float(word) for word in text.split(",")]
    except ValueError:
        return [math.nan]


def positive_float(text: str) -> float:
    """A finite number above 0, for argparse."""
    value, *others = _numbers(text)
    if others or not 0.0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is not a positive number")
    return value


def share(text: str) -> float:
    """Read a share above 0, up to 1."""
    value, *others = _numbers(text)
    if others or not 0.0 < value <= 1.0:
        raise argparse.ArgumentTypeError(f"{text!r} is no share above 0, up to 1")
    return value


def parse_pair(text: str) -> tuple[float, float]:
    """Two numbers of 0 or more, for argparse."""
    values = _numbers(text)
    if len(values) != 2 or not all(0.0 <= value < math.inf for value in values):
        raise argparse.ArgumentTypeError(f"{text!r} is no pair of numbers, such as 0.2,0.1")
    return values[0], values[1]


def split_list(text: str | None) -> list[str]:
    """The entries of a list that is separated by commas outside brackets; [] without one; BadInput for an empty one."""
    entries = [entry.strip() for entry in split_outside_brackets(text, ",")] if text else []
    if not all(entries):
        raise BadInput(f"The list {text!r} has an empty name.", "Separate names by commas.")
    return entries


def parse_methods(text: str) -> tuple[str, ...]:
    """Names of methods separated by commas; values of an option that are separated by `|` give a name each."""
    return tuple(name for part in split_list(text) for name in expand_alternatives(part))


def parse_items(text: str) -> tuple[int, ...]:
    """An output list such as 40,2,11,21,1."""
    codes = text.split(",")
    if not all(is_whole_number(code.strip()) for code in codes):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list such as 40,2,11,21,1")
    return tuple(map(int, codes))


def parse_alignment(text: str) -> tuple[tuple[float, ...], ...]:
    """Three points of an alignment frame, such as 0,0,0,1,0,0,0,1,0 [m]."""
    values = _numbers(text)
    if len(values) != 9 or not all(map(math.isfinite, values)):
        raise argparse.ArgumentTypeError(f"{text!r} is not nine numbers such as 0,0,0,1,0,0,0,1,0")
    return tuple(tuple(values[k : k + 3]) for k in (0, 3, 6))


def parse_device_names(text: str, port: str = "") -> list[str]:
    """Names of stations with or without stations of the device at a port, in the order of the device."""
    return list(parse_station_map(text, port)) if "=" in text else parse_names(text)


def parse_characters(text: str | None) -> str:
    """Characters of the device's stations that `--stations` names (`head=3,torso=1`), ascending; "" for none."""
    return "".join(parse_station_map(text).values()) if text is not None and "=" in text else ""


def parse_station_map(text: str, port: str = "") -> dict[str, str]:
    """Names with the characters of the device's stations, in the order of the device, from `head=3,torso=1`.

    At a port of VRPN these are numbers of sensors. BadInput for a name without a station, a station that no device has,
    and a name or station that occurs twice.
    """
    sensors = port.startswith(VRPN_PREFIX)
    pairs = [tuple(part.strip() for part in entry.partition("=")[::2]) for entry in text.split(",")]
    known = "sensors are whole numbers from 0" if sensors else "stations are 1 to 9 and A to C"
    advice = f"Write NAME=STATION for each, such as head=3,torso=1; {known}."
    for name, character in pairs:
        if not name or not character:
            raise BadInput(f"--stations {text!r}: {name or character or 'an entry'} has no counterpart.", advice)
        if not (is_whole_number(character) if sensors else character.upper() in set(STATION_CHARACTERS)):
            raise BadInput(f"--stations {text!r}: {character!r} is no station of a device.", advice)
    for what, values in (("name", [name for name, _ in pairs]), ("station", [c.upper() for _, c in pairs])):
        for value in values:
            if values.count(value) > 1:
                raise BadInput(f"--stations {text!r}: {what} {value} occurs {values.count(value)} times.", advice)
    return dict(sorted(((name, c.upper()) for name, c in pairs), key=lambda pair: int(pair[1], 16)))


def parse_names(text: str) -> list[str]:
    """Station names separated by commas; BadInput for an empty name."""
    if "=" in text:
        raise BadInput(f"--stations {text!r} names stations of a device.", "No device is read here: give names alone.")
    return split_list(text)


class _Refuse(argparse.Action):
    """Raises BadInput with the advice that is the action's `const`."""

    def __call__(self, parser: Any, namespace: argparse.Namespace, values: Any, option: str | None = None) -> None:
        raise BadInput(f"`{parser.prog}` no longer has {option}.", f"{self.const}.")


def add_isolation_flags(verb: argparse.ArgumentParser) -> None:
    """Add `--isolate`, `--time-limit` and `--memory-limit`."""
    text = "run every method in a process of its own; methods from outside the package always have one"
    verb.add_argument("--isolate", action="store_true", help=text)
    text = "longest time of such a method for its training, and for one take (default 600)"
    verb.add_argument("--time-limit", type=positive_float, metavar="S", help=text)
    text = "largest memory of such a method (default 0.8 of the machine's, divided by --jobs)"
    verb.add_argument("--memory-limit", type=positive_float, metavar="GB", help=text)


def read_isolation(args: argparse.Namespace) -> "Isolation":
    """The isolation that those flags ask for."""
    from harness.experiment.methods import DEFAULT_TIME_LIMIT_S, Isolation

    return Isolation(args.isolate, args.time_limit or DEFAULT_TIME_LIMIT_S, args.memory_limit)
