"""The settings of a station that change what it reports: how each is read, what its default is, and how it is set.

Programs that share a device leave such settings in it. `session_settings` sets them to defaults for a session.
Boresight is no setting here, because the device does not report it (docs/is900.md 4.1).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.stream.codec import commands
from harness.stream.codec.replies import GeometryReply, ParsedReply, PredictionReply, SensitivityReply, StationRecord

Values = tuple[float, ...]
_TOLERANCE = 1e-2
"""Values that differ by less than this are equal: replies have two decimals [cm, deg]."""


@dataclass(frozen=True)
class StationSetting:
    """One kind of setting."""

    name: str
    """Name for a person, with the letters of the command."""
    unit: str
    default: Values
    """Values after power-on, or any that are equivalent to them."""
    query: Callable[[str], bytes]
    """Returns the query for a station."""
    values_of: Callable[[ParsedReply, str], Values | None]
    """Returns the values in a reply about this station; None for another reply."""
    setters: Callable[[str, Values], list[bytes]]
    """Returns the commands that set the values of a station."""
    canonical: Callable[[Values], Values] = lambda values: values
    """Returns equal values for settings that have the same effect."""

    def equal(self, first: Values, second: Values) -> bool:
        """Whether two settings have the same effect."""
        return bool(np.allclose(self.canonical(first), self.canonical(second), rtol=0.0, atol=_TOLERANCE))

    def is_default(self, values: Values) -> bool:
        """Whether these values have the effect of the default."""
        return self.equal(values, self.default)

    def describe(self, values: Values) -> str:
        """Return the name with the values: `tip offset N 0, 0, 30 cm`."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.name} {', '.join(f'{value:g}' for value in values)}{unit}"


def _geometry_setting(letter: str, name: str, unit: str) -> StationSetting:
    return StationSetting(
        f"{name} {letter}",
        unit,
        (0.0, 0.0, 0.0),
        lambda station: commands.query_geometry(station, letter),
        lambda reply, station: _geometry_values(reply, station, letter),
        lambda station, values: [commands.set_geometry(station, letter, values)],
    )


def _geometry_values(reply: ParsedReply, station: str, letter: str) -> Values | None:
    is_answer = isinstance(reply, GeometryReply) and (reply.station, reply.letter) == (station, letter)
    return reply.values if is_answer and isinstance(reply, GeometryReply) else None


def _canonical_alignment(values: Values) -> Values:
    """Return the origin [cm] and 100 times the axes that nine numbers define: points on an axis may be anywhere."""
    origin, on_x, on_y = np.array(values).reshape(3, 3)
    x, z = on_x - origin, np.cross(on_x - origin, on_y - origin)
    if not (np.linalg.norm(x) > 0.0 and np.linalg.norm(z) > 0.0):
        return values
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return tuple(np.concatenate([origin, 100.0 * x, 100.0 * z]).tolist())


def _alignment_setters(station: str, values: Values) -> list[bytes]:
    points = values[0:3], values[3:6], values[6:9]
    is_default = ALIGNMENT.is_default(values)
    return [commands.undo_alignment(station), *([] if is_default else [commands.alignment(station, *points)])]


def _integer_setting(
    name: str,
    unit: str,
    default: int,
    query: Callable[[str], bytes],
    value_of: Callable[[ParsedReply, str], int | None],
    setter: Callable[[str, int], bytes],
) -> StationSetting:
    def values_of(reply: ParsedReply, station: str) -> Values | None:
        value = value_of(reply, station)
        return None if value is None else (float(value),)

    return StationSetting(
        name, unit, (float(default),), query, values_of, lambda station, values: [setter(station, int(values[0]))]
    )


def _prediction_ms(reply: ParsedReply, station: str) -> int | None:
    return reply.ahead_ms if isinstance(reply, PredictionReply) and reply.station == station else None


def _sensitivity(reply: ParsedReply, station: str) -> int | None:
    return reply.level if isinstance(reply, SensitivityReply) and reply.station == station else None


def _enhancement(reply: ParsedReply, station: str) -> int | None:
    return reply.enhancement if isinstance(reply, StationRecord) and reply.station == station else None


ALIGNMENT = StationSetting(
    "alignment A",
    "cm",
    (0.0, 0.0, 0.0, 200.0, 0.0, 0.0, 0.0, 200.0, 0.0),
    lambda station: commands.query_geometry(station, "A"),
    lambda reply, station: _geometry_values(reply, station, "A"),
    _alignment_setters,
    _canonical_alignment,
)
STATION_SETTINGS = (
    ALIGNMENT,
    _geometry_setting("N", "tip offset", "cm"),
    _geometry_setting("G", "boresight reference angles", "deg"),
    _integer_setting("prediction Mp", "ms", 0, commands.query_prediction, _prediction_ms, commands.prediction),
    _integer_setting("sensitivity MQ", "", 3, commands.query_sensitivity, _sensitivity, commands.sensitivity),
    _integer_setting("enhancement MF", "", 0, commands.query_station, _enhancement, commands.enhancement),
)
"""All settings of a station that are read. The manual gives the defaults of `Mp` and `MQ`. That of `MF` is a choice: 0
is the most exact."""
