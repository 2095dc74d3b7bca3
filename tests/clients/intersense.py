"""InterSense's own host library, re-enacted: 1.01 for Unix (`extras/intersense/unix` of studierstube/opentracker) and
2.09 (`drivers/Intersense/IS900` of vrjuggler/vrjuggler) (docs/is900.md 11.2): detection, configuration, what it takes
for a record, and its questions while data flow.
"""

import struct
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from tests.clients.tty import Tty, raw

RATES = (115200, 57600, 38400, 19200, 9600)
SIZES = {0: (1, 1), 1: (2, 2), 2: (12, 21), 4: (12, 21), 11: (16, 28), 21: (4, 14), 22: (1, 5), 23: (2, 8), 40: (1, 4)}
"""Bytes of an item, binary and ASCII, as its table has them (those of them that are asked for here)."""
KNOWN = {"1.01": {0, 1, 2, 4, 5, 6, 7, 11, 18, 19, 20, 21, 22}, "2.09": {*range(3), *range(4, 8), 11, *range(18, 24)}}
KNOWN["2.09"] |= {*range(38, 50)}
"""Codes that each version knows in the answer to `O`."""
ANSWER_S = 2.0
"""Most answers may take so long, and are asked for twice."""


@dataclass
class Station:
    """What the library holds of a station."""

    items: list[int] = field(default_factory=list)
    position_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    angles_deg: tuple[float, ...] = (0.0, 0.0, 0.0)
    time_s: float = 0.0
    quality: int = -1
    records: int = 0
    active: bool = False
    cube: int = 0
    enhancement: int = -1
    prediction_ms: int = -1
    sensitivity: int = -1


class Library:
    """`patience` lengthens its shortest time-outs, `scale` shortens its longest waits."""

    def __init__(self, port: str, version: str = "1.01", patience: float = 4.0, scale: float = 0.1) -> None:
        self._port, self.version, self._patience, self._scale = port, version, patience, scale
        self.tty: Tty | None = None
        self.stations = [Station() for _ in range(8)]
        self.binary = self.centimetres = self.continuous = False
        self.firmware, self.product, self.sync = "", -1, -1
        self.counted = self.refused = 0
        """Data records by their CR LF, and those among them whose length was not that of the list."""
        self._record, self._before = bytearray(), b""
        self._news: set[str] = set()
        """Subtypes of replies since it last asked."""
        self._asked_s = 0.0

    # Detection and set-up

    def open(self) -> bool:
        """Look for other products at other rates, then for a tracker; lists of eight stations; stream."""
        if not self._detect():
            return False
        self._say(b"c")
        for number in range(1, 9):
            more = ",40,22,23" if self.version == "2.09" else ""
            self._say(f"O{number},2,4{more},1\r\n".encode())
            if not self._ask(f"O{number}\r\n", "O"):
                return False
        for command in (b"f", b"u", b"C", b"\x11"):
            self._say(command)
        if self.version == "2.09" and not self._ask("l*\r\n", "l"):
            return False
        return self.read_settings()

    def read_settings(self) -> bool:
        """Status and genlock, while data flow."""
        if not self._ask("S", "S"):
            return False
        return float(self.firmware) < 3.016 or self._ask("MG\r\n", "G")

    def read_station(self, number: int) -> bool:
        """All questions about a station, one after another; False when one stays without an answer."""
        states = "l*\r\n" if self.version == "2.09" else "l\r\n"
        questions = (f"O{number}\r\n", states, f"Ms{number}\r\n", f"Mp{number}\r\n", f"MCI{number}\r\n")
        for question, subtype in zip((*questions, f"MQ{number}\r\n"), "OlspIQ", strict=True):
            if not self._ask(question, subtype):
                return False
        return True

    def set_station(self, number: int, prediction_ms: int, sensitivity: int, enhancement: int, items: str) -> bool:
        """Read a station's settings, write them all, read them again."""
        if not self.read_station(number):
            return False
        self._say(f"O{number},{items}\r\n".encode())
        for name, value in (("Mp", prediction_ms), ("MQ", sensitivity), ("MF", enhancement), ("l", 1), ("MH", 2)):
            self._say(f"{name}{number},{value}\r\n".encode())
        return self.read_station(number)

    def close(self) -> None:
        if self.tty is not None:
            try:
                self._say(b"c")
                time.sleep(0.1)
            finally:
                self.tty.close()
                self.tty = None

    def _open(self) -> None:
        if self.tty is not None:
            self.tty.close()
        self.tty = Tty(self._port, raw(vmin=1, vtime=5))
        self.tty.flush_both()

    def _detect(self) -> bool:
        if self.version == "1.01":
            self._open()
            self._look_for_another_product()
        for rate in RATES:
            self._open()
            self._say(b"c")
            if self.version == "2.09":
                time.sleep(0.1)
                assert self.tty is not None
                self.tty.flush_input()
                self._say(b"S")
            if self._ask("MS\r\n", "S3", 0.15 * self._patience):
                if rate != RATES[0]:
                    self._say(b"o1152,N,8,0\r\n")
                    time.sleep(0.1)
                    self._open()
                return self.product == 16 and self._ask("S", "S")
            if self.version == "2.09":  # knows its rate
                return False
        return False

    def _look_for_another_product(self) -> None:
        """`c` and `*reset`, twice at each of two rates, without an end of line."""
        assert self.tty is not None

        def another_rate() -> None:
            assert self.tty is not None
            self.tty.flush_both()

        another_rate()
        time.sleep(0.1)
        for _ in range(2):
            for _ in range(2):
                another_rate()
                self._say(b"c")
                self._wait_for_a_character()
            for _ in range(2):
                another_rate()
                self._say(b"*reset")
                time.sleep(0.1)
                another_rate()
                self._say(b"c")

    def _wait_for_a_character(self) -> None:
        assert self.tty is not None
        if self.tty.wait(0.4 * self._scale):
            self.tty.read(1024)

    def _say(self, data: bytes) -> None:
        assert self.tty is not None
        self.tty.write(data)

    def _ask(self, question: str, subtype: str, limit_s: float = ANSWER_S) -> bool:
        """Twice, if need be; all that comes meanwhile is read as ever."""
        for _ in range(2):
            self._news.clear()
            self._say(question.encode())
            end_s = time.monotonic() + limit_s
            while time.monotonic() < end_s:
                self.service()
                if subtype in self._news:
                    return True
                time.sleep(0.0005)
        return False

    # Data

    def poll(self) -> None:
        """What a program calls in a loop: asks for a record where it has to, reads what there is."""
        if not self.continuous and time.monotonic() - self._asked_s > 0.1:
            self._asked_s = time.monotonic()
            self._say(b"P")
        self.service()

    def run(self, until: Callable[[], bool], limit_s: float) -> bool:
        """The loop; says whether it came true in time."""
        end_s = time.monotonic() + limit_s
        while not until():
            if time.monotonic() > end_s:
                return False
            self.poll()
            time.sleep(0.001)
        return True

    def service(self) -> None:
        """From a `0`, `2` or `3` with a station or a blank after it up to CR LF; overlong ones are dropped."""
        assert self.tty is not None
        for byte in self.tty.read_available(1024):
            character, record = bytes([byte]), self._record
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
                if self._before == b"\r":
                    self._take(bytes(record))
                    record.clear()
            elif (len(record) >= 125 and record[:1] != b"0") or len(record) >= 199:
                record.clear()
            else:
                record += character
            self._before = character

    def _size(self, station: Station) -> int:
        items = station.items
        wanted = items[: items.index(1) + 1] if 1 in items else items
        return 3 + sum(SIZES[code][0 if self.binary else 1] for code in wanted if code in SIZES)

    def _take(self, record: bytes) -> None:
        kind, number, subtype = record[:1], _number(record[1:2]), record[2:3].decode("latin-1")
        text = record[3:].decode("latin-1")
        if kind == b"0":
            self.counted += 1
            if 1 <= number <= 8:
                self._data(self.stations[number - 1], record)
        elif kind == b"2" and subtype in "SOl":
            self._news.add(subtype)
            if subtype == "S":
                flags = int(record[5:6], 16)
                self.binary, self.centimetres, self.continuous = bool(flags & 1), bool(flags & 2), bool(flags & 8)
                self.firmware = record[15:21].decode().strip()
            elif subtype == "O" and 1 <= number <= 8:
                codes = [int(text[k : k + 2]) for k in range(0, len(text) - 3, 2)]
                bad = next((k for k, code in enumerate(codes) if code not in KNOWN[self.version]), len(codes))
                self.stations[number - 1].items = codes[:bad]
            elif subtype == "l":
                for station, flag in zip(self.stations, text.rstrip(), strict=False):
                    station.active = flag == "1"
        elif kind == b"3" and 1 <= number <= 8:
            station = self.stations[number - 1]
            if subtype == "S":
                self.product = _number(record[3:4])
                self._news.add("S3")
            elif subtype == "s":
                station.enhancement = min(int(text[1], 16), 2)
                self._news.add("s")
            elif subtype == "p":
                station.prediction_ms = int(text)
                self._news.add("p")
            elif subtype == "Q":
                station.sensitivity = int(text)
                self._news.add("Q")
            elif subtype == "I" and -1 <= int(text) <= 4:
                station.cube = int(text)
                self._news.add("I")
            elif subtype == "G":
                self.sync = int(text.split()[0])
                self._news.add("G")

    def _data(self, station: Station, record: bytes) -> None:
        if len(record) != self._size(station):
            self.refused += 1
            return
        station.records += 1
        metres = 0.01 if self.centimetres else 0.0254
        at = 3
        for code in station.items:
            width = SIZES[code][0 if self.binary else 1]
            part, at = record[at : at + width], at + width
            if code in (2, 4):
                three = struct.unpack("<3f", part) if self.binary else tuple(map(float, part.split()))
                if code == 2:
                    station.position_m = tuple(metres * value for value in three)
                else:
                    station.angles_deg = three
            elif code == 21:
                station.time_s = (struct.unpack("<f", part)[0] if self.binary else float(part)) / 1000.0
            elif code == 40:
                station.quality = part[0] if self.binary else int(part)


def _number(character: bytes) -> int:
    """A station or a product as one character: digits, then letters of either case; 1 for anything else."""
    if character.isalpha():
        return 10 + ord(character.lower()) - ord("a")
    return int(character) if character.isdigit() else 1
