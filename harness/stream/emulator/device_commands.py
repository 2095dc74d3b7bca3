"""Commands that need more than the settings: the motion, the clock, the logs, or the device as a whole."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from harness.stream.codec.replies import StatusRecord, TrackingStatus, UnknownReply
from harness.stream.emulator import geometry
from harness.stream.emulator.argument import CommandArgument
from harness.stream.emulator.device_state import DeviceState
from harness.stream.emulator.queries import QUERIES
from harness.stream.emulator.settings import STATION_NAMES


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
    station = replace(device.settings.station(name), active=on and name in device.rounds.plugged)
    device.settings = device.settings.with_station(name, station)


def _boresight(device: DeviceState, argument: CommandArgument, now_s: float, full: bool) -> None:
    name = argument.station()
    if name in device.rounds.plugged:
        present = device.rounds.orientation(now_s, name, device.settings)
        station = geometry.boresight(device.settings.station(name), present, full)
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
