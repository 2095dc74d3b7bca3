"""Replies that InterSense added to those of the Fastrak: lines that start with `3` (docs/is900.md 6.4 and 7)."""

import re
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
