"""Settings that other programs left in the device: read at connection, at their defaults for a session, put back.

The device has one set of settings for all programs. An alignment, a tip offset or another filter changes every reading,
and nothing in a record shows it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.stream.polhemus.codec import commands
from harness.stream.polhemus.codec.commands import station_command
from harness.stream.polhemus.codec.replies import (
    GeometryReply,
    OutputList,
    ParsedReply,
    PredictionReply,
    SensitivityReply,
    StationRecord,
    StatusRecord,
    SystemRecord,
)
from harness.stream.polhemus.driver.connection import DeviceConnection

Values = tuple[float, ...]
_TOLERANCE = 1e-2
"""Values that differ by less than this are equal: replies have two decimals [cm, deg]."""


@dataclass(frozen=True)
class StationSetting:
    """One kind of setting of a station that changes what it reports.

    Boresight is none, because the device does not report it (docs/is900.md 4.1).
    """

    what: str
    letter: str
    """Name of the command that sets it."""
    unit: str
    default: Values
    """Values after power-on, or any that are equivalent to them."""
    query: str = ""
    """Name of the command that queries it, where that is another one."""

    @property
    def name(self) -> str:
        """Name for a person, with the letters of the command."""
        return f"{self.what} {self.letter}"

    def query_command(self, station: str) -> bytes:
        """Return the query for a station."""
        return station_command(self.query or self.letter, station)

    def values_of(self, reply: ParsedReply, station: str) -> Values | None:
        """Return the values in a reply about this station; None for another reply."""
        match reply:
            case GeometryReply() if (reply.station, reply.letter) == (station, self.letter):
                return reply.values
            case PredictionReply() if (reply.station, "Mp") == (station, self.letter):
                return (float(reply.ahead_ms),)
            case SensitivityReply() if (reply.station, "MQ") == (station, self.letter):
                return (float(reply.level),)
            case StationRecord() if (reply.station, "MF") == (station, self.letter):
                return (float(reply.enhancement),)
        return None

    def setters(self, station: str, values: Values) -> list[bytes]:
        """Return the commands that set the values of a station. An alignment is set in the present frame."""
        if self.letter != "A":
            return [station_command(self.letter, station, values, 3 if len(values) > 1 else 0)]
        alignment = [] if self.is_default(values) else [station_command("A", station, values, 2)]
        return [station_command("R", station), *alignment]

    def is_default(self, values: Values) -> bool:
        """Whether these values have the effect of the default."""
        canonical = _canonical_alignment if self.letter == "A" else np.array
        return bool(np.allclose(canonical(values), canonical(self.default), rtol=0.0, atol=_TOLERANCE))

    def describe(self, values: Values) -> str:
        """Return the name with the values: `tip offset N 0, 0, 30 cm`."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.name} {', '.join(f'{value:g}' for value in values)}{unit}"


def _canonical_alignment(values: Values) -> Floats:
    """Return the origin [cm] and 100 times the axes that nine numbers define: points on an axis may be anywhere."""
    origin, on_x, on_y = np.array(values).reshape(3, 3)
    x, z = on_x - origin, np.cross(on_x - origin, on_y - origin)
    if not (np.linalg.norm(x) > 0.0 and np.linalg.norm(z) > 0.0):
        return np.array(values)
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return np.concatenate([origin, 100.0 * x, 100.0 * z])


_ZERO = (0.0, 0.0, 0.0)
STATION_SETTINGS = (
    StationSetting("alignment", "A", "cm", (*_ZERO, 200.0, 0.0, 0.0, 0.0, 200.0, 0.0)),
    StationSetting("tip offset", "N", "cm", _ZERO),
    StationSetting("boresight reference angles", "G", "deg", _ZERO),
    StationSetting("prediction", "Mp", "ms", (0.0,)),
    StationSetting("sensitivity", "MQ", "", (3.0,)),
    StationSetting("enhancement", "MF", "", (0.0,), query="Ms"),
)
"""All settings of a station that are read. The manual gives the defaults of `Mp` and `MQ`. That of `MF` is a choice: 0
is the most exact."""


StationValues = dict[tuple[str, str], Values]
"""Values by station character and name of the setting."""
_SETTINGS = {setting.name: setting for setting in STATION_SETTINGS}


@dataclass
class SessionSettings:
    """The settings of the selected stations and of the device as they were at connection."""

    stations: str
    """Characters of the stations."""
    status: StatusRecord
    """The reply to `S`: format and unit."""
    system: SystemRecord | None = None
    """The reply to `MS`: unit of the clock and kind of boresight; None when there is none."""
    lists: dict[str, tuple[int, ...]] = field(default_factory=dict)
    """Output list of each station that reported it."""
    values: StationValues = field(default_factory=dict)
    """Settings that were reported."""

    @property
    def unreadable(self) -> tuple[str, ...]:
        """Names of the settings that some station did not report."""
        return tuple(name for name in _SETTINGS if any((station, name) not in self.values for station in self.stations))

    def describe(self) -> str:
        """Return what differs from a device that was just switched on; empty when nothing does."""
        stations_with: dict[str, list[str]] = {}
        for (station, name), values in self.values.items():
            if not _SETTINGS[name].is_default(values):
                stations_with.setdefault(_SETTINGS[name].describe(values), []).append(station)
        texts = [f"{text} (station {', '.join(stations)})" for text, stations in stations_with.items()]
        texts += ["centimetres"] if self.status.centimetres else []
        if self.system is not None:
            texts += ["microseconds"] if self.system.microseconds else []
            texts += ["boresight as on a Fastrak"] if self.system.boresight_as_fastrak else []
        return "; ".join(texts)


def read_settings(line: DeviceConnection, stations: str, status: StatusRecord) -> SessionSettings:
    """Read all settings that the device reports. The device must not stream."""
    queries = b"".join(station_command("O", station) for station in stations) + commands.SYSTEM
    replies = line.collect(queries, len(stations) + 1)
    lists = {reply.station: reply.items for reply in replies if isinstance(reply, OutputList)}
    system = next((reply for reply in replies if isinstance(reply, SystemRecord)), None)
    return SessionSettings(stations, status, system, lists, _read_stations(line, stations, STATION_SETTINGS))


def set_defaults(port: str, line: DeviceConnection, found: SessionSettings, undo_boresight: bool) -> None:
    """Set everything that is not at its default, and what cannot be read. Raises BadInput when a setting stays."""
    if found.system is not None and found.system.boresight_as_fastrak:
        line.send(commands.BORESIGHT_AS_INTERSENSE)
    for station in found.stations:
        changed = [
            setting
            for setting in STATION_SETTINGS
            if (values := found.values.get((station, setting.name))) is None or not setting.is_default(values)
        ]
        for command in (command for setting in changed for command in setting.setters(station, setting.default)):
            line.send(command)
        if undo_boresight:
            line.send(station_command("b", station))
        readable = [setting for setting in changed if (station, setting.name) in found.values]
        for (_, name), values in _read_stations(line, station, readable).items():
            if not _SETTINGS[name].is_default(values):
                raise BadInput(
                    f"Port {port}: station {station} keeps {_SETTINGS[name].describe(values)}.",
                    "Another program has set it. Switch the device off and on, or use it as it is (--keep-settings).",
                )


def restore_settings(
    line: DeviceConnection, found: SessionSettings, keep: bool, aligned: bool, boresight: bool
) -> bool:
    """Give the device the settings that it had. Returns False when it does not answer.

    With `keep` only what every session changes is put back: format, units and lists. `aligned` and
    `boresight` tell whether the session has set an alignment or boresight of its own.
    """
    for station in found.stations:
        for setting in () if keep else STATION_SETTINGS:
            values = found.values.get((station, setting.name))
            own = aligned and setting.letter == "A"
            if values is not None and (own or not setting.is_default(values)):
                for command in setting.setters(station, values):
                    line.send(command)
        if boresight and not keep:
            line.send(station_command("b", station))
        if station in found.lists:
            line.send(station_command("O", station, found.lists[station]))
        # Wait for the reply, because the device's input buffer is small (error -5, docs/is900.md 6.4).
        if line.ask(station_command("O", station), OutputList, line.timing.answer_s) is None:
            return False
    if found.system is not None:
        line.send(commands.MICROSECONDS if found.system.microseconds else commands.MILLISECONDS)
        if found.system.boresight_as_fastrak and not keep:
            line.send(commands.BORESIGHT_AS_FASTRAK)
    line.send(commands.CENTIMETRES if found.status.centimetres else commands.INCHES)
    line.send(commands.BINARY if found.status.binary else commands.ASCII)
    return True


def _read_stations(line: DeviceConnection, stations: str, settings: Sequence[StationSetting]) -> StationValues:
    """Read these settings of all stations. A setting that one station does not report is not asked of the next."""
    out: StationValues = {}
    for station in stations:
        found = _ask(line, station, settings)
        if missing := [setting for setting in settings if setting.name not in found]:
            found |= _ask(line, station, missing)  # the reply may have been damaged
        settings = [setting for setting in settings if setting.name in found]
        out |= {(station, name): values for name, values in found.items()}
    return out


def _ask(line: DeviceConnection, station: str, settings: Sequence[StationSetting]) -> dict[str, Values]:
    """Query settings of a station, all at once, and return those that it reports."""
    replies = line.collect(b"".join(setting.query_command(station) for setting in settings), len(settings))
    found = {setting.name: [setting.values_of(reply, station) for reply in replies] for setting in settings}
    return {name: next(v for v in values if v is not None) for name, values in found.items() if any(values)}
