"""Vrui's device daemon: binary records, which it finds by the CR LF of the previous record.

It follows `VRDevices/InterSense.cpp` (docs/is900.md 11.3).
"""

import struct
import time
from dataclasses import dataclass

from tests.clients.tty import Tty, raw_mode


class Timeout(Exception):
    """Raised where the original would wait for ever."""


@dataclass(frozen=True)
class Pose:
    """One record."""

    station: int
    position_in: tuple[float, ...]
    angles_deg: tuple[float, ...]
    buttons: int
    stick: tuple[int, int]


class VruiClient:
    def __init__(self, port: str, scale: float = 0.2) -> None:
        self.tty = Tty(port, raw_mode(vmin=1))
        self._scale = scale
        self._buffer = bytearray()
        self.poses: list[Pose] = []
        self.lost_syncs = 0
        self.emitters: list[tuple[float, ...]] = []
        self.active_stations: list[int] = []
        """Stations that were active when the client started."""

    def open(
        self,
        stations: tuple[int, ...],
        reset: bool = False,
        probe: bool = False,
        upload: tuple[tuple[float, ...], ...] = (),
    ) -> bool:
        """Configure the device; return False when it does not respond."""
        if reset:
            self._restart()
        else:
            self._write("c")
        self._write("S")
        if not self._status():
            self._restart()
            self._write("S")
            if not self._status():
                return False
        self._write("l*\r\n")
        self._pause()
        flags = self._line(time.monotonic() + 1.0)
        if not flags.startswith("21l"):
            return False
        self.active_stations = [number for number in range(1, 33) if flags[2 + number] == "1"]
        for number in self.active_stations:
            self._command(f"l{number},0")
        if probe:
            self._command("MCF")
            while (line := self._line(time.monotonic() + 1.0)).startswith("31F"):
                self.emitters.append(tuple(map(float, line[3:].split())))
        if upload:
            self._command("MCC")
            for k, values in enumerate(upload):
                position, normal = (
                    ", ".join(f"{v:{width}f}" for v in values[offset : offset + 3]) for offset, width in _WIDTHS
                )
                self._command(f"MCF{k + 1}, {position}, {normal}, {5001 + k}")
            self._command("MCe")
        for number in stations:
            tip_offset = ",".join(f"{0.0:8.4f}" for _ in range(3))
            for command in (f"l{number},1", f"R{number}", f"b{number}", f"N{number},{tip_offset}"):
                self._command(command)
            for command in (f"O{number},2,4,22,23,1", f"Mp{number},0", f"MF{number},2", f"MQ{number},3"):
                self._command(command)
        self._command("ML1")
        self._write("U")
        self._pause()
        self._write("f")
        return True

    def start(self) -> None:
        self._write("C")

    def stop(self) -> None:
        self._write("c")

    def close(self) -> None:
        self.tty.close()

    def process(self, count: int, limit_s: float) -> None:
        """Read `count` records; raise Timeout when they do not arrive."""
        end_s = time.monotonic() + limit_s
        for _ in range(count):
            self._record(end_s)

    def _restart(self) -> None:
        self._write("\x19")
        time.sleep(15.0 * self._scale)

    def _write(self, text: str) -> None:
        self.tty.write(text.encode())

    def _command(self, text: str) -> None:
        self._write(text + "\r\n")
        self._pause()

    def _pause(self) -> None:
        time.sleep(0.1 * self._scale)

    def _character(self, end_s: float) -> str:
        while not self._buffer:
            if not self.tty.wait(end_s - time.monotonic()):
                raise Timeout
            self._buffer += self.tty.read(4096)
        return chr(self._buffer.pop(0))

    def _line(self, end_s: float) -> str:
        """Return a line up to CR LF, or what arrived in time.

        A CR alone is skipped together with its next character.
        """
        out, after_cr = "", False
        try:
            while True:
                character = self._character(end_s)
                if after_cr and character == "\n":
                    return out
                if not after_cr and character != "\r":
                    out += character
                after_cr = not after_cr and character == "\r"
        except Timeout:
            return out

    def _status(self) -> bool:
        """Skip everything before a `2`, a station from 1 to 4 and `S`, then read a line."""
        end_s, head = time.monotonic() + 10.0, ""
        try:
            while not (len(head) == 3 and head[0] == "2" and head[1] in "1234" and head[2] == "S"):
                head = (head + self._character(end_s))[-3:]
        except Timeout:
            return False
        self._line(end_s)
        return True

    def _record(self, end_s: float) -> None:
        head = "".join(self._character(end_s) for _ in range(5))
        if not _is_head(head):
            self.lost_syncs += 1
            while not _is_head(head):
                head = (head + self._character(end_s))[-5:]
        body = bytes(ord(self._character(end_s)) for _ in range(27))
        numbers = struct.unpack("<6f", body[:24])
        self.poses.append(Pose(int(head[3], 36), numbers[:3], numbers[3:], body[24], (body[25], body[26])))


_WIDTHS = ((0, "8.4"), (3, "6.3"))
"""Where position and normal of an emitter begin, and how their numbers are printed."""


def _is_head(text: str) -> bool:
    """Whether the text is CR LF of the previous record, `0`, a station, and a blank or letter."""
    return text[:3] == "\r\n0" and text[3].isalnum() and (text[4] == " " or text[4].isalpha())
