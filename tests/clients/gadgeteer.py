"""VR Juggler's Fastrak drivers: `EarlyVrJuggler` of 2006, and `VrJuggler` since 2007.

They follow `drivers/Polhemus/Fastrak/FastrakStandalone.cpp` (docs/is900.md 11.3). `VrJuggler` empties both queues right
after each command that it wrote and drained. On a serial line the command has left by then. On a pty, which does not
drain, the kernel discards it unread, and no emulator can prevent that (docs/device.md). Therefore the queue to the
device is not emptied here.
"""

import struct
import termios
import time
from collections.abc import Callable

from tests.clients.tty import Tty, raw_mode

RECORD = 33
"""Length of a binary record of 2,11,1 [bytes]."""


class ClientError(Exception):
    """An error that the original throws, or one of its assertions that fails."""


class VrJuggler:
    """Polled, binary. Stations 1 and 2 get their lists, and all active stations are assumed to have the same."""

    def __init__(self, port: str) -> None:
        self.tty = Tty(port, raw_mode(termios.IGNBRK | termios.IGNPAR))
        self.stations = 0
        self.positions_m: dict[int, tuple[float, ...]] = {}
        self.quaternions: dict[int, tuple[float, ...]] = {}
        self._metres_per_unit = 0.0254

    def open(self, answer_s: float = 1.0) -> None:
        self._send(b"c")
        self._send(b"f")
        self._read_status(answer_s)
        for station in b"12":
            self._send(b"O%c,2,11,1\r" % station)
        self._send(b"l1\r")
        states = self._read_once(9, answer_s)
        if not (len(states) == 9 and states[:1] == b"2" and states[2:3] == b"l"):
            raise ClientError(f"station status {states!r}")
        self.stations = states[3:7].count(b"1")

    def sample(self, answer_s: float = 1.0) -> None:
        """Send `P`, then read as many bytes as all stations send."""
        self._send(b"P")
        data = b""
        while len(data) < RECORD * self.stations:
            if not (new_bytes := self._read_once(RECORD * self.stations - len(data), answer_s)):
                raise ClientError(f"did not read full data record: {data!r}")
            data += new_bytes
        for offset in range(0, len(data), RECORD):
            if (
                data[offset : offset + 1] != b"0"
                or data[offset + 2 : offset + 3] != b" "
                or data[offset + 1] not in b"1234"
            ):
                raise ClientError(f"no record at {offset} of {data!r}")
            station = int(data[offset + 1 : offset + 2])
            numbers = struct.unpack_from("<7f", data, offset + 3)
            self.positions_m[station] = tuple(self._metres_per_unit * value for value in numbers[:3])
            self.quaternions[station] = numbers[3:]

    def close(self) -> None:
        self.tty.close()

    def _send(self, command: bytes) -> None:
        self.tty.flush_input()
        self.tty.write(command)

    def _read_once(self, max_bytes: int, limit_s: float) -> bytes:
        return self.tty.read(max_bytes) if self.tty.wait(limit_s) else b""

    def _read_status(self, limit_s: float) -> None:
        self._send(b"S")
        status = b""
        while len(status) < 55:
            if not (new_bytes := self._read_once(55 - len(status), limit_s)):
                raise ClientError(f"incomplete status {status!r}")
            status += new_bytes
        flags = int(status[3:6], 16)
        if not (status[:1] == b"2" and status[2:3] == b"S" and status[9:15] == b" " * 6 and flags & 0x11):
            raise ClientError(f"status {status!r}")
        self._metres_per_unit = 0.01 if flags & 2 else 0.0254


class EarlyVrJuggler:
    """Binary, centimetres, position and angles of stations 1 and 2; polled, or streaming.

    It flushes its input when a streamed record is out of step.
    """

    LENGTH = 29
    """Length of a record of 2,4,1 [bytes]."""

    def __init__(self, port: str, scale: float = 0.1) -> None:
        self.tty = Tty(port, raw_mode(termios.IGNBRK | termios.IGNPAR))
        self._scale = scale
        self.tty.flush_both()
        self.restarts = self.flushes = 0

    def open(self, stream: bool = False) -> bool:
        """Query the status, restart if there is none, then send its lines in parts."""
        if not self._status():
            self.restarts += 1
            self.tty.write(b"\x19")
            time.sleep(15.0 * self._scale)
            if not self._status():
                return False
        self._write_all(b"uf", b"e1,", b"0", b"\r")
        for station in b"12":
            number = b"%c" % station
            self._write_all(b"l", number, b",1\rO", number, b",2", b",4", b",1\r")
        for station in b"34":
            self._write_all(b"l", b"%c" % station, b",0\r")
        self.tty.write(b"C" if stream else b"c")
        return True

    def sample(self, until: Callable[[], bool], stream: bool = False) -> tuple[bytes, bytes] | None:
        """Return the records of stations 1 and 2 once they are where they should be; None where `until` held first."""
        while not until():
            if not stream:
                self.tty.write(b"P")
            data = b""
            while len(data) < 2 * self.LENGTH and not until():
                if self.tty.wait(0.1):
                    data += self.tty.read(2 * self.LENGTH - len(data))
            if data[:2] == b"01" and data[self.LENGTH : self.LENGTH + 2] == b"02":
                return data[: self.LENGTH], data[self.LENGTH :]
            self.flushes += 1
            if stream:
                self.tty.write(b"c")
                time.sleep(100.0 / 115200)
                self.tty.flush_input()
                time.sleep(100.0 / 115200)
                self.tty.write(b"C")
            else:
                self.tty.flush_input()
        return None

    def close(self) -> None:
        self.tty.write(b"c")
        time.sleep(1.0 * self._scale)
        self.tty.flush_input()
        self.tty.close()

    def _write_all(self, *parts: bytes) -> None:
        for part in parts:
            self.tty.write(part)

    def _status(self) -> bool:
        """Send `c`, empty both queues at once, send `S`; then expect `2`, a station and `S` within 1000 bytes, and a
        line.
        """
        self.tty.write(b"c")
        self.tty.flush_both()
        time.sleep(0.1)
        self.tty.write(b"S")
        head, waits = b"", 0
        while not (len(head) > 2 and head[-3:-2] == b"2" and head[-2] in b"1234" and head[-1:] == b"S"):
            if not self.tty.wait(0.1):
                waits += 1
            head += self.tty.read(1)
            if waits >= 100 * self._scale or len(head) > 1000:
                return False
        line = b""
        while not line.endswith(b"\r\n"):
            if not self.tty.wait(10.0 * self._scale):
                return False
            line += self.tty.read(1)
        return True
