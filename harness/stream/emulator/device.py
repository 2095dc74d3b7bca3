"""An IS-900 without input or output: bytes from the host go in, messages come out, and time is an argument.

It follows docs/is900.md on commands (3, 4), replies (6, 7), records (5) and the state after power-on (12). Where the
sources are silent it follows section 14.
"""

from harness.stream.codec.commands import Command, CommandReader
from harness.stream.codec.items import missing_items
from harness.stream.codec.replies import DeviceError
from harness.stream.codec.samples import DeviceSamples
from harness.stream.emulator.argument import OUT_OF_RANGE, UNKNOWN_COMMAND, CommandArgument, CommandError
from harness.stream.emulator.config import EmulatorConfig
from harness.stream.emulator.device_commands import DEVICE_COMMANDS, IMMEDIATE_COMMANDS
from harness.stream.emulator.device_state import DeviceState
from harness.stream.emulator.queries import QUERIES
from harness.stream.emulator.setters import SET_ONLY_COMMANDS, SETTER_COMMANDS, SINGLE_FIELD_SETTERS

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
