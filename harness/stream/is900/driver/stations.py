"""The stations of the device that are read, and which of them fall silent or come back."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from harness.errors import BadInput
from harness.stream.is900.codec.commands import STATION_STATES, TRACKING, station_command
from harness.stream.is900.codec.items import STATION_CHARACTERS
from harness.stream.is900.codec.reader import WireFormat
from harness.stream.is900.codec.replies import StationStates, TrackingStatus
from harness.stream.is900.driver.config import DriverTiming
from harness.stream.is900.driver.connection import DeviceConnection
from harness.stream.line_events import LineEventKind


@dataclass(frozen=True)
class StationSelection:
    """The stations that are read, and the active ones that are not."""

    characters: str
    """Their characters on the wire, ascending."""
    names: tuple[str, ...]
    others: str
    """Active stations without a name. They are switched off while the driver runs, since they would load the line."""
    woken: str = ""
    """Selected stations that were off. They are switched off again at the end."""


def select_stations(
    port: str, line: DeviceConnection, names: tuple[str, ...] | None, characters: str | None = None
) -> StationSelection:
    """Select the stations with these characters, or the first active ones, as many as there are names.

    Raises BadInput when the device lacks one. A device that does not report its stations is assumed to have the named
    ones.
    """
    if names is not None and characters is not None:
        return _select_mapped(port, line, names, characters)
    active = _query_active(port, line, STATION_CHARACTERS.decode()[: len(names or ())])
    if not active:
        raise BadInput(f"Port {port}: no station of the device is active.", "Plug one in, or switch it on: l1,1.")
    names = tuple(active) if names is None else names
    if not 1 <= len(names) <= len(active):
        raise BadInput(
            f"Port {port}: {len(names)} stations requested ({', '.join(names)}), the device has {len(active)} active "
            f"({', '.join(active)}).",
            "Name at most the active ones, plug in the missing ones, or switch the device off and on: another "
            "program may have switched stations off.",
        )
    return StationSelection(active[: len(names)], names, active[len(names) :])


def _select_mapped(port: str, line: DeviceConnection, names: tuple[str, ...], characters: str) -> StationSelection:
    """Select the stations with these characters; one that is off is switched on."""
    before = active = _query_active(port, line, characters)
    for character in characters:
        if character not in before:
            line.send(station_command("l", character, [True]))
    if not set(characters) <= set(before):
        active = _query_active(port, line, characters)
    if missing := [f"{c} ({name})" for c, name in zip(characters, names, strict=True) if c not in active]:
        free = [c for c in active if c not in characters]
        raise BadInput(
            f"Port {port}: the device has no station {', '.join(missing)}; it has {', '.join(active) or 'none'}.",
            f"Plug it in, or name another one{': free are ' + ', '.join(free) if free else ''}.",
        )
    others = "".join(c for c in active if c not in characters)
    return StationSelection(characters, names, others, "".join(c for c in characters if c not in before))


def restore_stations(port: str, line: DeviceConnection, stations: StationSelection) -> str:
    """Switch on the selected stations and switch off the others where needed; return those that stay missing.

    Raises BadInput when a station cannot be switched off.
    """
    active = _query_active(port, line, stations.characters)
    wrong = [name for name in stations.characters if name not in active] + [
        name for name in stations.others if name in active
    ]
    if not wrong:
        return ""
    for name in wrong:
        line.send(station_command("l", name, [name in stations.characters]))
    active = _query_active(port, line, stations.characters)
    if stubborn := [name for name in stations.others if name in active]:
        raise BadInput(f"Port {port}: station {', '.join(stubborn)} cannot be switched off.", "Unplug it, or name it.")
    return "".join(name for name in stations.characters if name not in active)


def _query_active(port: str, line: DeviceConnection, fallback: str) -> str:
    """Return the active stations by `l*`, or by `MP`, because old firmware may know only that.

    `fallback` is returned when the device answers neither. Raises BadInput when it is empty.
    """
    answer_s = line.timing.answer_s
    states = line.ask(STATION_STATES, StationStates, answer_s) or line.ask(STATION_STATES, StationStates, answer_s)
    if states is not None:
        return "".join(states.stations)
    tracking = line.ask(TRACKING, TrackingStatus, answer_s)
    if tracking is not None:
        return "".join(
            name for name, state in zip(STATION_CHARACTERS.decode(), tracking.states, strict=True) if state in "TL"
        )
    if not fallback:
        raise BadInput(
            f"Port {port}: the device answers neither l* nor MP, so its stations are not known.",
            "Name the stations that are plugged in, from the first on, or switch the device off and on.",
        )
    return fallback


_CERTAIN = 3
"""Records that show that a station sends: a single one may be another's, with a damaged character [choice]."""
_SILENT_PERIODS = 4.0
"""A station of a slow device is not silent before this many periods [choice]."""


@dataclass(frozen=True)
class StationEvent:
    """A change of what the stations send."""

    kind: LineEventKind
    text: str
    station: str
    """Character of the station."""


class StationWatch:
    """Compares the records of each station with those of a session. Each change is told once."""

    def __init__(self, timing: DriverTiming) -> None:
        self._timing = timing
        self._labels: dict[str, str] = {}
        """Character of each station of the session, and how a person is told of it."""
        self._missing: set[str] = set()
        """Stations of the session that were reported as missing."""
        self._heard_s: dict[str, float] = {}
        """When each station of the session sent its last record [s]."""
        self._totals: dict[str, int] = {}
        self._window_s = self._silent_s = 0.0
        self._windows: dict[str, tuple[int, float]] = {}
        """Records of a station before the present window, and when the window began [s]."""
        self._expected: set[str] = set()
        self._unexpected: dict[str, float] = {}
        """Other stations that were reported, and when each sent its last record [s]."""

    def start(self, wire: WireFormat, now_s: float, expected: Collection[str] = ()) -> None:
        """Records of this format are counted from zero. Those of the `expected` other stations are no surprise."""
        characters = wire.characters.decode()
        self._labels = {c: _label(c, name) for c, name in zip(characters, wire.stations, strict=True)}
        periods_s = _SILENT_PERIODS / wire.rate_hz
        self._window_s, self._silent_s = max(self._timing.garbage_s, periods_s), max(self._timing.silent_s, periods_s)
        self._heard_s, self._totals = dict.fromkeys(characters, now_s), {}
        self._windows, self._unexpected, self._expected = {}, {}, set(expected)

    @property
    def silent(self) -> list[str]:
        """Stations that sent nothing for `stalled_s` while others did, and were not reported."""
        return self._behind(self._timing.stalled_s)

    def update(self, totals: Mapping[str, int], now_s: float) -> list[StationEvent]:
        """Return what changed; `totals` are the records of every station since the start, by its character."""
        new = {c: total for c, total in totals.items() if total > self._totals.get(c, 0)}
        certain = [c for c in new if c not in self._heard_s or c in self._missing if self._is_certain(c, new[c], now_s)]
        self._totals |= new
        if now_s - max(self._heard_s.values()) > self._timing.stalled_s and new.keys() & self._heard_s.keys():
            self._heard_s = dict.fromkeys(self._heard_s, now_s)  # after a silence of all, each gets its time anew
        self._heard_s |= {c: now_s for c in new if c in self._heard_s}
        last_s = {c: now_s if c in new else at_s for c, at_s in self._unexpected.items()}
        self._unexpected = {c: at_s for c, at_s in last_s.items() if now_s - at_s <= self._window_s}
        events = [
            *self._report_back([c for c in certain if c in self._missing]),
            *self.report_missing(self._behind(self._silent_s), f"sends no record for {self._silent_s:.1f} s"),
        ]
        for c in certain:
            if c not in self._heard_s and c not in self._expected and c not in self._unexpected:
                self._unexpected[c] = now_s
                events.append(StationEvent("unexpected", f"station {c} was switched on: it is none of this session", c))
        return events

    def report_off(self, active: Collection[str], now_s: float) -> list[StationEvent]:
        """Return an event for each station that the device tells as off, and that has sent nothing for `stalled_s`."""
        quiet = (c for c, heard_s in self._heard_s.items() if now_s - heard_s > self._timing.stalled_s)
        return self.report_missing([c for c in quiet if c not in active], "is switched off")

    def report_missing(self, stations: Collection[str], what: str) -> list[StationEvent]:
        """Return an event for each of these stations of the session that was not reported."""
        new = [c for c in stations if c in self._labels and c not in self._missing]
        self._missing |= set(new)
        text = "its rows are invalid until it comes back"
        return [StationEvent("missing", f"station {self._labels[c]} {what}: {text}", c) for c in new]

    def _report_back(self, stations: Collection[str]) -> list[StationEvent]:
        self._missing -= set(stations)
        return [StationEvent("present", f"station {self._labels[c]} sends records again", c) for c in stations]

    def _behind(self, silent_s: float) -> list[str]:
        """Return the stations whose last record is so much older than the last one of all, and were not reported."""
        last_s = max(self._heard_s.values())
        return [c for c, heard_s in self._heard_s.items() if last_s - heard_s > silent_s and c not in self._missing]

    def _is_certain(self, station: str, total: int, now_s: float) -> bool:
        """Whether a station has sent so many records within a window that they cannot be damage."""
        before, began_s = self._windows.get(station, (0, -math.inf))
        if now_s - began_s > self._window_s:
            self._windows[station] = before, began_s = self._totals.get(station, 0), now_s
        return total - before >= _CERTAIN


def _label(character: str, name: str) -> str:
    return character if character == name else f"{character} ({name})"
