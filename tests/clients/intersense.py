"""InterSense's own host library: detection, configuration, what it accepts as a record, and its queries while data
flow.

It follows version 1.01 for Unix (`extras/intersense/unix` of studierstube/opentracker) and 2.09
(`drivers/Intersense/IS900` of vrjuggler/vrjuggler) (docs/is900.md 11.2).
"""

import struct
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from tests.clients.tty import Tty, raw_mode

RATES = (115200, 57600, 38400, 19200, 9600)
SIZES = {0: (1, 1), 1: (2, 2), 2: (12, 21), 4: (12, 21), 11: (16, 28), 21: (4, 14), 22: (1, 5), 23: (2, 8), 40: (1, 4)}
"""Length of an item, binary and ASCII, as in the library's table [bytes]; only the items that are used here."""
KNOWN = {
    "1.01": {0, 1, 2, 4, 5, 6, 7, 11, 18, 19, 20, 21, 22},
    "2.09": {*range(3), *range(4, 8), 11, *range(18, 24)},
}
"""Item codes that each version knows in the reply to `O`."""
KNOWN["2.09"] |= {*range(38, 50)}
"""Codes that each version knows in the answer to `O`."""
ANSWER_S = 2.0
"""Longest wait for most replies; each query is sent at most twice [s]."""


@dataclass
class Station:
    """What the library stores of a station."""

    items: list[int] = field(default_factory=list)
    position_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    angles_deg: tuple[float, ...] = (0.0, 0.0, 0.0)
    time_s: float = 0.0
    quality: int = -1
    records: int = 0
    active: bool = False
    cube_number: int = 0
    enhancement: int = -1
    prediction_ms: int = -1
    sensitivity: int = -1


class InterSenseClient:
    """The library. `timeout_factor` lengthens its shortest time-outs, `scale` shortens its longest waits."""

    def __init__(self, port: str, version: str = "1.01", timeout_factor: float = 4.0, scale: float = 0.1) -> None:
        self._port, self.version, self._timeout_factor, self._scale = port, version, timeout_factor, scale
        self.tty: Tty | None = None
        self.stations = [Station() for _ in range(8)]
        self.binary = self.centimetres = self.continuous = False
        self.firmware, self.product, self.sync = "", -1, -1
        self.record_count = self.refused_count = 0
        """Data records by their CR LF, and those among them that do not have the length of the list."""
        self._partial, self._previous_byte = bytearray(), b""
        self._new_reply_types: set[str] = set()
        """Types of the replies since the latest query."""
        self._polled_s = 0.0

    # Detection and set-up

    def open(self) -> bool:
        """Look for other products at other rates, then for a tracker; set the lists of eight stations; stream."""
        if not self._detect():
            return False
        self._send(b"c")
        for number in range(1, 9):
            extra_items = ",40,22,23" if self.version == "2.09" else ""
            self._send(f"O{number},2,4{extra_items},1\r\n".encode())
            if not self._query(f"O{number}\r\n", "O"):
                return False
        for command in (b"f", b"u", b"C", b"\x11"):
            self._send(command)
        if self.version == "2.09" and not self._query("l*\r\n", "l"):
            return False
        return self.read_settings()

    def read_settings(self) -> bool:
        """Query status and genlock, while data flow."""
        if not self._query("S", "S"):
            return False
        return float(self.firmware) < 3.016 or self._query("MG\r\n", "G")

    def read_station(self, number: int) -> bool:
        """Send all queries about a station, one after another; return False when one has no reply."""
        states_query = "l*\r\n" if self.version == "2.09" else "l\r\n"
        queries = (f"O{number}\r\n", states_query, f"Ms{number}\r\n", f"Mp{number}\r\n", f"MCI{number}\r\n")
        for query, reply_type in zip((*queries, f"MQ{number}\r\n"), "OlspIQ", strict=True):
            if not self._query(query, reply_type):
                return False
        return True

    def set_station(self, number: int, prediction_ms: int, sensitivity: int, enhancement: int, items: str) -> bool:
        """Read a station's settings, write them all, and read them again."""
        if not self.read_station(number):
            return False
        self._send(f"O{number},{items}\r\n".encode())
        for name, value in (("Mp", prediction_ms), ("MQ", sensitivity), ("MF", enhancement), ("l", 1), ("MH", 2)):
            self._send(f"{name}{number},{value}\r\n".encode())
        return self.read_station(number)

    def close(self) -> None:
        if self.tty is not None:
            try:
                self._send(b"c")
                time.sleep(0.1)
            finally:
                self.tty.close()
                self.tty = None

    def _open(self) -> None:
        if self.tty is not None:
            self.tty.close()
        self.tty = Tty(self._port, raw_mode(vmin=1, vtime=5))
        self.tty.flush_both()

    def _detect(self) -> bool:
        if self.version == "1.01":
            self._open()
            self._look_for_another_product()
        for rate in RATES:
            self._open()
            self._send(b"c")
            if self.version == "2.09":
                time.sleep(0.1)
                assert self.tty is not None
                self.tty.flush_input()
                self._send(b"S")
            if self._query("MS\r\n", "S3", 0.15 * self._timeout_factor):
                if rate != RATES[0]:
                    self._send(b"o1152,N,8,0\r\n")
                    time.sleep(0.1)
                    self._open()
                return self.product == 16 and self._query("S", "S")
            if self.version == "2.09":  # this version has a known rate
                return False
        return False

    def _look_for_another_product(self) -> None:
        """Send `c` and `*reset`, twice at each of two rates, without an end of line."""
        assert self.tty is not None

        def set_another_rate() -> None:
            assert self.tty is not None
            self.tty.flush_both()

        set_another_rate()
        time.sleep(0.1)
        for _ in range(2):
            for _ in range(2):
                set_another_rate()
                self._send(b"c")
                self._wait_for_a_character()
            for _ in range(2):
                set_another_rate()
                self._send(b"*reset")
                time.sleep(0.1)
                set_another_rate()
                self._send(b"c")

    def _wait_for_a_character(self) -> None:
        assert self.tty is not None
        if self.tty.wait(0.4 * self._scale):
            self.tty.read(1024)

    def _send(self, data: bytes) -> None:
        assert self.tty is not None
        self.tty.write(data)

    def _query(self, query: str, reply_type: str, limit_s: float = ANSWER_S) -> bool:
        """Send a query, twice if needed; everything that arrives meanwhile is read as usual."""
        for _ in range(2):
            self._new_reply_types.clear()
            self._send(query.encode())
            end_s = time.monotonic() + limit_s
            while time.monotonic() < end_s:
                self.service()
                if reply_type in self._new_reply_types:
                    return True
                time.sleep(0.0005)
        return False

    # Data

    def poll(self) -> None:
        """Called by a program in a loop: polls for a record if it has to, and reads what is available."""
        if not self.continuous and time.monotonic() - self._polled_s > 0.1:
            self._polled_s = time.monotonic()
            self._send(b"P")
        self.service()

    def run(self, until: Callable[[], bool], limit_s: float) -> bool:
        """Run the loop until a condition holds; return whether it held in time."""
        end_s = time.monotonic() + limit_s
        while not until():
            if time.monotonic() > end_s:
                return False
            self.poll()
            time.sleep(0.001)
        return True

    def service(self) -> None:
        """Read from a `0`, `2` or `3`, followed by a station or a blank, to CR LF; overlong records are dropped."""
        assert self.tty is not None
        for byte in self.tty.read_available(1024):
            character, record = bytes([byte]), self._partial
            if not record:
                if character in b"023":
                    record += character
            elif len(record) == 1:
                if character in b"123456789ABCabc ":
                    record += character
                else:
                    record.clear()
            elif character == b"\n":
                record += character
                if self._previous_byte == b"\r":
                    self._parse_record(bytes(record))
                    record.clear()
            elif (len(record) >= 125 and record[:1] != b"0") or len(record) >= 199:
                record.clear()
            else:
                record += character
            self._previous_byte = character

    def _size(self, station: Station) -> int:
        items = station.items
        sent_items = items[: items.index(1) + 1] if 1 in items else items
        return 3 + sum(SIZES[code][0 if self.binary else 1] for code in sent_items if code in SIZES)

    def _parse_record(self, record: bytes) -> None:
        kind, number, reply_type = record[:1], _number(record[1:2]), record[2:3].decode("latin-1")
        text = record[3:].decode("latin-1")
        if kind == b"0":
            self.record_count += 1
            if 1 <= number <= 8:
                self._parse_data(self.stations[number - 1], record)
        elif kind == b"2" and reply_type in "SOl":
            self._new_reply_types.add(reply_type)
            if reply_type == "S":
                flags = int(record[5:6], 16)
                self.binary, self.centimetres, self.continuous = bool(flags & 1), bool(flags & 2), bool(flags & 8)
                self.firmware = record[15:21].decode().strip()
            elif reply_type == "O" and 1 <= number <= 8:
                codes = [int(text[k : k + 2]) for k in range(0, len(text) - 3, 2)]
                first_unknown = next((k for k, code in enumerate(codes) if code not in KNOWN[self.version]), len(codes))
                self.stations[number - 1].items = codes[:first_unknown]
            elif reply_type == "l":
                for station, flag in zip(self.stations, text.rstrip(), strict=False):
                    station.active = flag == "1"
        elif kind == b"3" and 1 <= number <= 8:
            station = self.stations[number - 1]
            if reply_type == "S":
                self.product = _number(record[3:4])
                self._new_reply_types.add("S3")
            elif reply_type == "s":
                station.enhancement = min(int(text[1], 16), 2)
                self._new_reply_types.add("s")
            elif reply_type == "p":
                station.prediction_ms = int(text)
                self._new_reply_types.add("p")
            elif reply_type == "Q":
                station.sensitivity = int(text)
                self._new_reply_types.add("Q")
            elif reply_type == "I" and -1 <= int(text) <= (4 if self.version == "1.01" else 12):
                station.cube_number = int(text)
                self._new_reply_types.add("I")
            elif reply_type == "G":
                self.sync = int(text.split()[0])
                self._new_reply_types.add("G")

    def _parse_data(self, station: Station, record: bytes) -> None:
        if len(record) != self._size(station):
            self.refused_count += 1
            return
        station.records += 1
        metres = 0.01 if self.centimetres else 0.0254
        offset = 3
        for code in station.items:
            width = SIZES[code][0 if self.binary else 1]
            part, offset = record[offset : offset + width], offset + width
            if code in (2, 4):
                values = struct.unpack("<3f", part) if self.binary else tuple(map(float, part.split()))
                if code == 2:
                    station.position_m = tuple(metres * value for value in values)
                else:
                    station.angles_deg = values
            elif code == 21:
                station.time_s = (struct.unpack("<f", part)[0] if self.binary else float(part)) / 1000.0
            elif code == 40:
                station.quality = part[0] if self.binary else int(part)


def _number(character: bytes) -> int:
    """Return a station or a product from its character: digits, then letters of either case; 1 for anything else."""
    if character.isalpha():
        return 10 + ord(character.lower()) - ord("a")
    return int(character) if character.isdigit() else 1
