"""An IS-900 without input or output: bytes from the host go in, messages come out, and time is an argument.

It follows docs/is900.md on commands (3, 4), replies (6, 7), records (5) and the state after power-on (12). Where the
sources are silent it follows section 14.
"""

from collections.abc import Callable
from typing import ClassVar

from harness.stream.is900.emulator.setting_commands import (
    QUERIES,
    SET_ONLY_COMMANDS,
    SETTER_COMMANDS,
    SINGLE_FIELD_SETTERS,
)
from harness.stream.polhemus.codec.replies import TrackingStatus, UnknownReply
from harness.stream.polhemus.emulator.argument import CommandArgument
from harness.stream.polhemus.emulator.device import CommandDevice, CommandTable, LineCommand, boresight_station
from harness.stream.polhemus.emulator.device_state import DeviceState
from harness.stream.polhemus.emulator.settings import STATION_NAMES


def _zero_clock(device: DeviceState, now_s: float) -> None:
    """Set the clock to zero. When polled, the motion starts again too, so that the following bytes are reproducible."""
    if device.streaming:
        device.rounds.player.zero(now_s)
    else:
        device.rounds.player.begin(now_s)


def _report_tracking(device: DeviceState, now_s: float) -> None:
    """Report the state of each station and its ranges."""
    quality = {name: device.rounds.quality(now_s, name, device.settings) for name in device.active}
    states = "".join(
        "X" if name not in quality else "T" if round(255 * quality[name]) else "L" for name in STATION_NAMES
    )
    ranges = [
        device.rounds.ranges(now_s, name, device.settings) if name in quality else (0, 0) for name in STATION_NAMES
    ]
    received, rejected = zip(*ranges, strict=True)
    device.reply(now_s, TrackingStatus(states, received, rejected, device.samples.rate_hz))


def _bare(act: Callable[[DeviceState, float], None]) -> LineCommand:
    """A command that has no argument."""

    def run(device: DeviceState, argument: CommandArgument, now_s: float) -> None:
        argument.require_empty()
        act(device, now_s)

    return run


def _send_log(device: DeviceState, now_s: float) -> None:
    device.reply(now_s, *(UnknownReply(f"31LF{entry}".encode("latin-1")) for entry in device.log))


def _report_information(device: DeviceState, now_s: float) -> None:
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
            "MZ": _bare(_zero_clock),
            "MP": _bare(_report_tracking),
            "ME": _bare(lambda device, now_s: device.reply(now_s, *device.errors)),
            "MEC": _bare(lambda device, now_s: device.errors.clear()),
            "MLogSend": _bare(_send_log),
            "MLogClear": _bare(lambda device, now_s: device.log.clear()),
            "MInfoSystem": _bare(_report_information),
        },
        setters=SETTER_COMMANDS,
        set_only=SET_ONLY_COMMANDS,
        queries=QUERIES,
        single_field=SINGLE_FIELD_SETTERS,
    )
