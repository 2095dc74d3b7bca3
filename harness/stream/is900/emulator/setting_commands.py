"""Commands that change settings, and queries of settings (docs/is900.md 4 and 6): settings and arguments in,
settings or replies out.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from harness.errors import HarnessError
from harness.stream.is900.codec import replies
from harness.stream.is900.codec.items import record_type
from harness.stream.is900.codec.records import RecordFormat, RecordValues, encode_records
from harness.stream.is900.emulator.argument import MISSING, OUT_OF_RANGE, CommandArgument, CommandError
from harness.stream.is900.emulator.config import SUPPORTED_BAUD_RATES
from harness.stream.is900.emulator.settings import (
    IDENTITY_QUATERNION,
    STATION_NAMES,
    ZERO_VECTOR,
    DeviceSettings,
    StationSettings,
    align,
    alignment_cm,
)

Setter = Callable[[DeviceSettings, CommandArgument], DeviceSettings]
_CM = 0.01
_NO_VALUES = RecordValues(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0))


def _with_station(settings: DeviceSettings, argument: CommandArgument, **values: Any) -> DeviceSettings:
    name = argument.station()
    return settings.with_station(name, replace(settings.station(name), **values))


def _set_output_list(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    items = tuple(argument.codes())
    try:
        record_type(items)
        encode_records(items, np.zeros(0, np.uint8), _NO_VALUES, RecordFormat())
    except (HarnessError, ValueError) as error:  # an unknown item, one that cannot be written, or one listed twice
        raise CommandError(OUT_OF_RANGE, 2) from error
    return _with_station(settings, argument, items=items)


def _set_alignment(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    name = argument.station()
    origin, on_x, on_y = _CM * np.array(argument.numbers(9)).reshape(3, 3)
    aligned = align(settings.station(name), origin, on_x, on_y)
    if aligned is None:
        raise CommandError(OUT_OF_RANGE, 2)
    return settings.with_station(name, aligned)


def _set_serial(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    """Set the serial line: `o1152,N,8,0` is a hundredth of the baud rate, parity, bits, handshake."""
    if len(argument.fields) < 4:
        raise CommandError(MISSING, len(argument.fields) + 1)
    hundredths, parity = CommandArgument(argument.fields[0]).integer(3, 1152, start=0), argument.fields[1]
    bits, handshake = CommandArgument(",".join(argument.fields[2:])).numbers(2, start=0)
    if (
        100 * hundredths not in SUPPORTED_BAUD_RATES
        or parity not in ("N", "O", "E")
        or bits not in (7, 8)
        or handshake not in (0, 1)
    ):
        raise CommandError(OUT_OF_RANGE)
    return replace(settings, baud=100 * hundredths, framing=(parity, int(bits), int(handshake)))


def _set_genlock(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    state, rate_hz = argument.numbers(2, start=0)
    if state not in range(4) or not 0.0 <= rate_hz < 1000.0:
        raise CommandError(OUT_OF_RANGE)
    return replace(settings, genlock=str(int(state)), genlock_hz=rate_hz)


def _add_emitter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    number = CommandArgument(argument.fields[0]).integer(1, 9999999, start=0)
    x, y, z, nx, ny, nz, identity = argument.numbers(7)
    emitter = replies.Emitter(number, (x, y, z), (nx, ny, nz), int(identity))
    others = (emitter for emitter in settings.draft_emitters if emitter.number != number)
    return replace(settings, draft_emitters=tuple(sorted((*others, emitter), key=lambda emitter: emitter.number)))


def _remove_emitter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    """Remove an emitter; FreeVR names its hardware identity too (docs/is900.md 4.2)."""
    number = CommandArgument(argument.fields[0]).integer(1, 9999999, start=0)
    if argument.sets:
        argument.integer(0, 9999999)
    return replace(
        settings, draft_emitters=tuple(emitter for emitter in settings.draft_emitters if emitter.number != number)
    )


def _set_address(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    parts = argument.text.strip(" ,").split(".")
    if len(parts) != 4 or not all(part.isascii() and part.isdigit() and int(part) < 256 for part in parts):
        raise CommandError(OUT_OF_RANGE)
    return replace(settings, address=".".join(parts))


def _set_genlock_phase(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    return replace(settings, genlock_phase=argument.numbers(1, start=0)[0])


def _no_change(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    return settings


def _float_setter(field: str, count: int, scale: float = 1.0) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        return _with_station(settings, argument, **{field: tuple(scale * value for value in argument.numbers(count))})

    return setter


def _station_setter(field: str, low: int, high: int) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        return _with_station(settings, argument, **{field: argument.integer(low, high)})

    return setter


def _device_setter(field: str, low: int, high: int, kind: type = int) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        return replace(settings, **{field: kind(argument.integer(low, high, start=0))})

    return setter


def _constant_setter(**values: Any) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        argument.require_empty()
        return replace(settings, **values)

    return setter


def _station_reset(**values: Any) -> Setter:
    return lambda settings, argument: _with_station(settings, argument, **values)


def _emitter_setter(change: Callable[[DeviceSettings], dict[str, Any]]) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        argument.require_empty()
        return replace(settings, **change(settings))

    return setter


SETTER_COMMANDS: dict[str, Setter] = {
    "O": _set_output_list,
    "A": _set_alignment,
    "G": _float_setter("reference_deg", 3),
    "H": _float_setter("hemisphere", 3),
    "N": _float_setter("tip_m", 3, _CM),
    "V": _float_setter("envelope_m", 6),
    "Mp": _station_setter("prediction_ms", 0, 50),
    "MQ": _station_setter("sensitivity", 1, 5),
    "MG": _set_genlock,
    "MU": _device_setter("timeout_ms", 0, 99),
    "Mg": _device_setter("gain", 0, 9),
    "MCF": _add_emitter,
    "MCI": _no_change,
    "MSchAlg": _device_setter("scheduling", 1, 2),
    "MConfigLockMode": _device_setter("lock", 0, 2),
    "MEthIp": _set_address,
    "MEthUdp": _device_setter("udp", 0, 1, bool),
    "MEthUdpPort": _device_setter("udp_port", 1, 65535),
}
"""Commands that set, or query when they have nothing to set."""

SET_ONLY_COMMANDS: dict[str, Setter] = {
    "R": _station_reset(origin_m=ZERO_VECTOR, tracker_from_aligned=IDENTITY_QUATERNION),
    "b": _station_reset(heading_boresight=IDENTITY_QUATERNION, full_boresight=IDENTITY_QUATERNION),
    "o": _set_serial,
    "x": _no_change,
    "v": _no_change,
    "MF": _station_setter("enhancement", 0, 2),
    "MH": _station_setter("compass", 0, 2),
    "Mh": _station_reset(compass=0),
    "MT": _constant_setter(microseconds=False),
    "Mt": _constant_setter(microseconds=True),
    "MBI": _constant_setter(boresight_as_fastrak=False),
    "MBF": _constant_setter(boresight_as_fastrak=True),
    "MGP": _set_genlock_phase,
    "MGS": _device_setter("genlock_source", 1, 2),
    "MCf": _remove_emitter,
    "MCC": _constant_setter(draft_emitters=()),
    "MCe": _emitter_setter(lambda settings: {"emitters": settings.draft_emitters}),
    "MCx": _emitter_setter(lambda settings: {"draft_emitters": settings.emitters}),
    "MCi": _no_change,
    "ML0": _constant_setter(lights=False),
    "ML1": _constant_setter(lights=True),
    "MLB": _device_setter("brightness", 0, 100),
    "ME0": _constant_setter(error_log=False),
    "ME1": _constant_setter(error_log=True),
    "MLogOpen": _constant_setter(command_log=True),
    "MLogClose": _constant_setter(command_log=False),
}
"""Commands that only set."""

SINGLE_FIELD_SETTERS = {"MU", "Mg", "MSchAlg", "MConfigLockMode", "MEthIp", "MEthUdp", "MEthUdpPort"}
"""Those of `SETTER_COMMANDS` that set with their first field."""


Query = Callable[[DeviceSettings, CommandArgument], Iterable[replies.ParsedReply]]
_NO_INERTIA_CUBE = -1
"""The answer for a station without one (docs/is900.md 14)."""
_STATE_FLAGS = 32
"""Number of flags in the reply to `l*`."""


def _station_query(reply: Callable[[str, StationSettings], replies.ParsedReply]) -> Query:
    def query(settings: DeviceSettings, argument: CommandArgument) -> Iterable[replies.ParsedReply]:
        name = argument.station()
        return [reply(name, settings.station(name))]

    return query


def _device_query(reply: Callable[[DeviceSettings], replies.ParsedReply]) -> Query:
    def query(settings: DeviceSettings, argument: CommandArgument) -> Iterable[replies.ParsedReply]:
        argument.require_empty()
        return [reply(settings)]

    return query


def _text_reply(text: str) -> replies.ParsedReply:
    return replies.UnknownReply(text.encode("ascii"))


def _station_states(settings: DeviceSettings, argument: CommandArgument) -> Iterable[replies.ParsedReply]:
    """Reply to `l`; without a station it tells the first four (docs/is900.md 6.3)."""
    if argument.text.strip() == "*":
        active = [station.active for station in settings.stations]
        return [replies.StationStates(None, (*active, *[False] * (_STATE_FLAGS - len(active))))]
    name = argument.station() if argument.text.strip() else "1"
    return [replies.StationStates(name, tuple(settings.station(queried).active for queried in (name, *"234")))]


def _emitter_list(settings: DeviceSettings, argument: CommandArgument) -> Iterable[replies.ParsedReply]:
    if not argument.text.strip():
        return settings.emitters
    number = argument.integer(1, 9999999, start=0)
    matches = [emitter for emitter in settings.emitters if emitter.number == number]
    if not matches:
        raise CommandError(OUT_OF_RANGE)
    return matches


QUERIES: dict[str, Query] = {
    "O": _station_query(lambda name, station: replies.OutputList(name, station.items)),
    "l": _station_states,
    "A": _station_query(lambda name, station: replies.GeometryReply(name, "A", alignment_cm(station))),
    "G": _station_query(lambda name, station: replies.GeometryReply(name, "G", station.reference_deg)),
    "H": _station_query(lambda name, station: replies.GeometryReply(name, "H", station.hemisphere)),
    "N": _station_query(
        lambda name, station: replies.GeometryReply(name, "N", tuple(100.0 * value for value in station.tip_m))
    ),
    "V": _station_query(lambda name, station: replies.GeometryReply(name, "V", station.envelope_m)),
    "MS": _device_query(
        lambda settings: replies.SystemRecord(
            boresight_as_fastrak=settings.boresight_as_fastrak,
            microseconds=settings.microseconds,
            lights=settings.lights,
        )
    ),
    "Ms": _station_query(lambda name, station: replies.StationRecord(name, station.enhancement, station.compass)),
    "Mp": _station_query(lambda name, station: replies.PredictionReply(name, station.prediction_ms)),
    "MQ": _station_query(lambda name, station: replies.SensitivityReply(name, station.sensitivity)),
    "MG": _device_query(lambda settings: replies.GenlockReply(settings.genlock, settings.genlock_hz)),
    "MU": _device_query(lambda settings: replies.IntegerReply("1", "U", settings.timeout_ms)),
    "Mg": _device_query(lambda settings: replies.IntegerReply("1", "g", settings.gain)),
    "MCF": _emitter_list,
    "MCI": _station_query(
        lambda name, station: replies.IntegerReply(
            name, "I", 1 + STATION_NAMES.index(name) if station.active else _NO_INERTIA_CUBE
        )
    ),
    "MLogState": _device_query(lambda settings: _text_reply(f"31LS{int(settings.command_log)}")),
    "MSchAlg": _device_query(lambda settings: _text_reply(f"31SchAlg{settings.scheduling}")),
    "MConfigLockMode": _device_query(lambda settings: _text_reply(f"31CLM{settings.lock}")),
    "MEthIp": _device_query(lambda settings: _text_reply(f"31EI{settings.address}")),
    "MEthUdp": _device_query(lambda settings: _text_reply(f"31EU{int(settings.udp)}")),
    "MEthUdpPort": _device_query(lambda settings: _text_reply(f"31EUP{settings.udp_port}")),
    "MSystemTest1": _device_query(lambda settings: _text_reply("51T1 OK")),
    "MSystemTest2": _device_query(lambda settings: _text_reply("51T2 OK")),
}
"""The reply to each query. Texts after `51T`, `31LS` and so on are ours where no source quotes them."""
