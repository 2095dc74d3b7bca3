"""An IS-900 without input or output: bytes from the host go in, messages come out, and time is an argument.

It follows docs/is900.md on commands (3, 4), replies (6, 7), records (5) and the state after power-on (12). Where the
sources are silent it follows section 14.
"""

from typing import ClassVar

from harness.stream.is900.emulator.setting_commands import (
    QUERIES,
    SET_ONLY_COMMANDS,
    SETTER_COMMANDS,
    SINGLE_FIELD_SETTERS,
)
from harness.stream.polhemus.codec.replies import TrackingStatus, UnknownReply
from harness.stream.polhemus.emulator.argument import CommandArgument
from harness.stream.polhemus.emulator.device import CommandDevice, CommandTable, boresight_station
from harness.stream.polhemus.emulator.device_state import DeviceState
from harness.stream.polhemus.emulator.settings import STATION_NAMES


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


class Device(CommandDevice):
    """An IS-900 that plays samples and executes commands. The same bytes at the same times give the same answers."""

    commands: ClassVar[CommandTable] = CommandTable(
        actions={
            "B": lambda device, argument, now_s: boresight_station(
                device, argument, now_s, device.settings.boresight_as_fastrak
            ),
            "MB": lambda device, argument, now_s: boresight_station(
                device, argument, now_s, not device.settings.boresight_as_fastrak
            ),
            "MZ": _zero_clock,
            "MP": _report_tracking,
            "ME": _read_errors,
            "MEC": _clear_errors,
            "MLogSend": _send_log,
            "MLogClear": _clear_log,
            "MInfoSystem": _report_information,
        },
        setters=SETTER_COMMANDS,
        set_only=SET_ONLY_COMMANDS,
        queries=QUERIES,
        single_field=SINGLE_FIELD_SETTERS,
    )
