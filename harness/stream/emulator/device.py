"""An IS-900 without input or output: what it is told goes in, what it says comes out, and time is an argument.

It does what docs/is900.md says of commands (3, 4), replies (6, 7), records (5) and of the state after power-on (12);
where the sources say nothing it does what section 14 settles on.
"""

from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from harness.stream import ascii
from harness.stream.commands import Command, CommandReader
from harness.stream.emulator import geometry
from harness.stream.emulator.argument import OUT_OF_RANGE, UNKNOWN, Argument, Refused
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.message import Message
from harness.stream.emulator.player import Player
from harness.stream.emulator.queries import QUERIES
from harness.stream.emulator.setters import SETTERS, SILENT
from harness.stream.emulator.settings import STATIONS, DeviceSettings, StationSettings
from harness.stream.records import Said, Settings, encode
from harness.stream.replies import DeviceError, ReplyEvent, Status, TrackingStatus, Unknown
from harness.stream.samples import Samples

_BUFFER_FULL = -5
_INCH_M, _CENTIMETRE_M = 0.0254, 0.01
_MOST_RANGES = 12
"""Two microphones, six emitters (docs/is900.md 7)."""
_KEPT = 100
"""Entries of a log."""


class Device:
    """Plays samples; stations beyond the samples' are not plugged in. Same bytes at the same times: same answer."""

    def __init__(self, samples: Samples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        self.samples, self.config = samples, config or EmulatorConfig()
        self.firmware = self.config.firmware
        self.commands = 0
        """Commands that were understood or refused."""
        self.refused = 0
        self._lost: frozenset[str] = frozenset()
        """Stations out of sight beyond what the samples say."""
        self.streaming = self.suspended = False
        self._plugged = STATIONS[: len(samples.stations)]
        self._factory = self._first = self._power_on()
        self.settings = self._first
        self._player = Player(samples, now_s)
        self._reader = CommandReader()
        self._next = 0, 0
        """Round and row that are sent next while streaming."""
        self._silent_until_s = float("-inf")
        self._out: list[Message] = []
        self._held: deque[Message] = deque(maxlen=_KEPT)
        """Replies of a suspended device."""
        self._round: tuple[int, dict[str, bytes]] | None = None
        """Records of the round that was written last."""
        self._errors: deque[ReplyEvent] = deque(maxlen=_KEPT)
        self._log: deque[str] = deque(maxlen=_KEPT)

    def receive(self, data: bytes, now_s: float) -> None:
        """Bytes from the host."""
        self._play(now_s)
        if now_s < self._silent_until_s:
            return
        for command in self._reader.feed(data):
            self.commands += 1
            try:
                self._obey(command, now_s)
            except Refused as refused:
                self.refused += 1
                error = DeviceError(command.line.decode("latin-1"), refused.code, fl=refused.field)
                if self.settings.error_log:
                    self._errors.append(error)
                self._say(now_s, error)

    def messages(self, now_s: float) -> list[Message]:
        """What it has said since it was asked last, in order; readings until now."""
        self._play(now_s)
        out, self._out = self._out, []
        return out

    def advance(self, now_s: float) -> bytes:
        """The same as bytes, for an endlessly fast line."""
        return b"".join(message.data for message in self.messages(now_s))

    @property
    def next_s(self) -> float:
        """When the next reading is taken [s]; inf unless streaming."""
        return self._player.time_s(*self._next) if self.streaming else float("inf")

    def restart(self, now_s: float) -> None:
        """As after 19 or a cut of its power: saved settings, polled, a new clock, silence at first."""
        self._play(now_s)
        self._out.append(Message(now_s, b"", halts=True))
        self.streaming = self.suspended = False
        self.settings = self._first
        self._held.clear()
        self._reader = CommandReader()
        self._silent_until_s = now_s + self.config.restart_s
        self._player.begin(self._silent_until_s)
        self._round = None

    def lose(self, stations: Iterable[str]) -> None:
        """From now on these are out of sight, and no others (but where the samples say so)."""
        self._lost, self._round = frozenset(stations), None

    def _power_on(self) -> DeviceSettings:
        stations = tuple(StationSettings(active=name in self._plugged) for name in STATIONS)
        return DeviceSettings(stations, baud=self.config.baud)

    def _play(self, now_s: float) -> None:
        """Write the readings until now."""
        while self.streaming:
            number, row = self._next
            taken_s = self._player.time_s(number, row)
            if taken_s > now_s:
                return
            self._next = (number, row + 1) if row + 1 < len(self._plugged) else (number + 1, 0)
            if self.settings.stations[row].active and not self.suspended:
                data = self._records(number)[STATIONS[row]]
                self._out.append(Message(taken_s + self.samples.ready_s, data, STATIONS[row]))

    def _records(self, number: int) -> dict[str, bytes]:
        """The records of a round, by station."""
        if self._round is None or self._round[0] != number:
            self._round = number, self._written(number)
        return self._round[1]

    def _written(self, number: int) -> dict[str, bytes]:
        k, stamps_s = self._player.row_of(number), self._player.stamps_s(number)
        position_m, turn = self.samples.position_m[k].copy(), self.samples.tracker_from_station[k].copy()
        quality = self.samples.quality[k].copy()
        rows_of: dict[tuple[int, ...], list[int]] = {}
        for row, (name, station) in enumerate(zip(self._plugged, self.settings.stations, strict=False)):
            if not station.plain:
                position_m[row], turn[row] = geometry.reported(position_m[row], turn[row], station)
            if name in self._lost:
                quality[row] = 0.0
            rows_of.setdefault(station.items, []).append(row)
        out = {}
        for items, rows in rows_of.items():
            said = Said(stamps_s[rows], position_m[rows], turn[rows], quality[rows])
            names = np.array([ord(STATIONS[row]) for row in rows], np.uint8)
            table = encode(items, names, said, self._form())
            for place, row in enumerate(rows):
                one = table[place : place + 1]
                out[STATIONS[row]] = one.tobytes() if self.settings.binary else ascii.write(items, one)
        return out

    def _form(self) -> Settings:
        settings = self.settings
        return Settings(
            metres_per_unit=_CENTIMETRE_M if settings.centimetres else _INCH_M,
            seconds_per_tick=1e-6 if settings.microseconds else 1e-3,
            binary=settings.binary,
        )

    def _say(self, now_s: float, *replies: ReplyEvent) -> None:
        said = [Message(now_s, reply.line()) for reply in replies]
        if self.suspended:
            self._held.extend(said)
        else:
            self._out += said

    def _set(self, settings: DeviceSettings) -> None:
        self.settings, self._round = settings, None

    def _obey(self, command: Command, now_s: float) -> None:
        text = command.line.decode("latin-1")
        if self.settings.command_log and not text.startswith("MLog"):
            self._log.append(f"{1e3 * self._player.clock_s(now_s):.0f}:{text}")
        if command.cut:
            raise Refused(_BUFFER_FULL)
        if command.immediate:
            _AT_ONCE[text](self, now_s)
            return
        name = next((name for name in _NAMES if text.startswith(name)), None)
        if name is None:
            raise Refused(UNKNOWN)
        argument = Argument(text[len(name) :])
        if name in _LIVE:
            _LIVE[name](self, argument, now_s)
        elif name in SILENT:
            self._set(SILENT[name](self.settings, argument))
        elif name in SETTERS and (argument.sets or (name in _BARE and argument.text.strip())):
            if name == "O":
                self._check_items(argument)
            self._set(SETTERS[name](self.settings, argument))
        else:
            self._say(now_s, *QUERIES[name](self.settings, argument))

    def _check_items(self, argument: Argument) -> None:
        """Items that this firmware does not have yet (docs/is900.md 5.1)."""
        version = float(self.firmware[:4])
        for place, code in enumerate(argument.numbers()):
            if version < _SINCE.get(int(code), 0.0):
                raise Refused(OUT_OF_RANGE, place + 2)

    def _stream(self, now_s: float) -> None:
        if not self.streaming:
            self.streaming, self._next = True, (self._player.first_from(now_s), 0)

    def _stop(self, now_s: float) -> None:
        self.streaming = False
        self._out.append(Message(now_s, b"", halts=True))

    def _poll(self, now_s: float) -> None:
        for row, name in enumerate(self._plugged):
            if self.settings.stations[row].active and not self.suspended:
                data = self._written(self._player.latest(now_s, row))[name]
                self._out.append(Message(now_s, data, name))

    def _status(self, now_s: float) -> None:
        settings = self.settings
        self._say(
            now_s,
            Status(
                binary=settings.binary,
                centimetres=settings.centimetres,
                continuous=self.streaming,
                firmware=self.firmware,
                identification=self.config.identification,
                short=self.config.status_bytes == 54,
            ),
        )

    def _save(self, now_s: float) -> None:
        self._first = self.settings

    def _suspend(self, now_s: float) -> None:
        self.suspended = True

    def _resume(self, now_s: float) -> None:
        self.suspended = False
        self._out += [replace(message, ready_s=now_s) for message in self._held]
        self._held.clear()

    def _zero_clock(self, argument: Argument, now_s: float) -> None:
        argument.nothing()
        if self.streaming:
            self._player.zero(now_s)
        else:
            self._player.begin(now_s)
        self._round = None

    def _switch(self, argument: Argument, now_s: float) -> None:
        """`l`: asks without a second field, and for all with `*`."""
        if not argument.sets:
            self._say(now_s, *QUERIES["l"](self.settings, argument))
            return
        name, on = argument.station(), bool(argument.whole(0, 1))
        station = replace(self.settings.station(name), active=on and name in self._plugged)
        self._set(self.settings.with_station(name, station))

    def _boresight(self, argument: Argument, now_s: float, full: bool) -> None:
        name = argument.station()
        if name in self._plugged:
            row = STATIONS.index(name)
            k = self._player.row_of(self._player.latest(now_s, row))
            turn = self.samples.tracker_from_station[k, row]
            station = geometry.boresighted(self.settings.station(name), turn, full)
            self._set(self.settings.with_station(name, station))

    def _tracking(self, argument: Argument, now_s: float) -> None:
        argument.nothing()
        states, received = "", []
        for row, name in enumerate(STATIONS):
            quality, state = 0.0, "X"
            if name in self._plugged and self.settings.stations[row].active:
                k = self._player.row_of(self._player.latest(now_s, row))
                quality = 0.0 if name in self._lost else float(np.clip(self.samples.quality[k, row], 0.0, 1.0))
                state = "T" if np.round(255.0 * quality) > 0.0 else "L"
            states += state
            received.append(int(np.ceil(_MOST_RANGES * quality)))
        self._say(now_s, TrackingStatus(states, tuple(received), (0,) * len(STATIONS), self.samples.rate_hz))

    def _read_errors(self, argument: Argument, now_s: float) -> None:
        argument.nothing()
        self._say(now_s, *self._errors)

    def _clear_errors(self, argument: Argument, now_s: float) -> None:
        argument.nothing()
        self._errors.clear()

    def _send_log(self, argument: Argument, now_s: float) -> None:
        argument.nothing()
        self._say(now_s, *(Unknown(f"31LF{entry}".encode("latin-1")) for entry in self._log))

    def _clear_log(self, argument: Argument, now_s: float) -> None:
        argument.nothing()
        self._log.clear()

    def _information(self, argument: Argument, now_s: float) -> None:
        argument.nothing()
        self._say(now_s, Unknown(f"51T{self.config.identification} {self.firmware}".encode("ascii")))


def _setting(**values: Any) -> Callable[[Device, float], None]:
    return lambda device, now_s: device._set(replace(device.settings, **values))


_SINCE = {40: 4.13, 76: 4.26}
"""Firmware from which on an item is known."""
_AT_ONCE: dict[str, Callable[[Device, float], None]] = {
    "P": Device._poll,
    "C": Device._stream,
    "c": Device._stop,
    "F": _setting(binary=False),
    "f": _setting(binary=True),
    "S": Device._status,
    "U": _setting(centimetres=False),
    "u": _setting(centimetres=True),
    "W": lambda device, now_s: device._set(device._factory),
    "\x0b": Device._save,
    "\x11": Device._resume,
    "\x13": Device._suspend,
    "\x19": Device.restart,
}
_LIVE: dict[str, Callable[[Device, Argument, float], None]] = {
    "l": Device._switch,
    "B": lambda device, argument, now_s: device._boresight(argument, now_s, device.settings.boresight_as_fastrak),
    "MB": lambda device, argument, now_s: device._boresight(argument, now_s, not device.settings.boresight_as_fastrak),
    "MZ": Device._zero_clock,
    "MP": Device._tracking,
    "ME": Device._read_errors,
    "MEC": Device._clear_errors,
    "MLogSend": Device._send_log,
    "MLogClear": Device._clear_log,
    "MInfoSystem": Device._information,
}
"""Commands that need more than the settings."""
_BARE = {"MU", "Mg", "MSchAlg", "MConfigLockMode", "MEthIp", "MEthUdp", "MEthUdpPort"}
"""Commands that set with their first field."""
_NAMES = sorted({*_LIVE, *SILENT, *SETTERS, *QUERIES}, key=len, reverse=True)
"""Longest first, since some begin with others."""
