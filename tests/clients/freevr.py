"""FreeVR's Fastrak input: ASCII, polled with `P` and `MP` in turn; records are split by the lengths from the replies to
`O`.

It follows `vr_input.fastrak.c` of version 0.6 (docs/is900.md 11.3).
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from tests.clients.tty import Tty, raw_mode

QUERY_WAIT_S, SETTER_WAIT_S = 0.010, 0.005
"""Waits after a query and after a setting [s]."""
WIDTHS = {0: 1, 1: 2, 2: 21, 4: 21, 5: 21, 6: 21, 7: 21, 11: 28, 16: 1, 22: 5, 23: 8, 40: 4}
STATIONS = "123456789ABC"


@dataclass
class FreeVrStation:
    """State of a station."""

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


class FreeVrClient:
    def __init__(self, port: str, wands: str = "") -> None:
        self.tty = Tty(port, raw_mode())
        self.stations = {name: FreeVrStation() for name in STATIONS}
        self._wands = wands
        self.firmware = self.system = ""
        self.emitters: dict[int, tuple[float, ...]] = {}
        """Position [m] and normal of each emitter, by its hardware number."""
        self.warnings: list[str] = []
        self.tracking_records = 0
        self._buffer = bytearray()
        self._has_states = False

    def open(self, limit_s: float) -> bool:
        """Configure the device; return False when the station states never arrived (the original waits for ever)."""
        for command in (b"c", b"F", b"U"):
            self._send(command, SETTER_WAIT_S)
        self._send(b"S", QUERY_WAIT_S)
        self._send(b"l*\n", QUERY_WAIT_S)
        time.sleep(0.04)
        end_s = time.monotonic() + limit_s
        while not self._has_states:
            if time.monotonic() > end_s:
                return False
            self.read()
            time.sleep(0.001)
        if self.system.lower().startswith("is900"):
            self._send(b"MCF\n", QUERY_WAIT_S)
            self._send(b"MP\n", QUERY_WAIT_S)
            time.sleep(0.04)
        for name in STATIONS:
            new_bytes = ",22,23" if name in self._wands else ""
            self._send(f"O{name},40,2,4{new_bytes},1\n\r".encode(), SETTER_WAIT_S)
        for name, station in self.stations.items():
            if station.active:
                self._send(f"O{name}\r".encode(), SETTER_WAIT_S)
        self.poll()
        return True

    def poll(self) -> None:
        """Request a record of each station and the tracking status, then read what is available."""
        self._send(b"P", SETTER_WAIT_S)
        self._send(b"MP\n", QUERY_WAIT_S)
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
        """Read once into a buffer of 1023 bytes, then parse all records in it."""
        if new_bytes := self.tty.read(1023 - len(self._buffer)):
            self._buffer += new_bytes
            while self._buffer and self._decode():
                pass

    def _skip_line(self, warning: str = "") -> bool:
        """Discard the rest up to the next LF, now or when it arrives."""
        if warning:
            self.warnings.append(warning)
        self._buffer[:1] = b"_"
        return True

    def _decode(self) -> bool:
        """Parse one record from the front; return False where more bytes are needed."""
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
            if name not in self.stations or not self.stations[name].length:
                return self._skip_line(f"bad station or length: {bytes(data[:8])!r}")
            return self._parse_data(self.stations[name])
        if kind == "2" and subtype == "S":
            if len(data) < 55:
                return False
            self.firmware, self.system = data[15:55].decode("latin-1").split()[:2]
            if data[22:27].lower() != b"is900":
                self.warnings.append(f"not an IS-900: {bytes(data[:55])!r}")
            return self._consume(55)
        if kind == "2" and subtype == "O":
            return self._parse_list(self.stations[name])
        if kind == "2" and subtype == "l":
            is_single = data[7:8] == b"\r"
            if len(data) < (9 if is_single else 37):
                return False  # the original does not check: it needs complete replies
            names = name if is_single else STATIONS
            for station, flag in zip(names, data[3:].decode("latin-1"), strict=False):
                self.stations[station].active = flag == "1"
            self._has_states = True
            return self._consume(9 if is_single else 37)
        if kind == "3" and subtype == "P":
            return self._parse_tracking()
        if kind == "3" and subtype == "F":
            return self._parse_emitter()
        if kind in " \n":
            del data[:1]
            return True
        return self._skip_line(f"unknown record: {bytes(data[:40])!r}")

    def _consume(self, length: int) -> bool:
        if self._buffer[length - 1 : length] != b"\n":
            return self._skip_line(f"no LF at byte {length}: {bytes(self._buffer[:length])!r}")
        del self._buffer[:length]
        return True

    def _parse_list(self, station: FreeVrStation) -> bool:
        end = self._buffer.find(b"\r")
        if end < 0 or len(self._buffer) < end + 2:
            return False
        text = self._buffer[3:end].decode("latin-1")
        station.items = [int(text[k : k + 2]) for k in range(0, len(text), 2)]
        station.length = 3 + sum(WIDTHS[code] for code in station.items)
        return self._consume(end + 2)

    def _parse_data(self, station: FreeVrStation) -> bool:
        if len(self._buffer) < station.length:
            return False
        offset, numbers = 3, []
        text = self._buffer[: station.length].decode("latin-1")
        if text[-1] == "\n":
            for code in station.items:
                part, offset = text[offset : offset + WIDTHS[code]], offset + WIDTHS[code]
                if code in (2, 4):
                    numbers += [float(part[k : k + 7]) for k in (0, 7, 14)]
                elif code == 40:
                    station.quality = int(part)
                elif code == 22:
                    station.buttons = int(part[:4])
                elif code == 23:
                    station.stick = int(part[:4]), int(part[4:])
            station.numbers = numbers
            station.records += 1
        return self._consume(station.length)

    def _parse_tracking(self) -> bool:
        if len(self._buffer) < 48:
            return False
        text = self._buffer[:48].decode("latin-1")
        for k, station in enumerate(self.stations.values()):
            station.tracking = text[3 + 3 * k]
            station.measured, station.rejected = (_hex(text[column + 3 * k]) for column in (4, 5))
        self.tracking_records += 1
        return self._consume(48)

    def _parse_emitter(self) -> bool:
        data = self._buffer
        if len(data) < 70:
            return False
        extra_bytes = data[10:].index(b" ")  # in some firmware the number widens the line
        if len(data) < 70 + extra_bytes:
            return False
        text = data[10 + extra_bytes : 68 + extra_bytes].decode("latin-1")
        values = [float(text[k : k + 10]) for k in (0, 10, 20)] + [float(text[k : k + 7]) for k in (30, 37, 44)]
        self.emitters[int(text[51:58])] = tuple(values)
        return self._consume(70 + extra_bytes)


def _hex(character: str) -> int:
    """The original's own arithmetic, which knows only lower-case letters."""
    value = ord(character) - ord("0")
    return value if value <= 9 else value - (ord("a") - ord("0") - 10)
