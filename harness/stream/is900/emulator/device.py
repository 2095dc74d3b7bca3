"""An IS-900 without input or output: bytes from the host go in, messages come out, and time is an argument.

It follows docs/is900.md on commands (3, 4), replies (6, 7), records (5) and the state after power-on (12). Where the
sources are silent it follows section 14.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from harness.stream.is900.codec.commands import Command, CommandReader
from harness.stream.is900.codec.items import missing_items
from harness.stream.is900.codec.replies import DeviceError, StatusRecord, TrackingStatus, UnknownReply
from harness.stream.is900.codec.samples import DeviceSamples
from harness.stream.is900.emulator.argument import OUT_OF_RANGE, UNKNOWN_COMMAND, CommandArgument, CommandError
from harness.stream.is900.emulator.config import EmulatorConfig
from harness.stream.is900.emulator.device_state import DeviceState
from harness.stream.is900.emulator.setting_commands import (
    QUERIES,
    SET_ONLY_COMMANDS,
    SETTER_COMMANDS,
    SINGLE_FIELD_SETTERS,
)
from harness.stream.is900.emulator.settings import STATION_NAMES, boresight


def _report_status(device: DeviceState, now_s: float) -> None:
    settings = device.settings
    status = StatusRecord(
        binary=settings.binary,
        centimetres=settings.centimetres,
        continuous=device.streaming,
        firmware=device.firmware,
        identification=device.config.identification,
        short=device.config.status_bytes == 54,
    )
    device.reply(now_s, status)


def _switch_station(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    """`l`: set the station's state with a second field, else query it. A station that is not plugged in stays off."""
    if not argument.sets:
        device.reply(now_s, *QUERIES["l"](device.settings, argument))
        return
    name, on = argument.station(), bool(argument.integer(0, 1))
    station = replace(device.settings.station(name), active=on and name in device.rounds.station_characters)
    device.settings = device.settings.with_station(name, station)


def _boresight(device: DeviceState, argument: CommandArgument, now_s: float, full: bool) -> None:
    name = argument.station()
    if name in device.rounds.station_characters:
        present = device.rounds.orientation(now_s, name, device.settings)
        station = boresight(device.settings.station(name), present, full)
        device.settings = device.settings.with_station(name, station)


def _zero_clock(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    """Set the clock to zero. When polled, the motion starts again too, so that the following bytes are reproducible."""
    argument.require_empty()
    if device.streaming:
        device.rounds.player.zero(now_s)
    else:
        device.rounds.player.begin(now_s)


def _report_tracking(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    """Report the state of each station and its ranges."""
    argument.require_empty()
    quality = {name: device.rounds.quality(now_s, name, device.settings) for name in device.active}
    states = "".join(
        "X" if name not in quality else "T" if round(255 * quality[name]) else "L" for name in STATION_NAMES
    )
    ranges = [
        device.rounds.ranges(now_s, name, device.settings) if name in quality else (0, 0) for name in STATION_NAMES
    ]
    received, rejected = zip(*ranges, strict=True)
    device.reply(now_s, TrackingStatus(states, received, rejected, device.samples.rate_hz))


def _read_errors(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    argument.require_empty()
    device.reply(now_s, *device.errors)


def _clear_errors(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    argument.require_empty()
    device.errors.clear()


def _send_log(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    argument.require_empty()
    device.reply(now_s, *(UnknownReply(f"31LF{entry}".encode("latin-1")) for entry in device.log))


def _clear_log(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    argument.require_empty()
    device.log.clear()


def _report_information(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    argument.require_empty()
    device.reply(now_s, UnknownReply(f"51T{device.config.identification} {device.firmware}".encode("ascii")))


def _settings_change(**values: Any) -> Callable[[DeviceState, float], None]:
    def change(device: DeviceState, now_s: float) -> None:
        device.settings = replace(device.settings, **values)

    return change


IMMEDIATE_COMMANDS: dict[str, Callable[[DeviceState, float], None]] = {
    "P": lambda device, now_s: device.poll(now_s),
    "C": lambda device, now_s: device.start_streaming(now_s),
    "c": lambda device, now_s: device.stop(now_s),
    "F": _settings_change(binary=False),
    "f": _settings_change(binary=True),
    "S": _report_status,
    "U": _settings_change(centimetres=False),
    "u": _settings_change(centimetres=True),
    "W": lambda device, now_s: device.restore_factory_defaults(),
    "\x0b": lambda device, now_s: device.save(),
    "\x11": lambda device, now_s: device.resume(now_s),
    "\x13": lambda device, now_s: device.suspend(now_s),
    "\x19": lambda device, now_s: device.restart(now_s),
}
"""Commands that act at once, without a terminator."""

DEVICE_COMMANDS: dict[str, Callable[[DeviceState, CommandArgument, float], None]] = {
    "l": _switch_station,
    "B": lambda device, argument, now_s: _boresight(device, argument, now_s, device.settings.boresight_as_fastrak),
    "MB": lambda device, argument, now_s: _boresight(device, argument, now_s, not device.settings.boresight_as_fastrak),
    "MZ": _zero_clock,
    "MP": _report_tracking,
    "ME": _read_errors,
    "MEC": _clear_errors,
    "MLogSend": _send_log,
    "MLogClear": _clear_log,
    "MInfoSystem": _report_information,
}
"""Commands that are lines."""


_BUFFER_FULL = -5
_COMMAND_NAMES = sorted({*DEVICE_COMMANDS, *SET_ONLY_COMMANDS, *SETTER_COMMANDS, *QUERIES}, key=len, reverse=True)
"""Longest first, since some names are the beginning of others."""


class Device(DeviceState):
    """An IS-900 that plays samples and executes commands. The same bytes at the same times give the same answers."""

    def __init__(self, samples: DeviceSamples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        """Switch the device on at `now_s` [s]."""
        super().__init__(samples, config, now_s)
        self._reader = CommandReader()

    def receive(self, data: bytes, now_s: float) -> None:
        """Take bytes from the host; they are lost while the device restarts."""
        self._play(now_s)
        for command in self._reader.feed(data) if now_s >= self._silent_until_s else ():
            if now_s < self._silent_until_s:
                return
            self.command_count += 1
            try:
                self._execute(command, now_s)
            except CommandError as rejected:
                self.refused_count += 1
                error = DeviceError(command.line.decode("latin-1"), rejected.code, fl=rejected.field)
                if self.settings.error_log:
                    self.errors.append(error)
                self.reply(now_s, error)

    def restart(self, now_s: float) -> None:
        """Restart as after command 19 or a power cut; an unfinished command is forgotten too."""
        super().restart(now_s)
        self._reader = CommandReader()

    def _execute(self, command: Command, now_s: float) -> None:
        text = command.line.decode("latin-1")
        if self.settings.command_log and not text.startswith("MLog"):
            self.log.append(f"{1e3 * self.rounds.player.clock_s(now_s):.0f}:{text}")
        if command.cut:
            raise CommandError(_BUFFER_FULL)
        if command.immediate:
            IMMEDIATE_COMMANDS[text](self, now_s)
            return
        name = next((name for name in _COMMAND_NAMES if text.startswith(name)), None)
        if name is None:
            raise CommandError(UNKNOWN_COMMAND)
        argument = CommandArgument(text[len(name) :])
        sets = argument.sets or (name in SINGLE_FIELD_SETTERS and bool(argument.text.strip()))
        if name in DEVICE_COMMANDS:
            DEVICE_COMMANDS[name](self, argument, now_s)
        elif name in SET_ONLY_COMMANDS:
            self.settings = SET_ONLY_COMMANDS[name](self.settings, argument)
        elif name in SETTER_COMMANDS and sets:
            if name == "O":
                self._check_items(argument)
            self.settings = SETTER_COMMANDS[name](self.settings, argument)
        else:
            self.reply(now_s, *QUERIES[name](self.settings, argument))

    def _check_items(self, argument: CommandArgument) -> None:
        """Raise CommandError for items that this firmware does not have yet."""
        for index, code in enumerate(argument.numbers()):
            if missing_items([int(code)], float(self.firmware[:4])):
                raise CommandError(OUT_OF_RANGE, index + 2)
