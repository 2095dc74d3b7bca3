"""Queries of settings: settings in, replies out (docs/is900.md 6)."""

from collections.abc import Callable, Iterable

from harness.stream.codec.replies import (
    GenlockReply,
    GeometryReply,
    IntegerReply,
    OutputList,
    ParsedReply,
    PredictionReply,
    SensitivityReply,
    StationRecord,
    StationStates,
    SystemRecord,
    UnknownReply,
)
from harness.stream.emulator import geometry
from harness.stream.emulator.argument import OUT_OF_RANGE, CommandArgument, CommandError
from harness.stream.emulator.settings import STATION_NAMES, DeviceSettings, StationSettings

Query = Callable[[DeviceSettings, CommandArgument], Iterable[ParsedReply]]
_NO_INERTIA_CUBE = -1
"""The answer for a station without one (docs/is900.md 14)."""
_STATE_FLAGS = 32
"""Number of flags in the reply to `l*`."""


def _station_query(reply: Callable[[str, StationSettings], ParsedReply]) -> Query:
    def query(settings: DeviceSettings, argument: CommandArgument) -> Iterable[ParsedReply]:
        name = argument.station()
        return [reply(name, settings.station(name))]

    return query


def _device_query(reply: Callable[[DeviceSettings], ParsedReply]) -> Query:
    def query(settings: DeviceSettings, argument: CommandArgument) -> Iterable[ParsedReply]:
        argument.require_empty()
        return [reply(settings)]

    return query


def _text_reply(text: str) -> ParsedReply:
    return UnknownReply(text.encode("ascii"))


def _station_states(settings: DeviceSettings, argument: CommandArgument) -> Iterable[ParsedReply]:
    """Reply to `l`; without a station it tells the first four (docs/is900.md 6.3)."""
    if argument.text.strip() == "*":
        active = [station.active for station in settings.stations]
        return [StationStates(None, (*active, *[False] * (_STATE_FLAGS - len(active))))]
    name = argument.station() if argument.text.strip() else "1"
    return [StationStates(name, tuple(settings.station(queried).active for queried in (name, *"234")))]


def _emitter_list(settings: DeviceSettings, argument: CommandArgument) -> Iterable[ParsedReply]:
    if not argument.text.strip():
        return settings.emitters
    number = argument.integer(1, 9999999, start=0)
    matches = [emitter for emitter in settings.emitters if emitter.number == number]
    if not matches:
        raise CommandError(OUT_OF_RANGE)
    return matches


QUERIES: dict[str, Query] = {
    "O": _station_query(lambda name, station: OutputList(name, station.items)),
    "l": _station_states,
    "A": _station_query(lambda name, station: GeometryReply(name, "A", geometry.alignment_cm(station))),
    "G": _station_query(lambda name, station: GeometryReply(name, "G", station.reference_deg)),
    "H": _station_query(lambda name, station: GeometryReply(name, "H", station.hemisphere)),
    "N": _station_query(
        lambda name, station: GeometryReply(name, "N", tuple(100.0 * value for value in station.tip_m))
    ),
    "V": _station_query(lambda name, station: GeometryReply(name, "V", station.envelope_m)),
    "MS": _device_query(
        lambda settings: SystemRecord(
            boresight_as_fastrak=settings.boresight_as_fastrak,
            microseconds=settings.microseconds,
            lights=settings.lights,
        )
    ),
    "Ms": _station_query(lambda name, station: StationRecord(name, station.enhancement, station.compass)),
    "Mp": _station_query(lambda name, station: PredictionReply(name, station.prediction_ms)),
    "MQ": _station_query(lambda name, station: SensitivityReply(name, station.sensitivity)),
    "MG": _device_query(lambda settings: GenlockReply(settings.genlock, settings.genlock_hz)),
    "MU": _device_query(lambda settings: IntegerReply("1", "U", settings.timeout_ms)),
    "Mg": _device_query(lambda settings: IntegerReply("1", "g", settings.gain)),
    "MCF": _emitter_list,
    "MCI": _station_query(
        lambda name, station: IntegerReply(
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
