"""Commands that InterSense added, and queries of settings (docs/is900.md 4 and 6): settings and arguments in, settings
or replies out.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from harness.stream.polhemus.codec import replies
from harness.stream.polhemus.emulator.argument import OUT_OF_RANGE, CommandArgument, CommandError
from harness.stream.polhemus.emulator.setting_commands import (
    STATION_QUERIES,
    STATION_RESETS,
    STATION_SETTERS,
    Query,
    Setter,
    no_change,
    station_query,
    station_reset,
    station_setter,
    station_states,
)
from harness.stream.polhemus.emulator.settings import STATION_NAMES, DeviceSettings


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


def _device_setter(field: str, low: int, high: int, kind: type = int) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        return replace(settings, **{field: kind(argument.integer(low, high, start=0))})

    return setter


def _bare_setter(change: Callable[[DeviceSettings], dict[str, Any]]) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        argument.require_empty()
        return replace(settings, **change(settings))

    return setter


def _constant_setter(**values: Any) -> Setter:
    return _bare_setter(lambda settings: values)


SETTER_COMMANDS: dict[str, Setter] = {
    **STATION_SETTERS,
    "Mp": station_setter("prediction_ms", 0, 50),
    "MQ": station_setter("sensitivity", 1, 5),
    "MG": _set_genlock,
    "MU": _device_setter("timeout_ms", 0, 99),
    "Mg": _device_setter("gain", 0, 9),
    "MCF": _add_emitter,
    "MCI": no_change,
    "MSchAlg": _device_setter("scheduling", 1, 2),
    "MConfigLockMode": _device_setter("lock", 0, 2),
    "MEthIp": _set_address,
    "MEthUdp": _device_setter("udp", 0, 1, bool),
    "MEthUdpPort": _device_setter("udp_port", 1, 65535),
}
"""Commands that set, or query when they have nothing to set."""

SET_ONLY_COMMANDS: dict[str, Setter] = {
    **STATION_RESETS,
    "MF": station_setter("enhancement", 0, 2),
    "MH": station_setter("compass", 0, 2),
    "Mh": station_reset(compass=0),
    "MT": _constant_setter(microseconds=False),
    "Mt": _constant_setter(microseconds=True),
    "MBI": _constant_setter(boresight_as_fastrak=False),
    "MBF": _constant_setter(boresight_as_fastrak=True),
    "MGP": _set_genlock_phase,
    "MGS": _device_setter("genlock_source", 1, 2),
    "MCf": _remove_emitter,
    "MCC": _constant_setter(draft_emitters=()),
    "MCe": _bare_setter(lambda settings: {"emitters": settings.draft_emitters}),
    "MCx": _bare_setter(lambda settings: {"draft_emitters": settings.emitters}),
    "MCi": no_change,
    "ML0": _constant_setter(lights=False),
    "ML1": _constant_setter(lights=True),
    "MLB": _device_setter("brightness", 0, 100),
    "ME0": _constant_setter(error_log=False),
    "ME1": _constant_setter(error_log=True),
    "MLogOpen": _constant_setter(command_log=True),
    "MLogClose": _constant_setter(command_log=False),
}
"""Commands that only set."""

SINGLE_FIELD_SETTERS = frozenset({"MU", "Mg", "MSchAlg", "MConfigLockMode", "MEthIp", "MEthUdp", "MEthUdpPort"})
"""Those of `SETTER_COMMANDS` that set with their first field."""


_NO_INERTIA_CUBE = -1
"""The answer for a station without one (docs/is900.md 14)."""
_STATE_FLAGS = 32
"""Number of flags in the reply to `l*`."""


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
    return station_states(settings, argument if argument.text.strip() else CommandArgument("1"))


def _emitter_list(settings: DeviceSettings, argument: CommandArgument) -> Iterable[replies.ParsedReply]:
    if not argument.text.strip():
        return settings.emitters
    number = argument.integer(1, 9999999, start=0)
    matches = [emitter for emitter in settings.emitters if emitter.number == number]
    if not matches:
        raise CommandError(OUT_OF_RANGE)
    return matches


QUERIES: dict[str, Query] = {
    **STATION_QUERIES,
    "l": _station_states,
    "MS": _device_query(
        lambda settings: replies.SystemRecord(
            boresight_as_fastrak=settings.boresight_as_fastrak,
            microseconds=settings.microseconds,
            lights=settings.lights,
        )
    ),
    "Ms": station_query(
        lambda name, station, unit_m: replies.StationRecord(name, station.enhancement, station.compass)
    ),
    "Mp": station_query(lambda name, station, unit_m: replies.PredictionReply(name, station.prediction_ms)),
    "MQ": station_query(lambda name, station, unit_m: replies.SensitivityReply(name, station.sensitivity)),
    "MG": _device_query(lambda settings: replies.GenlockReply(settings.genlock, settings.genlock_hz)),
    "MU": _device_query(lambda settings: replies.IntegerReply("1", "U", settings.timeout_ms)),
    "Mg": _device_query(lambda settings: replies.IntegerReply("1", "g", settings.gain)),
    "MCF": _emitter_list,
    "MCI": station_query(
        lambda name, station, unit_m: replies.IntegerReply(
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
