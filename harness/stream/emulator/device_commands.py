"""Commands that need more than the settings: the motion, the clock, the logs, or the device as a whole."""

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.stream.codec.replies import Status, TrackingStatus, Unknown
from harness.stream.emulator import geometry
from harness.stream.emulator.argument import Argument
from harness.stream.emulator.queries import QUERIES
from harness.stream.emulator.settings import STATIONS

if TYPE_CHECKING:
    from harness.stream.emulator.device import Device

_MOST_RANGES = 12
"""Two microphones, six emitters (docs/is900.md 7)."""


def _status(device: "Device", now_s: float) -> None:
    settings = device.settings
    status = Status(
        binary=settings.binary,
        centimetres=settings.centimetres,
        continuous=device.streaming,
        firmware=device.firmware,
        identification=device.config.identification,
        short=device.config.status_bytes == 54,
    )
    device.say(now_s, status)


def _switch(device: "Device", argument: Argument, now_s: float) -> None:
    """`l`: sets with a second field, else asks. A station that is not plugged in stays off."""
    if not argument.sets:
        device.say(now_s, *QUERIES["l"](device.settings, argument))
        return
    name, on = argument.station(), bool(argument.whole(0, 1))
    station = replace(device.settings.station(name), active=on and name in device.rounds.plugged)
    device.settings = device.settings.with_station(name, station)


def _boresight(device: "Device", argument: Argument, now_s: float, full: bool) -> None:
    name = argument.station()
    if name in device.rounds.plugged:
        station = geometry.boresighted(device.settings.station(name), device.rounds.turn(now_s, name), full)
        device.settings = device.settings.with_station(name, station)


def _zero_clock(device: "Device", argument: Argument, now_s: float) -> None:
    """Polled, the motion begins anew too, so that what follows is known to the bit."""
    argument.nothing()
    if device.streaming:
        device.rounds.player.zero(now_s)
    else:
        device.rounds.player.begin(now_s)


def _tracking(device: "Device", argument: Argument, now_s: float) -> None:
    """Ranges are as many as the quality lets one expect; none is ever rejected."""
    argument.nothing()
    quality = {name: device.rounds.quality(now_s, name) for name in device.active}
    states = "".join("X" if name not in quality else "T" if round(255 * quality[name]) else "L" for name in STATIONS)
    received = tuple(int(np.ceil(_MOST_RANGES * quality.get(name, 0.0))) for name in STATIONS)
    device.say(now_s, TrackingStatus(states, received, (0,) * len(STATIONS), device.samples.rate_hz))


def _read_errors(device: "Device", argument: Argument, now_s: float) -> None:
    argument.nothing()
    device.say(now_s, *device.errors)


def _clear_errors(device: "Device", argument: Argument, now_s: float) -> None:
    argument.nothing()
    device.errors.clear()


def _send_log(device: "Device", argument: Argument, now_s: float) -> None:
    argument.nothing()
    device.say(now_s, *(Unknown(f"31LF{entry}".encode("latin-1")) for entry in device.log))


def _clear_log(device: "Device", argument: Argument, now_s: float) -> None:
    argument.nothing()
    device.log.clear()


def _information(device: "Device", argument: Argument, now_s: float) -> None:
    argument.nothing()
    device.say(now_s, Unknown(f"51T{device.config.identification} {device.firmware}".encode("ascii")))


def _setting(**values: Any) -> Callable[["Device", float], None]:
    def order(device: "Device", now_s: float) -> None:
        device.settings = replace(device.settings, **values)

    return order


AT_ONCE: dict[str, Callable[["Device", float], None]] = {
    "P": lambda device, now_s: device.poll(now_s),
    "C": lambda device, now_s: device.stream(now_s),
    "c": lambda device, now_s: device.stop(now_s),
    "F": _setting(binary=False),
    "f": _setting(binary=True),
    "S": _status,
    "U": _setting(centimetres=False),
    "u": _setting(centimetres=True),
    "W": lambda device, now_s: device.forget(),
    "\x0b": lambda device, now_s: device.save(),
    "\x11": lambda device, now_s: device.resume(now_s),
    "\x13": lambda device, now_s: device.suspend(now_s),
    "\x19": lambda device, now_s: device.restart(now_s),
}
"""Without a terminator."""

ORDERS: dict[str, Callable[["Device", Argument, float], None]] = {
    "l": _switch,
    "B": lambda device, argument, now_s: _boresight(device, argument, now_s, device.settings.boresight_as_fastrak),
    "MB": lambda device, argument, now_s: _boresight(device, argument, now_s, not device.settings.boresight_as_fastrak),
    "MZ": _zero_clock,
    "MP": _tracking,
    "ME": _read_errors,
    "MEC": _clear_errors,
    "MLogSend": _send_log,
    "MLogClear": _clear_log,
    "MInfoSystem": _information,
}
"""Lines."""
