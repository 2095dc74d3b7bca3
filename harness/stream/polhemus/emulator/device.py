"""A device that executes commands, without input or output: bytes from the host go in, messages come out, and time is
an argument. The commands of the Fastrak class are here (docs/is900.md 4); a device family adds its own.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

from harness.stream.polhemus.codec.commands import Command, CommandReader
from harness.stream.polhemus.codec.items import missing_items
from harness.stream.polhemus.codec.replies import DeviceError
from harness.stream.polhemus.codec.samples import DeviceSamples
from harness.stream.polhemus.emulator.argument import OUT_OF_RANGE, UNKNOWN_COMMAND, CommandArgument, CommandError
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.device_state import DeviceState
from harness.stream.polhemus.emulator.setting_commands import Query, Setter
from harness.stream.polhemus.emulator.settings import boresight

ImmediateCommand = Callable[[DeviceState, float], None]
LineCommand = Callable[[DeviceState, CommandArgument, float], None]


def switch_station(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
    """`l{st},0|1`: set the station's state. A station that is not plugged in stays off."""
    name, on = argument.station(), bool(argument.integer(0, 1))
    station = replace(device.settings.station(name), active=on and name in device.rounds.station_characters)
    device.settings = device.settings.with_station(name, station)


def boresight_station(device: DeviceState, argument: CommandArgument, now_s: float, full: bool) -> None:
    """Boresight a station: all of its orientation, or without `full` its heading."""
    name = argument.station()
    if name in device.rounds.station_characters:
        present = device.rounds.orientation(now_s, name, device.settings)
        station = boresight(device.settings.station(name), present, full)
        device.settings = device.settings.with_station(name, station)


def _settings_change(**values: Any) -> Callable[[DeviceState, float], None]:
    def change(device: DeviceState, now_s: float) -> None:
        device.settings = replace(device.settings, **values)

    return change


IMMEDIATE_COMMANDS: dict[str, ImmediateCommand] = {
    "P": lambda device, now_s: device.poll(now_s),
    "C": lambda device, now_s: device.start_streaming(now_s),
    "c": lambda device, now_s: device.stop(now_s),
    "F": _settings_change(binary=False),
    "f": _settings_change(binary=True),
    "S": lambda device, now_s: device.reply(now_s, device.status_record()),
    "U": _settings_change(centimetres=False),
    "u": _settings_change(centimetres=True),
    "W": lambda device, now_s: device.restore_factory_defaults(),
    "\x0b": lambda device, now_s: device.save(),
    "\x11": lambda device, now_s: device.resume(now_s),
    "\x13": lambda device, now_s: device.suspend(now_s),
    "\x19": lambda device, now_s: device.restart(now_s),
}
"""Commands that act at once, without a terminator."""
_BUFFER_FULL = -5


@dataclass(frozen=True)
class CommandTable:
    """The commands of a device family that are lines, by name."""

    actions: Mapping[str, LineCommand]
    """Commands that act on the device: reply, measure, or log."""
    setters: Mapping[str, Setter]
    """Commands that set, or query when they have nothing to set."""
    set_only: Mapping[str, Setter]
    queries: Mapping[str, Query]
    single_field: frozenset[str] = frozenset()
    """Those of `setters` that set with their first field."""
    immediate: Mapping[str, ImmediateCommand] = field(default_factory=lambda: IMMEDIATE_COMMANDS)
    """Letters and control characters that act at once, without a terminator."""

    @property
    def letters(self) -> bytes:
        """The letters among `immediate`."""
        return "".join(filter(str.isalpha, self.immediate)).encode("ascii")

    @cached_property
    def names(self) -> list[str]:
        """All names, longest first, since some names are the beginning of others."""
        return sorted({*self.actions, *self.setters, *self.set_only, *self.queries}, key=len, reverse=True)


class CommandDevice(DeviceState):
    """A device that plays samples and executes commands. The same bytes at the same times give the same answers."""

    commands: ClassVar[CommandTable]

    def __init__(self, samples: DeviceSamples, config: EmulatorConfig | None = None, now_s: float = 0.0) -> None:
        """Switch the device on at `now_s` [s]."""
        super().__init__(samples, config, now_s)
        self._reader = CommandReader(self.commands.letters)

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
        self._reader = CommandReader(self.commands.letters)

    def _execute(self, command: Command, now_s: float) -> None:
        text, table = command.line.decode("latin-1"), self.commands
        if self.settings.command_log and not text.startswith("MLog"):
            self.log.append(f"{1e3 * self.rounds.player.clock_s(now_s):.0f}:{text}")
        if command.cut:
            raise CommandError(_BUFFER_FULL)
        if text in table.immediate:
            table.immediate[text](self, now_s)
            return
        name = next((name for name in table.names if text.startswith(name)), None)
        if name is None:
            raise CommandError(UNKNOWN_COMMAND)
        argument = CommandArgument(text[len(name) :], self.config.known_stations)
        sets = argument.sets or (name in table.single_field and bool(argument.text.strip()))
        if name == "l" and sets:
            switch_station(self, argument, now_s)
        elif name in table.actions:
            table.actions[name](self, argument, now_s)
        elif name in table.set_only:
            self.settings = table.set_only[name](self.settings, argument)
        elif name in table.setters and sets:
            if name == "O":
                self._check_items(argument)
            self.settings = table.setters[name](self.settings, argument)
        else:
            self.reply(now_s, *table.queries[name](self.settings, argument))

    def _check_items(self, argument: CommandArgument) -> None:
        """Raise CommandError for items that this device or firmware does not have."""
        for index, code in enumerate(argument.numbers()):
            if code not in self.config.known_items or missing_items([int(code)], float(self.firmware[:4])):
                raise CommandError(OUT_OF_RANGE, index + 2)
