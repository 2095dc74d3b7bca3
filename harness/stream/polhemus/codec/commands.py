"""Commands that a host sends to an IS-900, as bytes, and a parser of such bytes (docs/is900.md 3 and 4).

Nine letters act at once; so do four control characters, wherever they occur. Every other command is a line. The
functions here end lines with CR LF, as the manuals do. Stations are named by their characters, "1" to "9" and "A" to
"C".
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from harness.errors import BadInput

POLL, STREAM, STOP = b"P", b"C", b"c"
ASCII, BINARY = b"F", b"f"
INCHES, CENTIMETRES = b"U", b"u"
STATUS, FACTORY_DEFAULTS = b"S", b"W"
SAVE, RESUME, SUSPEND, RESTART = b"\x0b", b"\x11", b"\x13", b"\x19"
MILLISECONDS, MICROSECONDS, ZERO_CLOCK = b"MT\r\n", b"Mt\r\n", b"MZ\r\n"
STATION_STATES, TRACKING, SYSTEM, GENLOCK, EMITTERS = b"l*\r\n", b"MP\r\n", b"MS\r\n", b"MG\r\n", b"MCF\r\n"

BORESIGHT_AS_INTERSENSE, BORESIGHT_AS_FASTRAK = b"MBI\r\n", b"MBF\r\n"

IMMEDIATE_LETTERS = b"PCcFfSUuW"
"""Letters that act at once at the start of a line."""
CONTROL_CHARACTERS = SAVE + RESUME + SUSPEND + RESTART
"""Characters that act at once anywhere."""
LONGEST_LINE = 256
"""Longest command line; the rest is discarded. No command in the sources is half as long [bytes]."""


def station_command(name: str, station: str, values: Iterable[float] = (), decimals: int = 0) -> bytes:
    """Command that queries something of a station, such as `O`, or sets it to values (docs/is900.md 4).

    No setter has a reply. Lengths are in cm or inches, as the device is set.
    """
    texts = [f"{name}{station}", *(f"{value:.{decimals}f}" for value in values)]
    return ",".join(texts).encode("ascii") + b"\r\n"


@dataclass(frozen=True)
class Command:
    """One command: a letter or control character that acts at once, or a line."""

    line: bytes
    """The command without its terminator."""
    cut: bool = False
    """Whether it was longer than `LONGEST_LINE` and its end was discarded."""

    @property
    def immediate(self) -> bool:
        """Whether it acts at once, without a terminator."""
        return len(self.line) == 1 and self.line in IMMEDIATE_LETTERS + CONTROL_CHARACTERS

    def encode(self) -> bytes:
        """Return its bytes. A line ends in CR, and one that was cut is still longer than `LONGEST_LINE`."""
        return self.line if self.immediate else self.line + b"?" * self.cut + b"\r"


class CommandReader:
    """Splits incoming bytes into commands.

    A line ends at CR or LF; empty lines are ignored. A letter acts at once only at the start of a line. No source says
    what happens in the middle of a line; this rule worked with every client tried. A restart discards an unfinished
    line.
    """

    def __init__(self, immediate: bytes = IMMEDIATE_LETTERS) -> None:
        """`immediate` are the letters that act at once."""
        self._immediate = immediate
        self._line = bytearray()
        self._cut = False

    def feed(self, data: bytes) -> list[Command]:
        """Return the commands that these bytes complete."""
        out: list[Command] = []
        for byte in data:
            if byte in CONTROL_CHARACTERS or (not self._line and byte in self._immediate):
                out.append(Command(bytes([byte])))
                if byte == RESTART[0]:
                    self._clear()
            elif byte in b"\r\n":
                if self._line:
                    out.append(Command(bytes(self._line), self._cut))
                self._clear()
            elif len(self._line) < LONGEST_LINE:
                self._line.append(byte)
            else:
                self._cut = True
        return out

    def _clear(self) -> None:
        self._line.clear()
        self._cut = False


@dataclass(frozen=True)
class DeviceCommand:
    """One command of the protocol. Control characters are written `^K`."""

    name: str
    danger: str = ""
    """Why a person must allow it; "" where it only reads, or sets what ends when the device is switched off."""
    set_danger: str = ""
    """Why a person must allow it where values follow; "" as above, or for the same reason as without values."""


_HARMLESS = (
    "P C c F f U u S ^Q ^S O l A R G B b H N V x v MS Ms Mp MF MQ MH Mh MT Mt MZ MBI MBF MB MG MGP MGS MP MU Mg "
    "ML0 ML1 MLB ME ME0 ME1 MLogState MLogSend MSchAlg MInfoSystem"
)
_OTHER_PRODUCT = "belongs to another product; no source says what an IS-900 does with it"
_EMITTERS = "changes the emitter constellation, on which all tracking rests"
_DANGERS = {
    "^K": "writes the device's memory",
    "^Y": "restarts the device",
    "W": "resets every setting of the device",
    "o": "changes the line, and may end the connection",
    "T e t Y MCM MCm MCc MCi": _OTHER_PRODUCT,
    "MCf MCC MCe MCx": _EMITTERS,
    "MEC MLogOpen MLogClose MLogClear": "changes or erases what the device has stored",
    "MSystemTest1 MSystemTest2": "runs a self-test; one of them is said to free a device that hangs",
}
"""Commands that a person must allow, and why."""
_SET_DANGERS = {
    "MCF": _EMITTERS,
    "MCI": _OTHER_PRODUCT,
    "MEthIp MEthUdp MEthUdpPort": "changes the device's network settings",
    "MConfigLockMode": "locks or unlocks the device's configuration",
}
"""Commands that a person must allow where values follow."""
_UNKNOWN = "is in no source"
DEVICE_COMMANDS = {
    **{name: DeviceCommand(name) for name in _HARMLESS.split()},
    **{name: DeviceCommand(name, danger) for names, danger in _DANGERS.items() for name in names.split()},
    **{name: DeviceCommand(name, "", danger) for names, danger in _SET_DANGERS.items() for name in names.split()},
}
"""Commands by name."""
_LONGEST_FIRST = sorted(DEVICE_COMMANDS, key=len, reverse=True)
_ARGUMENT = re.compile(r"[0-9A-Ca-c*., +-]*")
"""Stations and numbers; other letters make a command that is in no source."""
_SETS_WITHOUT_COMMA = ("MEthIp", "MEthUdp", "MEthUdpPort", "MConfigLockMode")


def parse_command(text: str) -> Command:
    """Parse one command as a person writes it: `O1,2,4,1`, `S`, or `^K`. Raises BadInput unless it is exactly one."""
    if not (text.isascii() and text.isprintable()) or not 0 < len(text) <= LONGEST_LINE:
        raise BadInput(
            f"{text[:40]!r} is no command.",
            f"Give 1 to {LONGEST_LINE} printable ASCII characters, and ^K, ^Q, ^S or ^Y for control characters.",
        )
    control = re.fullmatch(r"\^([KQSY])", text)
    data = bytes([ord(control[1]) - ord("@")]) if control else text.encode("ascii")
    commands = CommandReader().feed(data + b"\r")
    if len(commands) != 1:
        names = " and ".join(repr(command.line.decode("ascii")) for command in commands)
        raise BadInput(f"{text!r} is {len(commands)} commands: {names}.", "Send each by itself.")
    return commands[0]


def find_danger(command: Command) -> str:
    """Return why a person must allow this command; "" where nobody must."""
    text = command.line.decode("ascii")
    if command.immediate:
        return DEVICE_COMMANDS[text if text.isprintable() else f"^{chr(ord(text) + ord('@'))}"].danger
    name = next((name for name in _LONGEST_FIRST if text.startswith(name)), None)
    if name is None or not _ARGUMENT.fullmatch(text, len(name)):
        return _UNKNOWN
    argument = text[len(name) :]
    sets = "," in argument or (name in _SETS_WITHOUT_COMMA and argument != "")
    return (sets and DEVICE_COMMANDS[name].set_danger) or DEVICE_COMMANDS[name].danger
