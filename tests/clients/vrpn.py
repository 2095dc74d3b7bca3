"""VRPN's Fastrak tracker with its IS-900 options: what it sends, how long it waits, what it accepts, how it recovers.

It follows `vrpn_Tracker_Fastrak.C`, `vrpn_Serial.C` and `vrpn_Tracker.C` of version 07.38 (docs/is900.md 11.1).
"""

import struct
import termios
import time
from collections.abc import Callable
from dataclasses import dataclass

from tests.clients.tty import Tty, raw_mode

INCH_M = 0.0254
WATCHDOG_S = 2.0
"""The port is reopened after this long without a report [s]."""
RESETTING, SYNCING, AWAITING_STATION, PARTIAL, FAIL = "resetting", "syncing", "awaiting station", "partial", "fail"


@dataclass(frozen=True)
class Report:
    """A report that a VRPN server would send to its clients."""

    sensor: int
    """Number of the sensor, from 0."""
    time_s: float
    """Host clock as VRPN computes it [s]."""
    read_s: float
    """Host clock when the report was complete [s]."""
    position_m: tuple[float, ...]
    quaternion_xyzw: tuple[float, ...]
    buttons: int | None = None
    stick: tuple[float, float] | None = None


class VrpnClient:
    """Call `mainloop` as often as possible.

    `scale` shortens the waits of a reset; `answer_s` is the wait after `S` [s].
    """

    def __init__(
        self,
        port: str,
        *,
        is900_time: bool = False,
        styluses: tuple[int, ...] = (),
        wands: tuple[int, ...] = (),
        extra: str = "",
        stations: int = 4,
        scale: float = 0.05,
        answer_s: float = 1.0,
    ) -> None:
        self._port, self._has_time, self._extra, self._scale = port, is900_time, extra, scale
        self._answer_s = answer_s
        self._stations = min(stations, 4)
        self._buttons: set[int] = set()
        self._sticks: set[int] = set()
        self.reports: list[Report] = []
        self.log: list[str] = []
        """What it prints, shortened."""
        self.resets = 0
        """Attempts since the last successful one."""
        self.tty: Tty | None = self._open()
        self.sent, self.received = bytearray(), bytearray()
        """Bytes of the ports that have been closed."""
        self._zero_s = 0.0
        self._buffer = b""
        self._sensor = 0
        self.status = RESETTING
        self._last_report_s = time.time()
        for sensor in (*styluses, *wands):
            self._buttons.add(sensor)
            self._set_list(sensor)
        for sensor in wands:
            self._sticks.add(sensor)
            self._set_list(sensor)

    def _open(self) -> Tty | None:
        try:
            return Tty(self._port, raw_mode(termios.IGNBRK | termios.IGNPAR))
        except OSError:
            self.log.append("cannot open serial port")
            return None

    def close(self) -> None:
        if self.tty is not None:
            self.tty.close()
            self.sent += self.tty.sent
            self.received += self.tty.received
            self.tty = None

    @property
    def all_sent(self) -> bytes:
        return bytes(self.sent) + (bytes(self.tty.sent) if self.tty else b"")

    @property
    def resyncs(self) -> list[str]:
        """Complaints while it read records."""
        return [line for line in self.log if "sync" in line]

    def serve(self, until: Callable[[], bool], limit_s: float) -> bool:
        """Run a server's loop until a condition holds or the time is over; return whether it holds."""
        end_s = time.monotonic() + limit_s
        while not until():
            if time.monotonic() > end_s:
                return False
            self.mainloop()
            time.sleep(0.001)
        return True

    def mainloop(self) -> None:
        if self.status == RESETTING:
            self._reset()
        elif self.status == FAIL:
            self.log.append("tracker failed, trying to reset")
            self.close()
            self.tty = self._open()
            self.status = RESETTING
        else:
            while self._get_report():
                pass
            elapsed_us = (int((time.time() - self._last_report_s) * 1e6) + 2**31) % 2**32 - 2**31  # an int32 of C
            if self.status != FAIL and elapsed_us > WATCHDOG_S * 1e6:
                self.log.append("tracker failed to read")
                self.status = FAIL

    def _write(self, data: bytes) -> bool:
        try:
            if self.tty is None:
                raise OSError("closed")
            self.tty.write(data)
        except OSError:
            self.log.append("write failed")
            self.status = FAIL
            return False
        return True

    def _pause(self, seconds: float) -> None:
        time.sleep(seconds * self._scale)

    def _set_list(self, sensor: int) -> bool:
        """Set position, quaternion and the items of the sensor's devices; a space is last."""
        time_item = ",21" if self._has_time else ""
        button = ",22" if sensor in self._buttons else ""
        stick = ",23" if sensor in self._sticks else ""
        written = self._write(f"O{sensor + 1},2,11{time_item}{button}{stick},0\r".encode())
        time.sleep(0.05)
        return written

    def _length(self, sensor: int) -> int:
        return 32 + 4 * self._has_time + (sensor in self._buttons) + 2 * (sensor in self._sticks)

    def _reset(self) -> None:
        self.resets += 1
        steps = [(1, b"\r"), (5, b"Y"), (4, b"t"), (2, b"\x19"), (0, b"c")]
        self.log.append(f"resetting, attempt {self.resets}")
        for character in [bytes_ for after, bytes_ in steps if self.resets > after]:
            if not self._write(character):
                return
            self._pause(2.0)
        if self.resets > 2:
            self._pause(20.0)
        assert self.tty is not None  # it was just written to
        self.tty.flush_input()
        self._pause(2.0)
        if leftover := self.tty.read_available(80):
            self.log.append(f"got >= {len(leftover)} characters after reset")
            self.tty.flush_input()
        if not self._write(b"S"):
            return
        status = self._status()
        if not (status[:1] == b"2" and status[-1:] == b"\n"):
            self.log.append(f"bad status {status!r}")
            return
        self.log.append("gives status")
        self.resets = 0
        if not all(self._set_list(sensor) for sensor in range(self._stations)):
            return
        for line in (b"x0.2,0.2,0.8,0.8\r", b"v0.2,0.2,0.8,0.8\r"):
            if not self._write(line):
                return
            self._pause(1.0)
        if self._extra:
            for command in filter(None, self._extra.split("\r")):
                if command.startswith("*"):
                    self._pause(float(command[1:]))
                elif not self._write(f"{command}\r".encode()):
                    return
            self._pause(2.0)
            self.tty.flush_input()
        if not (self._write(b"f") and self._write(b"C")):
            return
        if self._has_time:
            self.tty.drain()
            if not self._write(b"MT\rMZ\r"):
                return
            self.tty.drain()
            self._zero_s = time.time()
        self._last_report_s = time.time()
        self.log.append("reset completed")
        self.status = SYNCING

    def _status(self) -> bytes:
        """Return what is available `answer_s` after `S`; with shortened waits, soon after it seems complete."""
        assert self.tty is not None
        end_s = time.monotonic() + self._answer_s
        while time.monotonic() < end_s:
            if self._scale < 1.0 and self.tty.waiting >= 54:
                time.sleep(0.02)
                break
            time.sleep(0.005)
        return self.tty.read_available(55)

    def _read(self, max_bytes: int) -> bytes | None:
        try:
            assert self.tty is not None
            return self.tty.read_available(max_bytes)
        except OSError:
            return None

    def _resync(self, complaint: str) -> bool:
        assert self.tty is not None
        self.log.append(f"{complaint}, re-syncing")
        self.status, self._buffer = SYNCING, b""
        self.tty.flush_input()
        return False

    def _get_report(self) -> bool:
        if self.status == SYNCING:
            if not (first := self._read(1)):
                return False
            if first != b"0":
                return self._resync(f"while syncing (looking for '0', got {first!r})")
            self._buffer, self._last_report_s, self.status = first, time.time(), AWAITING_STATION
        if self.status == AWAITING_STATION:
            if not (station := self._read(1)):
                return False
            self._sensor = station[0] - ord("1")
            if not 0 <= self._sensor < self._stations:
                return self._resync(f"bad sensor # ({self._sensor})")
            self._buffer, self.status = self._buffer + station, PARTIAL
        new_bytes = self._read(self._length(self._sensor) - len(self._buffer))
        if new_bytes is None:
            self.log.append("error reading report")
            self.status = FAIL
            return False
        self._buffer += new_bytes
        if len(self._buffer) < self._length(self._sensor):
            return False
        if self._buffer[2:3] != b" " and not self._buffer[2:3].isalpha():
            return self._resync("bad 3rd char")
        if self._buffer[-1:] != b" ":
            return self._resync("no space at end of report")
        self._parse_report()
        self.status, self._buffer = SYNCING, b""
        return True

    def _parse_report(self) -> None:
        x, y, z, w, i, j, k = struct.unpack_from("<7f", self._buffer, 3)
        position_m = (x * INCH_M, y * INCH_M, z * INCH_M)
        offset = 31
        if self._has_time:
            self._last_report_s = self._zero_s + struct.unpack_from("<f", self._buffer, offset)[0] / 1000.0
            offset += 4
        buttons, stick = None, None
        if self._sensor in self._buttons:
            buttons, offset = self._buffer[offset], offset + 1
        if self._sensor in self._sticks:
            stick = (self._buffer[offset] - 127) / 128.0, (self._buffer[offset + 1] - 127) / 128.0
        self.reports.append(
            Report(self._sensor, self._last_report_s, time.time(), position_m, (i, j, k, w), buttons, stick)
        )
