"""Which stations fall silent, come back, or send without being asked for."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from harness.stream.line_events import LineEventKind
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.driver.config import DriverTiming

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
