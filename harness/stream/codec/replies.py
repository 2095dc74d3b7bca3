"""Replies of an IS-900: parses a line into a value, and formats each value as its line (docs/is900.md 6, 7).

`parse_reply` never fails: a line in no source is an `UnknownReply`. `line()` is what the device sends, with CR LF, so
that the emulator writes what the driver reads. Stations are named by their characters, "1" to "9" and "A" to "C".
"""

import re
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class SystemRecord:
    """The reply to `MS`."""

    product: str = "g"
    """`4` IS-300, `8` IS-600, `g` IS-900; one manual calls it reserved."""
    platform: bool = False
    boresight_as_fastrak: bool = False
    microseconds: bool = False
    lights: bool = False

    def line(self) -> bytes:
        flags = self.boresight_as_fastrak << 1 | self.microseconds << 2 | self.lights << 3
        return f"31S{self.product}{int(self.platform)}{flags:X}\r\n".encode("latin-1")

    @classmethod
    def parse(cls, text: str) -> "SystemRecord | None":
        match = re.fullmatch(r"31S(.)([0-9A-Fa-f])([0-9A-Fa-f])", text)
        if match is None:
            return None
        flags = int(match[3], 16)
        return cls(match[1], bool(int(match[2], 16) & 1), bool(flags & 2), bool(flags & 4), bool(flags & 8))


@dataclass(frozen=True)
class StationRecord:
    """The reply to `Ms{st}`."""

    station: str
    enhancement: int = 0
    """Filter: 0 most exact, 1 less jitter, 2 for head displays."""
    compass: int = 0
    """0 off, 1 partial, 2 full."""

    def line(self) -> bytes:
        return f"3{self.station}s0{self.enhancement}{self.compass << 1:X}\r\n".encode("latin-1")

    @classmethod
    def parse(cls, text: str) -> "StationRecord | None":
        match = re.fullmatch(r"3([1-9A-C])s.([0-2])([0-9A-Fa-f])", text)
        return match and cls(match[1], int(match[2]), int(match[3], 16) >> 1 & 3)


@dataclass(frozen=True)
class PredictionReply:
    """The reply to `Mp{st}`."""

    station: str
    ahead_ms: int

    def line(self) -> bytes:
        return f"3{self.station}p{self.ahead_ms:2d}\r\n".encode("latin-1")

    @classmethod
    def parse(cls, text: str) -> "PredictionReply | None":
        match = re.fullmatch(r"3([1-9A-C])p([ \d]\d)", text)
        return match and cls(match[1], int(match[2]))


@dataclass(frozen=True)
class SensitivityReply:
    """The reply to `MQ{st}`: sensitivity to rotation, 1 to 5."""

    station: str
    level: int

    def line(self) -> bytes:
        return f"3{self.station}Q{self.level}\r\n".encode("latin-1")

    @classmethod
    def parse(cls, text: str) -> "SensitivityReply | None":
        match = re.fullmatch(r"3([1-9A-C])Q(\d)", text)
        return match and cls(match[1], int(match[2]))


@dataclass(frozen=True)
class IntegerReply:
    """The reply to `MU`, `Mg` or `MCI{st}`.

    `MU` is the ultrasonic time-out (two digits), `Mg` the ultrasonic sensitivity (one digit), `MCI{st}` the InertiaCube
    that serves a station (one or two digits; -1 for none).
    """

    station: str
    letter: str
    """Kind of the value: `U`, `g` or `I`."""
    value: int

    def line(self) -> bytes:
        digits = f"{self.value:2d}" if self.letter == "U" else f"{self.value:d}"
        return f"3{self.station}{self.letter}{digits}\r\n".encode("latin-1")

    @classmethod
    def parse(cls, text: str) -> "IntegerReply | None":
        match = re.fullmatch(r"3([1-9A-C])(U(?=..$)|g(?=.$)|I)(-1|[ \d]?\d)", text)
        return match and cls(match[1], match[2], int(match[3]))


@dataclass(frozen=True)
class GenlockReply:
    """The reply to `MG`."""

    state: str = "0"
    rate_hz: float = 0.0
    cycles: int = 0

    def line(self) -> bytes:
        return f"31G{self.state}{self.rate_hz:7.2f}{self.cycles:3d}\r\n".encode("latin-1")

    @classmethod
    def parse(cls, text: str) -> "GenlockReply | None":
        match = re.fullmatch(r"31G(.)(?=.{7}.{3}$)( *\d+\.\d\d)( *\d+)", text)
        return match and cls(match[1], float(match[2]), int(match[3]))


@dataclass(frozen=True)
class Emitter:
    """One line of the reply to `MCF`: a fixed emitter."""

    number: int
    position_m: tuple[float, float, float]
    normal: tuple[float, float, float]
    identity: int

    def line(self) -> bytes:
        position = "".join(f"{value:10.4f}" for value in self.position_m)
        normal = "".join(f"{value:7.2f}" for value in self.normal)
        return f"31F{self.number:7d}{position}{normal}{self.identity:7d}\r\n".encode("latin-1")

    @classmethod
    def parse(cls, text: str) -> "Emitter | None":
        """Parse by blanks, since some firmware widens the number.

        An identity of seven digits follows the normal's two decimals without one.
        """
        number = r" *(-?\d+\.\d+)"
        match = re.fullmatch(rf"31F *(\d+){number * 6}(?: +|(?<=\.\d\d))(\d+)", text)
        if match is None:
            return None
        x, y, z, a, b, c = map(float, match.groups()[1:7])
        return cls(int(match[1]), (x, y, z), (a, b, c), int(match[8]))


@dataclass(frozen=True)
class TrackingStatus:
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

    def line(self) -> bytes:
        ranges = zip(self.states, self.received, self.rejected, strict=True)
        stations = "".join(
            f"{state}{min(received_count, 15):x}{min(rejected_count, 15):x}"
            for state, received_count, rejected_count in ranges
        )
        return f"31P{stations}{self.rate_hz:5.0f} {self.genlock}\r\n".encode("latin-1")

    @classmethod
    def parse(cls, text: str) -> "TrackingStatus | None":
        match = re.fullmatch(r"(?=.{46}$)31P((?:[TLX][0-9A-Fa-f ]{2}){12})( *\d+(?:\.\d*)? *) (.)", text)
        if match is None:
            return None
        received, rejected = (tuple(int(digit.strip() or "0", 16) for digit in match[1][k::3]) for k in (1, 2))
        return cls(match[1][::3], received, rejected, float(match[2]), match[3])

    @property
    def lost(self) -> bytes:
        """Characters of the stations that are not tracked."""
        return bytes(c for c, state in zip(b"123456789ABC", self.states, strict=True) if state != "T")


__all__ = [
    "DeviceError",
    "Emitter",
    "GenlockReply",
    "GeometryReply",
    "IntegerReply",
    "OutputList",
    "ParsedReply",
    "PredictionReply",
    "SensitivityReply",
    "StationRecord",
    "StationStates",
    "StatusRecord",
    "SystemRecord",
    "TrackingStatus",
    "UnknownReply",
    "parse_reply",
]

_STATIONS = "123456789ABC"


@dataclass(frozen=True)
class StatusRecord:
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

    def line(self) -> bytes:
        low = self.binary | self.centimetres << 1 | self.compensation << 2 | self.continuous << 3
        flags = f"{(self.reserved & 0xFF0) | low:03X}"
        text = f"2{self.station[:1]:1}S{flags}{self.self_test[:3]:3}      {self.firmware[:6]:6} {self.identification}"
        return _encode_line(f"{text:53.53}"[: 52 if self.short else 53])

    @classmethod
    def parse(cls, text: str) -> "StatusRecord | None":
        if not (re.match(r"2[1-9A-C]S[0-9A-Fa-f]{3}", text) and len(text) in (52, 53)):
            return None
        flags = int(text[3:6], 16)
        return cls(
            station=text[1],
            binary=bool(flags & 1),
            centimetres=bool(flags & 2),
            compensation=bool(flags & 4),
            continuous=bool(flags & 8),
            firmware=text[15:21].strip(),
            identification=text[21:].strip(),
            self_test=text[6:9].strip(),
            reserved=flags & 0xFF0,
            short=len(text) == 52,
        )


@dataclass(frozen=True)
class OutputList:
    """The reply to `O{st}` (docs/is900.md 6.2)."""

    station: str
    items: tuple[int, ...]

    def line(self) -> bytes:
        return _encode_line(f"2{self.station}O" + "".join(f"{code:2d}" for code in self.items))

    @classmethod
    def parse(cls, text: str) -> "OutputList | None":
        match = re.fullmatch(r"2([1-9A-C])O((?:[ 1-9]\d)*)", text)
        return match and cls(match[1], tuple(int(match[2][k : k + 2]) for k in range(0, len(match[2]), 2)))


@dataclass(frozen=True)
class StationStates:
    """The reply to `l{st}` or `l*` (docs/is900.md 6.3)."""

    station: str | None
    """The station of the query; None for all."""
    active: tuple[bool, ...]
    """(4,) the queried station, then stations 2, 3 and 4; or (32,) all stations."""

    def line(self) -> bytes:
        return _encode_line(f"2{self.station or '1'}l" + "".join("01"[on] for on in self.active))

    @classmethod
    def parse(cls, text: str) -> "StationStates | None":
        match = re.fullmatch(r"2([1-9A-C])l([01]{4}|[01]{32})", text)
        return match and cls(None if len(match[2]) == 32 else match[1], tuple(digit == "1" for digit in match[2]))

    @property
    def stations(self) -> tuple[str, ...]:
        """Stations that are known to be active; of 32 flags, the twelve stations that the protocol can name."""
        named = _STATIONS if self.station is None else dict.fromkeys((self.station, *"234"))
        first = dict(zip((self.station, *"234"), self.active, strict=False))
        flags = dict(zip(_STATIONS, self.active, strict=False)) if self.station is None else first
        return tuple(sorted(name for name in named if flags[name]))


@dataclass(frozen=True)
class GeometryReply:
    """The reply to a query of a station's geometry. Widths are those of docs/is900.md 14.

    The letter is `A` alignment [cm], `G` boresight reference angles [deg], `H` hemisphere vector, `N` tip offset [cm]
    or `V` envelope [m]. The decimals of `N` and `V` are a guess, so nothing should rely on them.
    """

    station: str
    letter: str
    values: tuple[float, ...]

    def line(self) -> bytes:
        _, width, decimals = _GEOMETRY_COLUMNS[self.letter]
        return _encode_line(f"2{self.station}{self.letter}" + "".join(f"{v:{width}.{decimals}f}" for v in self.values))

    @classmethod
    def parse(cls, text: str) -> "GeometryReply | None":
        count, width, _ = _GEOMETRY_COLUMNS.get(text[2:3], (0, 0, 0))
        if text[2:3] == "N" and len(text) == 3 + 7 * count:  # the other width that the manual gives (section 14)
            width = 7
        fields = [text[3 + k * width : 3 + (k + 1) * width] for k in range(count)]
        if not fields or len(text) != 3 + count * width or not all(_FLOAT.fullmatch(field) for field in fields):
            return None
        return cls(text[1], text[2], tuple(map(float, fields)))


_GEOMETRY_COLUMNS = {"A": (9, 7, 2), "G": (3, 7, 2), "H": (3, 7, 2), "N": (3, 8, 3), "V": (6, 8, 3)}
"""Number of values, their width and their decimals, by letter."""
_FLOAT = re.compile(r" *-?\d*\.?\d+ *")


@dataclass(frozen=True)
class DeviceError:
    """An error record of the device (docs/is900.md 6.4).

    Codes: -1 a field is missing, -2 not a number, -3 out of range, -4 frequency, -5 buffer full, -99 no such command.
    """

    command: str
    code: int
    ps: int = 1
    fl: int = 1
    st: int = 0

    def line(self) -> bytes:
        command_text = _printable(self.command)
        return _encode_line(f"2 E*ERROR*{command_text}*ERROR* EC {self.code}*PS{self.ps}  *FL{self.fl} *ST{self.st}")

    @classmethod
    def parse(cls, text: str) -> "DeviceError | None":
        match = _ERROR.match(text)
        return match and cls(_printable(match[1]), *(int(match[k] or 0) for k in range(2, 6)))


def _printable(command: str) -> str:
    """Return the part of a rejected command that an error record may repeat."""
    return re.sub(r"[^ -~]", "?", command)[:80]


_ERROR = re.compile(
    r"2.E\*ERROR\*(.*?)\*ERROR\* *EC *(-?\d{1,4})(?: *\*PS *(\d{1,4}))?(?: *\*FL *(\d{1,4}))?(?: *\*ST *(\d{1,4}))?"
)


@dataclass(frozen=True)
class UnknownReply:
    """A line that no source describes."""

    text: bytes
    """The line without its CR LF."""

    def line(self) -> bytes:
        return self.text + b"\r\n"


ParsedReply = (
    StatusRecord
    | OutputList
    | StationStates
    | GeometryReply
    | DeviceError
    | SystemRecord
    | StationRecord
    | PredictionReply
    | SensitivityReply
    | IntegerReply
    | GenlockReply
    | Emitter
    | TrackingStatus
    | UnknownReply
)

_PARSERS: tuple[Callable[[str], ParsedReply | None], ...] = (
    DeviceError.parse,
    StatusRecord.parse,
    OutputList.parse,
    StationStates.parse,
    GeometryReply.parse,
    TrackingStatus.parse,
    SystemRecord.parse,
    StationRecord.parse,
    PredictionReply.parse,
    SensitivityReply.parse,
    IntegerReply.parse,
    GenlockReply.parse,
    Emitter.parse,
)


def parse_reply(line: bytes) -> ParsedReply:
    """Parse a line, with or without its CR LF."""
    bare = line.removesuffix(b"\n").removesuffix(b"\r")
    text = bare.decode("latin-1")
    return next((reply for parse in _PARSERS if (reply := parse(text)) is not None), UnknownReply(bare))


def _encode_line(text: str) -> bytes:
    return text.encode("latin-1", "replace") + b"\r\n"
