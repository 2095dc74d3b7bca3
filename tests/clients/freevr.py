"""FreeVR's Fastrak input, re-enacted from `vr_input.fastrak.c` of version 0.6 (docs/is900.md 11.3): ASCII, polled,
`P` and `MP` by turns; records are cut by the lengths that the answers to `O` lead to.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from tests.clients.tty import Tty, raw

ASK_S, SET_S = 0.010, 0.005
"""It waits so long after a question and after a setting."""
WIDTHS = {0: 1, 1: 2, 2: 21, 4: 21, 5: 21, 6: 21, 7: 21, 11: 28, 16: 1, 22: 5, 23: 8, 40: 4}
STATIONS = "123456789ABC"


@dataclass
class Unit:
    """A station."""

    active: bool = False
    items: list[int] = field(default_factory=list)
    length: int = 0
    records: int = 0
    numbers: list[float] = field(default_factory=list)
    """Position [in] and angles [deg] of the last record."""
    quality: int = -1
    buttons: int = -1
    stick: tuple[int, int] = (-1, -1)
    tracking: str = "-"
    measured: int = -1
    rejected: int = -1


class FreeVr:
    def __init__(self, port: str, wands: str = "") -> None:
        self.tty = Tty(port, raw())
        self.units = {name: Unit() for name in STATIONS}
        self._wands = wands
        self.firmware = self.system = ""
        self.emitters: dict[int, tuple[float, ...]] = {}
        """Place [m] and normal of each, by its hardware number."""
        self.warnings: list[str] = []
        self.tracking_records = 0
        self._buffer = bytearray()
        self._got_states = False

    def open(self, limit_s: float) -> bool:
        """The set-up; False when the states of the stations never came (it would wait for ever)."""
        for command in (b"c", b"F", b"U"):
            self._send(command, SET_S)
        self._send(b"S", ASK_S)
        self._send(b"l*\n", ASK_S)
        time.sleep(0.04)
        end_s = time.monotonic() + limit_s
        while not self._got_states:
            if time.monotonic() > end_s:
                return False
            self.read()
            time.sleep(0.001)
        if self.system.lower().startswith("is900"):
            self._send(b"MCF\n", ASK_S)
            self._send(b"MP\n", ASK_S)
            time.sleep(0.04)
        for name in STATIONS:
            more = ",22,23" if name in self._wands else ""
            self._send(f"O{name},40,2,4{more},1\n\r".encode(), SET_S)
        for name, unit in self.units.items():
            if unit.active:
                self._send(f"O{name}\r".encode(), SET_S)
        self.poll()
        return True

    def poll(self) -> None:
        """Ask for a record of each station and how tracking goes, then read what is there."""
        self._send(b"P", SET_S)
        self._send(b"MP\n", ASK_S)
        self.read()

    def run(self, until: Callable[[], bool], limit_s: float) -> bool:
        end_s = time.monotonic() + limit_s
        while not until():
            if time.monotonic() > end_s:
                return False
            self.poll()
        return True

    def close(self) -> None:
        self.tty.close()

    def _send(self, data: bytes, pause_s: float) -> None:
        self.tty.write(data)
        self.tty.drain()
        time.sleep(pause_s)

    def read(self) -> None:
        """One read into a buffer of 1023 bytes, then all records in it."""
        if more := self.tty.read(1023 - len(self._buffer)):
            self._buffer += more
            while self._buffer and self._decode():
                pass

    def _skip(self, warning: str = "") -> bool:
        """The rest up to the next LF is thrown away, now or when it comes."""
        if warning:
            self.warnings.append(warning)
        self._buffer[:1] = b"_"
        return True

    def _decode(self) -> bool:
        """One record from the front; False where more bytes are needed."""
        data = self._buffer
        if len(data) < 3:
            return False
        kind, name, subtype = chr(data[0]), chr(data[1]), chr(data[2])
        if kind == "_":
            if b"\n" not in data:
                return False
            del data[: data.index(b"\n") + 1]
            return True
        if kind == "0":
            if name not in self.units or not self.units[name].length:
                return self._skip(f"bad station or length: {bytes(data[:8])!r}")
            return self._data(self.units[name])
        if kind == "2" and subtype == "S":
            if len(data) < 55:
                return False
            self.firmware, self.system = data[15:55].decode("latin-1").split()[:2]
            if data[22:27].lower() != b"is900":
                self.warnings.append(f"not an IS-900: {bytes(data[:55])!r}")
            return self._shift(55)
        if kind == "2" and subtype == "O":
            return self._list(self.units[name])
        if kind == "2" and subtype == "l":
            single = data[7:8] == b"\r"
            if len(data) < (9 if single else 37):
                return False  # the original does not look: its replies had better be there whole
            names = name if single else STATIONS
            for station, flag in zip(names, data[3:].decode("latin-1"), strict=False):
                self.units[station].active = flag == "1"
            self._got_states = True
            return self._shift(9 if single else 37)
        if kind == "3" and subtype == "P":
            return self._tracking()
        if kind == "3" and subtype == "F":
            return self._emitter()
        if kind in " \n":
            del data[:1]
            return True
        return self._skip(f"unknown record: {bytes(data[:40])!r}")

    def _shift(self, length: int) -> bool:
        if self._buffer[length - 1 : length] != b"\n":
            return self._skip(f"no LF at byte {length}: {bytes(self._buffer[:length])!r}")
        del self._buffer[:length]
        return True

    def _list(self, unit: Unit) -> bool:
        end = self._buffer.find(b"\r")
        if end < 0 or len(self._buffer) < end + 2:
            return False
        text = self._buffer[3:end].decode("latin-1")
        unit.items = [int(text[k : k + 2]) for k in range(0, len(text), 2)]
        unit.length = 3 + sum(WIDTHS[code] for code in unit.items)
        return self._shift(end + 2)

    def _data(self, unit: Unit) -> bool:
        if len(self._buffer) < unit.length:
            return False
        at, numbers = 3, []
        text = self._buffer[: unit.length].decode("latin-1")
        if text[-1] == "\n":
            for code in unit.items:
                part, at = text[at : at + WIDTHS[code]], at + WIDTHS[code]
                if code in (2, 4):
                    numbers += [float(part[k : k + 7]) for k in (0, 7, 14)]
                elif code == 40:
                    unit.quality = int(part)
                elif code == 22:
                    unit.buttons = int(part[:4])
                elif code == 23:
                    unit.stick = int(part[:4]), int(part[4:])
            unit.numbers = numbers
            unit.records += 1
        return self._shift(unit.length)

    def _tracking(self) -> bool:
        if len(self._buffer) < 48:
            return False
        text = self._buffer[:48].decode("latin-1")
        for k, unit in enumerate(self.units.values()):
            unit.tracking = text[3 + 3 * k]
            unit.measured, unit.rejected = (_hex(text[column + 3 * k]) for column in (4, 5))
        self.tracking_records += 1
        return self._shift(48)

    def _emitter(self) -> bool:
        data = self._buffer
        if len(data) < 70:
            return False
        wider = data[10:].index(b" ")  # some firmware lets the number widen the line
        if len(data) < 70 + wider:
            return False
        text = data[10 + wider : 68 + wider].decode("latin-1")
        values = [float(text[k : k + 10]) for k in (0, 10, 20)] + [float(text[k : k + 7]) for k in (30, 37, 44)]
        self.emitters[int(text[51:58])] = tuple(values)
        return self._shift(70 + wider)


def _hex(character: str) -> int:
    """Its own arithmetic, which knows lower-case letters alone."""
    value = ord(character) - ord("0")
    return value if value <= 9 else value - (ord("a") - ord("0") - 10)
