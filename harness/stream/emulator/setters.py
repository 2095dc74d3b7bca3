"""Commands that change a setting and answer nothing: settings in, settings out (docs/is900.md 4)."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from harness.errors import HarnessError
from harness.stream.codec.items import record_type
from harness.stream.codec.records import Said, Settings, encode
from harness.stream.codec.replies import Emitter
from harness.stream.emulator import geometry
from harness.stream.emulator.argument import MISSING, OUT_OF_RANGE, Argument, Refused
from harness.stream.emulator.config import RATES
from harness.stream.emulator.settings import NOWHERE, UNTURNED, DeviceSettings

Setter = Callable[[DeviceSettings, Argument], DeviceSettings]
_CM = 0.01
_NOTHING_SAID = Said(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0))


def _station(settings: DeviceSettings, argument: Argument, **values: Any) -> DeviceSettings:
    name = argument.station()
    return settings.with_station(name, replace(settings.station(name), **values))


def _list(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    items = tuple(argument.codes())
    try:
        record_type(items)
        encode(items, np.zeros(0, np.uint8), _NOTHING_SAID, Settings())
    except (HarnessError, ValueError) as error:  # no such item, none that can be written, or one listed twice
        raise Refused(OUT_OF_RANGE, 2) from error
    return _station(settings, argument, items=items)


def _alignment(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    name = argument.station()
    origin, on_x, on_y = _CM * np.array(argument.numbers(9)).reshape(3, 3)
    aligned = geometry.aligned(settings.station(name), origin, on_x, on_y)
    if aligned is None:
        raise Refused(OUT_OF_RANGE, 2)
    return settings.with_station(name, aligned)


def _without_boresight(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    name = argument.station()
    return settings.with_station(name, geometry.without_boresight(settings.station(name)))


def _serial(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    """`o1152,N,8,0`: a hundredth of the rate, parity, bits, handshake."""
    if len(argument.fields) < 4:
        raise Refused(MISSING, len(argument.fields) + 1)
    hundredths, parity = Argument(argument.fields[0]).whole(3, 1152, after=0), argument.fields[1]
    bits, handshake = Argument(",".join(argument.fields[2:])).numbers(2, after=0)
    if 100 * hundredths not in RATES or parity not in ("N", "O", "E") or bits not in (7, 8) or handshake not in (0, 1):
        raise Refused(OUT_OF_RANGE)
    return replace(settings, baud=100 * hundredths, framing=(parity, int(bits), int(handshake)))


def _genlock(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    state, rate_hz = argument.numbers(2, after=0)
    if state not in range(4) or not 0.0 <= rate_hz < 1000.0:
        raise Refused(OUT_OF_RANGE)
    return replace(settings, genlock=str(int(state)), genlock_hz=rate_hz)


def _emitter(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    number = Argument(argument.fields[0]).whole(1, 9999999, after=0)
    x, y, z, nx, ny, nz, identity = argument.numbers(7)
    made = Emitter(number, (x, y, z), (nx, ny, nz), int(identity))
    kept = (emitter for emitter in settings.drafted if emitter.number != number)
    return replace(settings, drafted=tuple(sorted((*kept, made), key=lambda emitter: emitter.number)))


def _without_emitter(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    number = argument.whole(1, 9999999, after=0)
    return replace(settings, drafted=tuple(emitter for emitter in settings.drafted if emitter.number != number))


def _address(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    parts = argument.text.strip(" ,").split(".")
    if len(parts) != 4 or not all(part.isascii() and part.isdigit() and int(part) < 256 for part in parts):
        raise Refused(OUT_OF_RANGE)
    return replace(settings, address=".".join(parts))


def _phase(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    return replace(settings, genlock_phase=argument.numbers(1, after=0)[0])


def _no_change(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
    return settings


def _numbers(field: str, count: int, scale: float = 1.0) -> Setter:
    def setter(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
        return _station(settings, argument, **{field: tuple(scale * value for value in argument.numbers(count))})

    return setter


def _of_station(field: str, low: int, high: int) -> Setter:
    def setter(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
        return _station(settings, argument, **{field: argument.whole(low, high)})

    return setter


def _of_device(field: str, low: int, high: int, kind: type = int) -> Setter:
    def setter(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
        return replace(settings, **{field: kind(argument.whole(low, high, after=0))})

    return setter


def _fixed(**values: Any) -> Setter:
    def setter(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
        argument.nothing()
        return replace(settings, **values)

    return setter


def _reset(**values: Any) -> Setter:
    return lambda settings, argument: _station(settings, argument, **values)


def _emitters(change: Callable[[DeviceSettings], dict[str, Any]]) -> Setter:
    def setter(settings: DeviceSettings, argument: Argument) -> DeviceSettings:
        argument.nothing()
        return replace(settings, **change(settings))

    return setter


SETTERS: dict[str, Setter] = {
    "O": _list,
    "A": _alignment,
    "G": _numbers("mounting_deg", 3),
    "H": _numbers("reference_deg", 3),
    "N": _numbers("tip_m", 3, _CM),
    "V": _numbers("envelope_m", 6),
    "Mp": _of_station("prediction_ms", 0, 50),
    "MQ": _of_station("sensitivity", 1, 5),
    "MG": _genlock,
    "MU": _of_device("timeout_ms", 0, 99),
    "Mg": _of_device("gain", 0, 9),
    "MCF": _emitter,
    "MCI": _no_change,
    "MSchAlg": _of_device("scheduling", 1, 2),
    "MConfigLockMode": _of_device("lock", 0, 2),
    "MEthIp": _address,
    "MEthUdp": _of_device("udp", 0, 1, bool),
    "MEthUdpPort": _of_device("udp_port", 1, 65535),
}
"""Commands that read where nothing is to be set."""

SILENT: dict[str, Setter] = {
    "R": _reset(origin_m=NOWHERE, tracker_from_aligned=UNTURNED),
    "b": _without_boresight,
    "o": _serial,
    "x": _no_change,
    "v": _no_change,
    "MF": _of_station("enhancement", 0, 2),
    "MH": _of_station("compass", 0, 2),
    "Mh": _reset(compass=0),
    "MT": _fixed(microseconds=False),
    "Mt": _fixed(microseconds=True),
    "MBI": _fixed(boresight_as_fastrak=False),
    "MBF": _fixed(boresight_as_fastrak=True),
    "MGP": _phase,
    "MGS": _of_device("genlock_source", 1, 2),
    "MCf": _without_emitter,
    "MCC": _fixed(drafted=()),
    "MCe": _emitters(lambda settings: {"emitters": settings.drafted}),
    "MCx": _emitters(lambda settings: {"drafted": settings.emitters}),
    "MCi": _no_change,
    "ML0": _fixed(lights=False),
    "ML1": _fixed(lights=True),
    "MLB": _of_device("brightness", 0, 100),
    "ME0": _fixed(error_log=False),
    "ME1": _fixed(error_log=True),
    "MLogOpen": _fixed(command_log=True),
    "MLogClose": _fixed(command_log=False),
}
"""Commands that only ever set."""

BARE = {"MU", "Mg", "MSchAlg", "MConfigLockMode", "MEthIp", "MEthUdp", "MEthUdpPort"}
"""Those of `SETTERS` that set with their first field already."""
