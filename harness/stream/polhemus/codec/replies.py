"""Replies of an IS-900: parses a line into a value, and formats each value as its line (docs/is900.md 6, 7).

`parse_reply` never fails: a line in no source is an `UnknownReply`. `line()` is what the device sends, with CR LF, so
that the emulator writes what the driver reads. Stations are named by their characters, "1" to "9" and "A" to "C".
Replies of the Fastrak start with `2`, those that InterSense added with `3`.
"""

import re
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

_STATIONS = "123456789ABC"


class ParsedReply(ABC):
    """A reply of any kind."""

    def line(self) -> bytes:
        """Return what the device sends, with CR LF."""
        return self.text_line().encode("latin-1", "replace") + b"\r\n"

    @abstractmethod
    def text_line(self) -> str:
        """Return the line without its CR LF."""


@dataclass(frozen=True)
class StatusRecord(ParsedReply):
    """The reply to `S`: 55 bytes, or 54 from some firmware (docs/is900.md 6.1)."""

    station: str = "1"
    binary: bool = False
    centimetres: bool = False
    continuous: bool = False
    firmware: str = "4.2301"
    """At most six characters."""
    identification: str = "IS900VET"
    """At most 31 characters."""
    compensation: bool = False
    self_test: str = ""
    """Three characters when the self-test found a fault."""
    reserved: int = 0x3F0
    """The flags above the four that are known."""
    short: bool = False
    """Whether the record has 54 bytes."""
    tag: str = ""
    """Three characters of a FASTRAK of 2012: `F3` and the map of its receivers; older ones have blanks."""
    blank: bool = True
    """Whether a blank comes before the identification, as from an IS-900."""

    def text_line(self) -> str:
        low = self.binary | self.centimetres << 1 | self.compensation << 2 | self.continuous << 3
        flags = f"{(self.reserved & 0xFF0) | low:03X}"
        head = f"2{self.station[:1]:1}S{flags}{self.self_test[:3]:3} {self.tag[:3]:5}{self.firmware[:6]:6}"
        text = head + " " * self.blank + self.identification
        return f"{text:53.53}"[: 52 if self.short else 53]


def _parse_status(match: re.Match[str]) -> StatusRecord:
    text, flags = match[0], int(match[2], 16)
    return StatusRecord(
        station=match[1],
        binary=bool(flags & 1),
        centimetres=bool(flags & 2),
        compensation=bool(flags & 4),
        continuous=bool(flags & 8),
        firmware=text[15:21].strip(),
        identification=text[21:].strip(),
        self_test=text[6:9].strip(),
        reserved=flags & 0xFF0,
        short=len(text) == 52,
        tag=text[9:15].strip(),
        blank=text[21:22] == " ",
    )


@dataclass(frozen=True)
class OutputList(ParsedReply):
    """The reply to `O{st}` (docs/is900.md 6.2)."""

    station: str
    items: tuple[int, ...]

    def text_line(self) -> str:
        return f"2{self.station}O" + "".join(f"{code:2d}" for code in self.items)


@dataclass(frozen=True)
class StationStates(ParsedReply):
    """The reply to `l{st}` or `l*` (docs/is900.md 6.3)."""

    station: str | None
    """The station of the query; None for all."""
    active: tuple[bool, ...]
    """(4,) the queried station, then stations 2, 3 and 4; or (32,) all stations."""

    def text_line(self) -> str:
        return f"2{self.station or '1'}l" + "".join("01"[on] for on in self.active)

    @property
    def stations(self) -> tuple[str, ...]:
        """Stations that are known to be active; of 32 flags, the twelve stations that the protocol can name."""
        names = _STATIONS if self.station is None else (self.station, *"234")
        flags = dict(zip(names, self.active, strict=False))
        return tuple(sorted(name for name, active in flags.items() if active))


@dataclass(frozen=True)
class GeometryReply(ParsedReply):
    """The reply to a query of a station's geometry. Widths are those of docs/is900.md 14.

    The letter is `A` alignment [cm], `G` boresight reference angles [deg], `H` hemisphere vector, `I` increment of a
    FASTRAK, `N` tip offset [cm] or `V` envelope [m]. The decimals of `N` and `V` are a guess, so nothing should rely
    on them.
    """

    station: str
    letter: str
    values: tuple[float, ...]

    def text_line(self) -> str:
        _, width, decimals = _GEOMETRY_COLUMNS[self.letter]
        return f"2{self.station}{self.letter}" + "".join(f"{v:{width}.{decimals}f}" for v in self.values)


def _parse_geometry(match: re.Match[str]) -> GeometryReply | None:
    count, width, _ = _GEOMETRY_COLUMNS[match[2]]
    if match[2] == "N" and len(match[3]) == 7 * count:  # the other width that the manual gives (section 14)
        width = 7
    fields = [match[3][k * width : (k + 1) * width] for k in range(count)]
    if len(match[3]) != count * width or not all(_FLOAT.fullmatch(field) for field in fields):
        return None
    return GeometryReply(match[1], match[2], tuple(map(float, fields)))


_GEOMETRY_COLUMNS = {"A": (9, 7, 2), "G": (3, 7, 2), "H": (3, 7, 2), "I": (1, 7, 2), "N": (3, 8, 3), "V": (6, 8, 3)}
"""Number of values, their width and their decimals, by letter."""
_FLOAT = re.compile(r" *-?\d*\.?\d+ *")


@dataclass(frozen=True)
class DeviceError(ParsedReply):
    """An error record of the device (docs/is900.md 6.4).

    Codes: -1 a field is missing, -2 not a number, -3 out of range, -4 frequency, -5 buffer full, -99 no such command.
    """

    command: str
    code: int
    ps: int = 1
    fl: int = 1
    st: int = 0

    def text_line(self) -> str:
        command = _printable(self.command)
        return f"2 E*ERROR*{command}*ERROR* EC {self.code}*PS{self.ps}  *FL{self.fl} *ST{self.st}"


def _printable(command: str) -> str:
    """Return the part of a rejected command that an error record may repeat."""
    return re.sub(r"[^ -~]", "?", command)[:80]


@dataclass(frozen=True)
class SystemRecord(ParsedReply):
    """The reply to `MS`."""

    product: str = "g"
    """`4` IS-300, `8` IS-600, `g` IS-900; one manual calls it reserved."""
    platform: bool = False
    boresight_as_fastrak: bool = False
    microseconds: bool = False
    lights: bool = False

    def text_line(self) -> str:
        flags = self.boresight_as_fastrak << 1 | self.microseconds << 2 | self.lights << 3
        return f"31S{self.product}{int(self.platform)}{flags:X}"


def _parse_system(match: re.Match[str]) -> SystemRecord:
    flags = int(match[3], 16)
    return SystemRecord(match[1], bool(int(match[2], 16) & 1), bool(flags & 2), bool(flags & 4), bool(flags & 8))


@dataclass(frozen=True)
class StationRecord(ParsedReply):
    """The reply to `Ms{st}`."""

    station: str
    enhancement: int = 0
    """Filter: 0 most exact, 1 less jitter, 2 for head displays."""
    compass: int = 0
    """0 off, 1 partial, 2 full."""

    def text_line(self) -> str:
        return f"3{self.station}s0{self.enhancement}{self.compass << 1:X}"


@dataclass(frozen=True)
class PredictionReply(ParsedReply):
    """The reply to `Mp{st}`."""

    station: str
    ahead_ms: int

    def text_line(self) -> str:
        return f"3{self.station}p{self.ahead_ms:2d}"


@dataclass(frozen=True)
class SensitivityReply(ParsedReply):
    """The reply to `MQ{st}`: sensitivity to rotation, 1 to 5."""

    station: str
    level: int

    def text_line(self) -> str:
        return f"3{self.station}Q{self.level}"


@dataclass(frozen=True)
class IntegerReply(ParsedReply):
    """The reply to `MU`, `Mg` or `MCI{st}`.

    `MU` is the ultrasonic time-out (two digits), `Mg` the ultrasonic sensitivity (one digit), `MCI{st}` the InertiaCube
    that serves a station (one or two digits; -1 for none).
    """

    station: str
    letter: str
    """Kind of the value: `U`, `g` or `I`."""
    value: int

    def text_line(self) -> str:
        digits = f"{self.value:2d}" if self.letter == "U" else f"{self.value:d}"
        return f"3{self.station}{self.letter}{digits}"


@dataclass(frozen=True)
class GenlockReply(ParsedReply):
    """The reply to `MG`."""

    state: str = "0"
    rate_hz: float = 0.0
    cycles: int = 0

    def text_line(self) -> str:
        return f"31G{self.state}{self.rate_hz:7.2f}{self.cycles:3d}"


@dataclass(frozen=True)
class Emitter(ParsedReply):
    """One line of the reply to `MCF`: a fixed emitter."""

    number: int
    position_m: tuple[float, float, float]
    normal: tuple[float, float, float]
    identity: int

    def text_line(self) -> str:
        position = "".join(f"{value:10.4f}" for value in self.position_m)
        normal = "".join(f"{value:7.2f}" for value in self.normal)
        return f"31F{self.number:7d}{position}{normal}{self.identity:7d}"


def _parse_emitter(match: re.Match[str]) -> Emitter:
    x, y, z, a, b, c = map(float, match.groups()[1:7])
    return Emitter(int(match[1]), (x, y, z), (a, b, c), int(match[8]))


@dataclass(frozen=True)
class TrackingStatus(ParsedReply):
    """The reply to `MP`: 48 bytes on the tracking of all twelve stations."""

    states: str
    """(12,) `T` tracking, `L` lost, `X` absent or not valid."""
    received: tuple[int, ...]
    """(12,) ranges received in the last cycle, 0 to 15."""
    rejected: tuple[int, ...]
    """(12,) ranges rejected in the last cycle, 0 to 15."""
    rate_hz: float
    genlock: str = " "
    """Genlock state: `G`, `X` or blank."""

    def text_line(self) -> str:
        ranges = zip(self.states, self.received, self.rejected, strict=True)
        stations = "".join(f"{state}{min(taken, 15):x}{min(left, 15):x}" for state, taken, left in ranges)
        return f"31P{stations}{self.rate_hz:5.0f} {self.genlock}"

    @property
    def lost(self) -> bytes:
        """Characters of the stations that are not tracked."""
        return bytes(c for c, state in zip(_STATIONS.encode(), self.states, strict=True) if state != "T")


def _parse_tracking(match: re.Match[str]) -> TrackingStatus:
    received, rejected = (tuple(int(digit.strip() or "0", 16) for digit in match[1][k::3]) for k in (1, 2))
    return TrackingStatus(match[1][::3], received, rejected, float(match[2]), match[3])


@dataclass(frozen=True)
class UnknownReply(ParsedReply):
    """A line that no source describes."""

    text: bytes
    """The line without its CR LF."""

    def text_line(self) -> str:
        return self.text.decode("latin-1")


_NUMBER = r" *(-?\d+\.\d+)"
_PATTERNS: dict[str, Callable[[re.Match[str]], ParsedReply | None]] = {
    r"2.E\*ERROR\*(.*?)\*ERROR\* *EC *(-?\d{1,4})(?: *\*PS *(\d{1,4}))?(?: *\*FL *(\d{1,4}))?"
    r"(?: *\*ST *(\d{1,4}))?(?s:.*)": lambda m: DeviceError(_printable(m[1]), *(int(m[k] or 0) for k in range(2, 6))),
    r"(?s)(?=.{52,53}\Z)2([1-9A-C])S([0-9A-Fa-f]{3}).*": _parse_status,
    r"2([1-9A-C])O((?:[ 1-9]\d)*)": lambda m: OutputList(
        m[1], tuple(int(m[2][k : k + 2]) for k in range(0, len(m[2]), 2))
    ),
    r"2([1-9A-C])l([01]{4}|[01]{32})": lambda m: StationStates(
        None if len(m[2]) == 32 else m[1], tuple(digit == "1" for digit in m[2])
    ),
    r"(?s).(.)([AGHINV])(.*)": _parse_geometry,
    r"(?=.{46}$)31P((?:[TLX][0-9A-Fa-f ]{2}){12})( *\d+(?:\.\d*)? *) (.)": _parse_tracking,
    r"31S(.)([0-9A-Fa-f])([0-9A-Fa-f])": _parse_system,
    r"3([1-9A-C])s.([0-2])([0-9A-Fa-f])": lambda m: StationRecord(m[1], int(m[2]), int(m[3], 16) >> 1 & 3),
    r"3([1-9A-C])p([ \d]\d)": lambda m: PredictionReply(m[1], int(m[2])),
    r"3([1-9A-C])Q(\d)": lambda m: SensitivityReply(m[1], int(m[2])),
    r"3([1-9A-C])(U(?=..$)|g(?=.$)|I)(-1|[ \d]?\d)": lambda m: IntegerReply(m[1], m[2], int(m[3])),
    r"31G(.)(?=.{7}.{3}$)( *\d+\.\d\d)( *\d+)": lambda m: GenlockReply(m[1], float(m[2]), int(m[3])),
    # Blanks separate the numbers, since some firmware widens the first; an identity of seven digits follows without.
    rf"31F *(\d+){_NUMBER * 6}(?: +|(?<=\.\d\d))(\d+)": _parse_emitter,
}
"""The form of each reply, and what makes a value of it; None for another reply after all."""
_PARSERS = [(re.compile(pattern), make) for pattern, make in _PATTERNS.items()]


def parse_reply(line: bytes) -> ParsedReply:
    """Parse a line, with or without its CR LF."""
    bare = line.removesuffix(b"\n").removesuffix(b"\r")
    text = bare.decode("latin-1")
    matches = ((pattern.fullmatch(text), make) for pattern, make in _PARSERS)
    return next((reply for match, make in matches if match and (reply := make(match))), UnknownReply(bare))
