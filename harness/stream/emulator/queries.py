"""Questions about settings: settings in, replies out (docs/is900.md 6)."""

from collections.abc import Callable, Iterable

from harness.stream.codec.replies import (
    Digits,
    Genlock,
    Numbers,
    OutputList,
    Prediction,
    ReplyEvent,
    Sensitivity,
    StationRecord,
    StationStates,
    SystemRecord,
    Unknown,
)
from harness.stream.emulator import geometry
from harness.stream.emulator.argument import OUT_OF_RANGE, Argument, Refused
from harness.stream.emulator.settings import STATIONS, DeviceSettings, StationSettings

Query = Callable[[DeviceSettings, Argument], Iterable[ReplyEvent]]
_FLAGS = 32
"""In the answer to `l*`."""


def _of_station(reply: Callable[[str, StationSettings], ReplyEvent]) -> Query:
    def query(settings: DeviceSettings, argument: Argument) -> Iterable[ReplyEvent]:
        name = argument.station()
        return [reply(name, settings.station(name))]

    return query


def _of_device(reply: Callable[[DeviceSettings], ReplyEvent]) -> Query:
    def query(settings: DeviceSettings, argument: Argument) -> Iterable[ReplyEvent]:
        argument.nothing()
        return [reply(settings)]

    return query


def _text(text: str) -> ReplyEvent:
    return Unknown(text.encode("ascii"))


def _states(settings: DeviceSettings, argument: Argument) -> Iterable[ReplyEvent]:
    """InterSense's library of 1999 names no station where it asks for all of them (docs/is900.md 14)."""
    if argument.text.strip() in ("*", ""):
        active = [station.active for station in settings.stations]
        return [StationStates(None, (*active, *[False] * (_FLAGS - len(active))))]
    name = argument.station()
    return [StationStates(name, tuple(settings.station(asked).active for asked in (name, *"234")))]


def _emitters(settings: DeviceSettings, argument: Argument) -> Iterable[ReplyEvent]:
    if not argument.text.strip():
        return settings.emitters
    number = argument.whole(1, 9999999, after=0)
    found = [emitter for emitter in settings.emitters if emitter.number == number]
    if not found:
        raise Refused(OUT_OF_RANGE)
    return found


QUERIES: dict[str, Query] = {
    "O": _of_station(lambda name, station: OutputList(name, station.items)),
    "l": _states,
    "A": _of_station(lambda name, station: Numbers(name, "A", geometry.alignment_cm(station))),
    "G": _of_station(lambda name, station: Numbers(name, "G", station.mounting_deg)),
    "H": _of_station(lambda name, station: Numbers(name, "H", station.reference_deg)),
    "N": _of_station(lambda name, station: Numbers(name, "N", tuple(100.0 * value for value in station.tip_m))),
    "V": _of_station(lambda name, station: Numbers(name, "V", station.envelope_m)),
    "MS": _of_device(
        lambda settings: SystemRecord(
            boresight_as_fastrak=settings.boresight_as_fastrak,
            microseconds=settings.microseconds,
            lights=settings.lights,
        )
    ),
    "Ms": _of_station(lambda name, station: StationRecord(name, station.enhancement, station.compass)),
    "Mp": _of_station(lambda name, station: Prediction(name, station.prediction_ms)),
    "MQ": _of_station(lambda name, station: Sensitivity(name, station.sensitivity)),
    "MG": _of_device(lambda settings: Genlock(settings.genlock, settings.genlock_hz)),
    "MU": _of_device(lambda settings: Digits("1", "U", settings.timeout_ms)),
    "Mg": _of_device(lambda settings: Digits("1", "g", settings.gain)),
    "MCF": _emitters,
    "MCI": _of_station(lambda name, station: Digits(name, "I", 1 + STATIONS.index(name) if station.active else -1)),
    "MLogState": _of_device(lambda settings: _text(f"31LS{int(settings.command_log)}")),
    "MSchAlg": _of_device(lambda settings: _text(f"31SchAlg{settings.scheduling}")),
    "MConfigLockMode": _of_device(lambda settings: _text(f"31CLM{settings.lock}")),
    "MEthIp": _of_device(lambda settings: _text(f"31EI{settings.address}")),
    "MEthUdp": _of_device(lambda settings: _text(f"31EU{int(settings.udp)}")),
    "MEthUdpPort": _of_device(lambda settings: _text(f"31EUP{settings.udp_port}")),
    "MSystemTest1": _of_device(lambda settings: _text("51T1 OK")),
    "MSystemTest2": _of_device(lambda settings: _text("51T2 OK")),
}
"""What each answers; the texts after `51T`, `31LS` and so on are ours where no source quotes them."""
