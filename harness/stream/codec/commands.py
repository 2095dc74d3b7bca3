"""Commands that a host sends to an IS-900, as bytes, and a parser of such bytes (docs/is900.md 3 and 4).

Nine letters act at once; so do four control characters, wherever they occur. Every other command is a line. The
functions here end lines with CR LF, as the manuals do. Stations are named by their characters, "1" to "9" and "A" to
"C".
"""

from collections.abc import Sequence
from dataclasses import dataclass

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


def _line(text: str) -> bytes:
    return text.encode("ascii") + b"\r\n"


def set_output_list(station: str, items: Sequence[int]) -> bytes:
    """Command that sets the output list of a station; it has no reply."""
    return _line(f"O{station}," + ",".join(map(str, items)))


def query_output_list(station: str) -> bytes:
    """Command that queries the output list of a station."""
    return _line(f"O{station}")


def switch_station(station: str, active: bool) -> bytes:
    """Command that switches a station on or off; it has no reply."""
    return _line(f"l{station},{int(active)}")


def boresight(station: str) -> bytes:
    """Command that makes the present direction of the station heading 0."""
    return _line(f"B{station}")


def undo_boresight(station: str) -> bytes:
    """Command that undoes the boresight of a station."""
    return _line(f"b{station}")


def alignment(station: str, origin_cm: Sequence[float], on_x_cm: Sequence[float], on_y_cm: Sequence[float]) -> bytes:
    """Command that sets a new frame: its origin, a point on its X axis and one on its Y axis, in the present frame
    [cm].
    """
    return _line(f"A{station}," + ",".join(f"{value:.2f}" for value in (*origin_cm, *on_x_cm, *on_y_cm)))


def undo_alignment(station: str) -> bytes:
    """Command that resets the frame of a station."""
    return _line(f"R{station}")


def query_geometry(station: str, letter: str) -> bytes:
    """Command that queries alignment (`A`), boresight reference angles (`G`) or tip offset (`N`)."""
    return _line(f"{letter}{station}")


def set_geometry(station: str, letter: str, values: Sequence[float]) -> bytes:
    """Command that sets the boresight reference angles (`G`) [deg] or the tip offset (`N`) [cm]."""
    return _line(f"{letter}{station}," + ",".join(f"{value:.3f}" for value in values))


def query_prediction(station: str) -> bytes:
    """Command that queries the prediction interval."""
    return _line(f"Mp{station}")


def query_sensitivity(station: str) -> bytes:
    """Command that queries the sensitivity to rotation."""
    return _line(f"MQ{station}")


def query_station(station: str) -> bytes:
    """Command that queries the station record: filter and compass."""
    return _line(f"Ms{station}")


def prediction(station: str, ahead_ms: int) -> bytes:
    """Command that sets the prediction interval, 0 to 50 ms."""
    return _line(f"Mp{station},{ahead_ms}")


def enhancement(station: str, mode: int) -> bytes:
    """Command that sets the filter: 0 most exact, 1 less jitter, 2 for head displays."""
    return _line(f"MF{station},{mode}")


def sensitivity(station: str, level: int) -> bytes:
    """Command that sets the sensitivity to rotation, 1 to 5."""
    return _line(f"MQ{station},{level}")


def serial_line(baud: int) -> bytes:
    """Command that sets the device's baud rate [bit/s], with 8N1 and no handshake."""
    return _line(f"o{baud // 100},N,8,0")


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

    def __init__(self) -> None:
        self._line = bytearray()
        self._cut = False

    def feed(self, data: bytes) -> list[Command]:
        """Return the commands that these bytes complete."""
        out: list[Command] = []
        for byte in data:
            if byte in CONTROL_CHARACTERS or (not self._line and byte in IMMEDIATE_LETTERS):
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
