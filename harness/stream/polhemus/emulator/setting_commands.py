"""Commands of the Fastrak class that change or query settings (docs/is900.md 4 and 6): settings and arguments in,
settings or replies out. A device family adds its own.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from harness.errors import HarnessError
from harness.stream.polhemus.codec import replies
from harness.stream.polhemus.codec.items import record_type
from harness.stream.polhemus.codec.records import RecordFormat, RecordValues, encode_records
from harness.stream.polhemus.emulator.argument import MISSING, OUT_OF_RANGE, CommandArgument, CommandError
from harness.stream.polhemus.emulator.config import SUPPORTED_BAUD_RATES
from harness.stream.polhemus.emulator.settings import (
    IDENTITY_QUATERNION,
    ZERO_VECTOR,
    DeviceSettings,
    StationSettings,
    align,
    alignment_m,
)

Setter = Callable[[DeviceSettings, CommandArgument], DeviceSettings]
_NO_VALUES = RecordValues(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 4)), np.zeros(0))


def with_station(settings: DeviceSettings, argument: CommandArgument, **values: Any) -> DeviceSettings:
    name = argument.station()
    return settings.with_station(name, replace(settings.station(name), **values))


def _set_output_list(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    items = tuple(argument.codes())
    try:
        record_type(items)
        encode_records(items, np.zeros(0, np.uint8), _NO_VALUES, RecordFormat())
    except (HarnessError, ValueError) as error:  # an unknown item, one that cannot be written, or one listed twice
        raise CommandError(OUT_OF_RANGE, 2) from error
    return with_station(settings, argument, items=items)


def _set_alignment(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    name = argument.station()
    origin, on_x, on_y = settings.command_unit_m * np.array(argument.numbers(9)).reshape(3, 3)
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


def no_change(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    return settings


def _float_setter(field: str, count: int) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        return with_station(settings, argument, **{field: tuple(argument.numbers(count))})

    return setter


def _set_tip(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
    tip_m = tuple(settings.command_unit_m * value for value in argument.numbers(3))
    return with_station(settings, argument, tip_m=tip_m)


def station_setter(field: str, low: int, high: int) -> Setter:
    def setter(settings: DeviceSettings, argument: CommandArgument) -> DeviceSettings:
        return with_station(settings, argument, **{field: argument.integer(low, high)})

    return setter


def station_reset(**values: Any) -> Setter:
    return lambda settings, argument: with_station(settings, argument, **values)


STATION_SETTERS: dict[str, Setter] = {
    "O": _set_output_list,
    "A": _set_alignment,
    "G": _float_setter("reference_deg", 3),
    "H": _float_setter("hemisphere", 3),
    "N": _set_tip,
    "V": _float_setter("envelope_m", 6),
}
"""Commands that set, or query when they have nothing to set."""

STATION_RESETS: dict[str, Setter] = {
    "R": station_reset(origin_m=ZERO_VECTOR, tracker_from_aligned=IDENTITY_QUATERNION),
    "b": station_reset(heading_boresight=IDENTITY_QUATERNION, full_boresight=IDENTITY_QUATERNION),
    "o": _set_serial,
    "x": no_change,
    "v": no_change,
}
"""Commands that only set."""


Query = Callable[[DeviceSettings, CommandArgument], Iterable[replies.ParsedReply]]


def station_query(reply: Callable[[str, StationSettings, float], replies.ParsedReply]) -> Query:
    """Query of a station: `reply` takes its character, its settings and the unit of lengths in commands [m]."""

    def query(settings: DeviceSettings, argument: CommandArgument) -> Iterable[replies.ParsedReply]:
        name = argument.station()
        return [reply(name, settings.station(name), settings.command_unit_m)]

    return query


def geometry_query(letter: str, values: Callable[[StationSettings, float], Iterable[float]]) -> Query:
    """Query of numbers of a station: `values` takes its settings and the unit of lengths in commands [m]."""
    return station_query(
        lambda name, station, unit_m: replies.GeometryReply(name, letter, tuple(values(station, unit_m)))
    )


def station_states(settings: DeviceSettings, argument: CommandArgument) -> Iterable[replies.ParsedReply]:
    """Reply to `l{st}`: the states of this station and of stations 2, 3 and 4 (docs/is900.md 6.3)."""
    name = argument.station()
    return [replies.StationStates(name, tuple(settings.station(queried).active for queried in (name, *"234")))]


STATION_QUERIES: dict[str, Query] = {
    "O": station_query(lambda name, station, unit_m: replies.OutputList(name, station.items)),
    "l": station_states,
    "A": geometry_query("A", lambda station, unit_m: (value / unit_m for value in alignment_m(station))),
    "G": geometry_query("G", lambda station, unit_m: station.reference_deg),
    "H": geometry_query("H", lambda station, unit_m: station.hemisphere),
    "N": geometry_query("N", lambda station, unit_m: (value / unit_m for value in station.tip_m)),
    "V": geometry_query("V", lambda station, unit_m: station.envelope_m),
}
"""The reply to each query."""
