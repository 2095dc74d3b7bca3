"""What an IS-900 says besides data, as values: a line into one of them, and each into its line (docs/is900.md 6, 7).

`parse_reply` never fails: what no source describes is `UnknownReply`. `line()` is what the device sends, with its CR LF, so that
an emulator says what a driver reads. Stations are their characters, "1" to "9" and "A" to "C".
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

from harness.stream.codec.replies_intersense import (
    Emitter,
    GenlockReply,
    IntegerReply,
    PredictionReply,
    SensitivityReply,
    StationRecord,
    SystemRecord,
    TrackingStatus,
)

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
    """The answer to `S`: 55 bytes, or 54 from some firmware (6.1)."""

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
    """Three characters when something is amiss."""
    reserved: int = 0x3F0
    """The flags above these four."""
    short: bool = False
    """Whether it has 54 bytes."""

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
    """The answer to `O{st}` (6.2)."""

    station: str
    items: tuple[int, ...]

    def line(self) -> bytes:
        return _encode_line(f"2{self.station}O" + "".join(f"{code:2d}" for code in self.items))

    @classmethod
    def parse(cls, text: str) -> "OutputList | None":
        found = re.fullmatch(r"2([1-9A-C])O((?:[ 1-9]\d)*)", text)
        return found and cls(found[1], tuple(int(found[2][k : k + 2]) for k in range(0, len(found[2]), 2)))


@dataclass(frozen=True)
class StationStates:
    """The answer to `l{st}` or `l*` (6.3)."""

    station: str | None
    """The one asked for; None for all."""
    active: tuple[bool, ...]
    """(4,) the station asked for, then stations 2, 3 and 4; (32,) all."""

    def line(self) -> bytes:
        return _encode_line(f"2{self.station or '1'}l" + "".join("01"[on] for on in self.active))

    @classmethod
    def parse(cls, text: str) -> "StationStates | None":
        found = re.fullmatch(r"2([1-9A-C])l([01]{4}|[01]{32})", text)
        return found and cls(None if len(found[2]) == 32 else found[1], tuple(digit == "1" for digit in found[2]))

    @property
    def stations(self) -> tuple[str, ...]:
        """Those that are known to be active; of 32 flags, the twelve that the protocol can name."""
        named = _STATIONS if self.station is None else dict.fromkeys((self.station, *"234"))
        first = dict(zip((self.station, *"234"), self.active, strict=False))
        flags = dict(zip(_STATIONS, self.active, strict=False)) if self.station is None else first
        return tuple(sorted(name for name in named if flags[name]))


@dataclass(frozen=True)
class GeometryReply:
    """The answer to a question for a station's settings: alignment `A` [cm], mounting angles `G` [deg], boresight
    reference `H` [deg], tip offset `N` [cm] or envelope `V` [m].

    The widths are those of section 14; the decimals of `N` and `V` are a guess, so nothing should rely on them.
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
        fields = [text[3 + k * width : 3 + (k + 1) * width] for k in range(count)]
        if not fields or len(text) != 3 + count * width or not all(_FLOAT.fullmatch(field) for field in fields):
            return None
        return cls(text[1], text[2], tuple(map(float, fields)))


_GEOMETRY_COLUMNS = {"A": (9, 7, 2), "G": (3, 7, 2), "H": (3, 7, 2), "N": (3, 8, 3), "V": (6, 8, 3)}
"""How many, how wide, how many decimals."""
_FLOAT = re.compile(r" *-?\d*\.?\d+ *")


@dataclass(frozen=True)
class DeviceError:
    """What the device could not do (6.4): -1 a field is missing, -2 not a number, -3 out of range, -4 frequency,
    -5 buffer full, -99 no such command."""

    command: str
    code: int
    ps: int = 1
    fl: int = 1
    st: int = 0

    def line(self) -> bytes:
        said = _printable(self.command)
        return _encode_line(f"2 E*ERROR*{said}*ERROR* EC {self.code}*PS{self.ps}  *FL{self.fl} *ST{self.st}")

    @classmethod
    def parse(cls, text: str) -> "DeviceError | None":
        found = _ERROR.match(text)
        return found and cls(_printable(found[1]), *(int(found[k] or 0) for k in range(2, 6)))


def _printable(command: str) -> str:
    """What a line may repeat of a command that was not understood."""
    return re.sub(r"[^ -~]", "?", command)[:80]


_ERROR = re.compile(
    r"2.E\*ERROR\*(.*?)\*ERROR\* *EC *(-?\d{1,4})(?: *\*PS *(\d{1,4}))?(?: *\*FL *(\d{1,4}))?(?: *\*ST *(\d{1,4}))?"
)


@dataclass(frozen=True)
class UnknownReply:
    """A line that no source describes."""

    text: bytes
    """Without its CR LF."""

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
    """What a line says, with or without its CR LF."""
    bare = line.removesuffix(b"\n").removesuffix(b"\r")
    text = bare.decode("latin-1")
    return next((found for read in _PARSERS if (found := read(text)) is not None), UnknownReply(bare))


def _encode_line(text: str) -> bytes:
    return text.encode("latin-1", "replace") + b"\r\n"
