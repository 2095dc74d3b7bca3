"""Which stations fall silent, come back, or send records that the session did not ask for; no input or output."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from harness.stream.codec.reader import WireFormat
from harness.stream.driver.config import DriverTiming
from harness.stream.line_events import LineEventKind

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
        self._missing: dict[str, int] = {}
        """Stations that were reported as missing, and how many records they had sent."""
        self._heard_s: dict[str, float] = {}
        self._totals: dict[str, int] = {}
        self._period_s = 0.0
        self._others: dict[str, tuple[int, float]] = {}
        """Other stations: records before the present window of `garbage_s`, and when it began [s]."""
        self._unexpected: set[str] = set()

    def start(self, wire: WireFormat, now_s: float, expected: Collection[str] = ()) -> None:
        """Records of this format are counted from zero. Those of the `expected` other stations are no surprise."""
        characters = wire.characters.decode()
        self._labels = {c: _label(c, name) for c, name in zip(characters, wire.stations, strict=True)}
        self._heard_s, self._totals, self._period_s = dict.fromkeys(characters, now_s), {}, 1.0 / wire.rate_hz
        self._missing, self._others = dict.fromkeys(self._missing, 0), {}
        self._unexpected = set(expected)

    @property
    def silent(self) -> list[str]:
        """Stations that sent nothing for `stalled_s` while others did, and were not reported."""
        return self._behind(self._timing.stalled_s)

    def update(self, totals: Mapping[str, int], now_s: float) -> list[StationEvent]:
        """Return what changed; `totals` are the records of every station since the start, by its character."""
        new = {c: total for c, total in totals.items() if total > self._totals.get(c, 0)}
        self._totals |= new
        if now_s - max(self._heard_s.values()) > self._timing.stalled_s and new.keys() & self._labels.keys():
            self._heard_s = dict.fromkeys(self._heard_s, now_s)  # after a silence of all, each gets its time anew
        self._heard_s |= {c: now_s for c in new if c in self._labels}
        back = [c for c in new if c in self._missing and new[c] - self._missing[c] >= _CERTAIN]
        for c in back:
            del self._missing[c]
        events = [StationEvent("present", f"station {self._labels[c]} sends records again", c) for c in back]
        long_s = max(self._timing.silent_s, _SILENT_PERIODS * self._period_s)
        events += self.report_missing(self._behind(long_s), f"sends no record for {long_s:.1f} s")
        return events + [event for c in new if c not in self._labels for event in self._add_other(c, new[c], now_s)]

    def report_off(self, active: Collection[str], now_s: float) -> list[StationEvent]:
        """Return an event for each station that the device tells as off, and that has sent nothing for `stalled_s`."""
        quiet = (c for c, heard_s in self._heard_s.items() if now_s - heard_s > self._timing.stalled_s)
        return self.report_missing([c for c in quiet if c not in active], "is switched off")

    def report_missing(self, stations: Collection[str], what: str) -> list[StationEvent]:
        """Return an event for each of these stations of the session that was not reported."""
        new = [c for c in stations if c in self._labels and c not in self._missing]
        self._missing |= {c: self._totals.get(c, 0) for c in new}
        text = "its rows are invalid until it comes back"
        return [StationEvent("missing", f"station {self._labels[c]} {what}: {text}", c) for c in new]

    def _behind(self, silent_s: float) -> list[str]:
        """Return the stations whose last record is so much older than the last one of all, and were not reported."""
        last_s = max(self._heard_s.values())
        return [c for c, heard_s in self._heard_s.items() if last_s - heard_s > silent_s and c not in self._missing]

    def _add_other(self, station: str, total: int, now_s: float) -> list[StationEvent]:
        """Count records of a station outside the session; an event when they cannot be damage."""
        before, began_s = self._others.get(station, (total - 1, now_s))
        if now_s - began_s > self._timing.garbage_s:
            before, began_s = total - 1, now_s
        self._others[station] = before, began_s
        if total - before < _CERTAIN or station in self._unexpected:
            return []
        self._unexpected.add(station)
        return [StationEvent("unexpected", f"station {station} was switched on: it is none of this session", station)]


def _label(character: str, name: str) -> str:
    return character if character == name else f"{character} ({name})"
