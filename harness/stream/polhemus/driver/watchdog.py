"""Watchdog of the line: given what arrives and when, it detects trouble and chooses a recovery action; no I/O.

Each trouble is reported once, until records arrive again. The device answers status queries between records, so that a
query costs nothing where all is well.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.stream.frame import TrackerFrame
from harness.stream.line_events import LineEventKind
from harness.stream.polhemus.codec.items import (
    POSE_ERRORS,
    STANDARD_LIST,
    STATION_CHARACTERS,
    DeviceFamily,
    position_range_m,
)
from harness.stream.polhemus.codec.reader import FrameReader, WireFormat
from harness.stream.polhemus.codec.replies import (
    OutputList,
    ParsedReply,
    StationStates,
    StatusRecord,
    TrackingStatus,
    parse_reply,
)
from harness.stream.polhemus.driver.config import DriverTiming
from harness.stream.polhemus.driver.station_watch import StationEvent, StationWatch

RecoveryAction = Literal["none", "ask", "configure", "reopen"]
"""What to do: query the state of the device ("ask"), configure it again ("configure"), or reopen the line and then
configure it ("reopen")."""


@dataclass(frozen=True)
class Diagnosis:
    """A recovery action, an event to report, or both."""

    action: RecoveryAction
    kind: LineEventKind | None = None
    text: str = ""
    unexpected: str = ""
    """Character of a station that was switched on without being asked for."""


class Watchdog:
    """Monitors the stream while data flow. Call `pause` before a configuration and `start` after it."""

    def __init__(self, timing: DriverTiming) -> None:
        self._timing = timing
        self._reported: dict[LineEventKind, float] = {}
        """Troubles since the last record, and when each was reported [s]."""
        self._wire: WireFormat | None = None
        """Wire format while data flow; None otherwise."""
        self._began_s = self._last_record_s = self._last_byte_s = self._asked_s = 0.0
        self._last_garbage_s = self._garbage_began_s = 0.0
        self._last_frame_s: float | None = None
        """Time of the last sound frame [s]; None before the first."""
        self._device_s = -np.inf
        self._garbage_bytes, self._resets, self._expected_resets = 0, 0, 0
        self._complaints: dict[str, float] = {}
        """Differences found in replies, and when [s]."""
        self._connected = False
        self._stations = StationWatch(timing)
        self._beyond: set[str] = set()
        """Stations that were reported as out of range."""
        self._device_errors: set[tuple[str, str]] = set()
        """Stations and errors of the device that were reported."""

    def pause(self) -> None:
        """Data stop flowing."""
        self._wire = None

    def start(self, wire: WireFormat, now_s: float) -> None:
        """Data are about to flow in this format."""
        self._wire = wire
        self._began_s = self._last_record_s = self._last_byte_s = self._asked_s = now_s
        self._stations.start(wire, now_s)
        self._garbage_bytes, self._resets, self._expected_resets, self._complaints, self._connected = 0, 0, 0, {}, False

    def expect_clock_reset(self) -> None:
        """The driver has set the device's clock to zero: its next reset is no fault."""
        self._expected_resets += 1

    def report(self, kind: LineEventKind, text: str, now_s: float, action: RecoveryAction = "none") -> Diagnosis:
        """Return a diagnosis of this kind; it has no event when one of this kind was reported already."""
        if kind in self._reported:
            return Diagnosis(action)
        self._reported[kind] = now_s
        return Diagnosis(action, kind, text)

    def add_frames(self, frames: Sequence[TrackerFrame], now_s: float) -> list[Diagnosis]:
        """Take frames that arrived. They count as sound only when the device's clock advances."""
        if self._wire is None or not frames:
            return []
        device_s = max(float(np.fmax.reduce(frame.measured_s, initial=-np.inf)) for frame in frames)
        if 21 in self._wire.items and device_s <= self._device_s:
            return []
        changed = not self._connected or set(self._reported) - {"garbage"}
        gap = "" if self._last_frame_s is None else f" again after {now_s - self._last_frame_s:.1f} s"
        self._device_s, self._connected = device_s, True
        self._last_record_s = self._last_frame_s = now_s
        self._reported = {kind: reported_s for kind, reported_s in self._reported.items() if kind == "garbage"}
        if not changed:
            return []
        stations = f"{len(self._wire.stations)} stations at {self._wire.rate_hz:g} Hz"
        return [Diagnosis("none", "connected", f"records arrive{gap}: {stations}")]

    def check(self, now_s: float, bytes_arrived: bool, reader: FrameReader) -> list[Diagnosis]:
        """Return what is wrong now. `bytes_arrived` tells whether bytes arrived since the last check."""
        if self._wire is None:
            return []
        if bytes_arrived:
            self._last_byte_s = now_s
        diagnoses = self._check_garbage(now_s, reader) + self._check_range(reader) + self._check_errors(reader)
        diagnoses += self._check_silence(now_s) + self._check_stations(now_s, reader)
        while reader.replies:
            diagnoses += self._check_reply(self._wire, parse_reply(reader.replies.popleft().line), now_s)
        if reader.clock_resets > self._resets + self._expected_resets:
            diagnoses.append(self._ask(now_s))
        if reader.clock_resets > self._resets:
            self._expected_resets = max(self._expected_resets - 1, 0)
        self._resets = reader.clock_resets
        return diagnoses

    def _check_garbage(self, now_s: float, reader: FrameReader) -> list[Diagnosis]:
        garbage_bytes = reader.garbage_bytes - reader.other_bytes
        new_bytes, self._garbage_bytes = garbage_bytes - self._garbage_bytes, garbage_bytes
        if not new_bytes:
            if now_s - self._last_garbage_s > self._timing.garbage_s:
                self._reported.pop("garbage", None)
            return []
        if now_s - self._last_garbage_s > self._timing.garbage_s:
            self._garbage_began_s = now_s
        self._last_garbage_s = now_s
        diagnoses = [self.report("garbage", f"{new_bytes} bytes belong to no record and no reply", now_s)]
        if min(now_s - self._garbage_began_s, now_s - self._asked_s) > self._timing.stalled_s:
            diagnoses.append(self._ask(now_s))  # garbage continues: check the output list
        return diagnoses

    def _check_stations(self, now_s: float, reader: FrameReader) -> list[Diagnosis]:
        """Report stations that come and go; ask the device about one that is silent."""
        diagnoses = _station_diagnoses(self._stations.update(reader.station_records, now_s))
        if self._stations.silent and now_s - self._asked_s > self._timing.stalled_s:
            diagnoses.append(self._ask(now_s))
        return diagnoses

    def report_missing(self, stations: str) -> list[Diagnosis]:
        """Report stations that the device does not have any more."""
        return _station_diagnoses(self._stations.report_missing(stations, "is not there"))

    def _check_range(self, reader: FrameReader) -> list[Diagnosis]:
        """Report each station once, however often its position is beyond the range of the list."""
        names = reader.wire.stations
        beyond = [names[row] for row in np.flatnonzero(reader.out_of_range) if names[row] not in self._beyond]
        if not beyond:
            return []
        self._beyond.update(beyond)
        range_m, items = position_range_m(reader.wire.items), ",".join(map(str, STANDARD_LIST))
        where = f"station {', '.join(beyond)} is farther than {range_m:g} m from the tracker's origin on an axis"
        text = f"{where}: such positions are not valid. Use a list with item 2, as {items}"
        return [Diagnosis("none", "out of range", text)]

    def _check_errors(self, reader: FrameReader) -> list[Diagnosis]:
        """Report each error of the device and station once."""
        new = sorted(reader.device_errors - self._device_errors)
        self._device_errors |= reader.device_errors
        names = dict(zip(reader.wire.characters.decode(), reader.wire.stations, strict=True))
        what = {True: "its poses are suspect", False: "its poses may be sound"}
        return [
            Diagnosis(
                "none",
                "device error",
                f"station {names[station]} reports error {letter} of the device's own tests: "
                f"{what[ord(letter) in POSE_ERRORS[reader.wire.family]]}",
            )
            for station, letter in new
        ]

    def _check_silence(self, now_s: float) -> list[Diagnosis]:
        elapsed_s, timing = now_s - self._last_record_s, self._timing
        if elapsed_s > timing.silent_s:
            if now_s - self._last_byte_s < timing.stalled_s:
                return [Diagnosis("configure")]
            return [self.report("silent", f"no byte for {now_s - self._last_byte_s:.1f} s", now_s, "reopen")]
        if elapsed_s > timing.stalled_s and now_s - self._asked_s > timing.stalled_s:
            silent = now_s - self._last_byte_s > timing.stalled_s
            what = "no byte" if silent else "no new record"
            return [self.report("stalled", f"{what} for {elapsed_s:.1f} s", now_s), self._ask(now_s)]
        return []

    def _ask(self, now_s: float) -> Diagnosis:
        self._asked_s = now_s
        return Diagnosis("ask")

    def _check_reply(self, wire: WireFormat, reply: ParsedReply, now_s: float) -> list[Diagnosis]:
        """Compare a reply with the configuration.

        A difference counts when it soon occurs twice, since one may be damage.
        """
        if (active := _active_stations(reply, wire.family)) is not None:
            return _station_diagnoses(self._stations.report_off(active, now_s))
        recent_s = now_s - self._timing.silent_s
        self._complaints = {text: since_s for text, since_s in self._complaints.items() if since_s > recent_s}
        kind, complaint = diagnose_reply(wire, reply)
        if kind is None:
            return []
        if complaint in self._complaints:
            return [self.report(kind, complaint, now_s, "configure")]
        first = not self._complaints
        self._complaints[complaint] = now_s
        return [self._ask(now_s)] if first else []


def _station_diagnoses(events: list[StationEvent]) -> list[Diagnosis]:
    return [
        Diagnosis("none", event.kind, event.text, event.station if event.kind == "unexpected" else "")
        for event in events
    ]


def _active_stations(reply: ParsedReply, family: DeviceFamily) -> tuple[str, ...] | None:
    """Return the stations that a reply to `l*`, `MP` or a FASTRAK's `l1` tells as active; None for another reply."""
    if isinstance(reply, TrackingStatus):
        return tuple(c for c, state in zip(STATION_CHARACTERS.decode(), reply.states, strict=True) if state != "X")
    complete = isinstance(reply, StationStates) and reply.station == ("1" if family == "fastrak" else None)
    return reply.stations if isinstance(reply, StationStates) and complete else None


def diagnose_reply(wire: WireFormat, reply: ParsedReply, streaming: bool = True) -> tuple[LineEventKind | None, str]:
    """Return how a reply differs from the configuration, as an event kind and a text; (None, "") when it agrees."""
    if isinstance(reply, StatusRecord):
        differences = [
            f"it reports in {'binary' if reply.binary else 'ASCII'}" if reply.binary != wire.settings.binary else "",
            "its unit differs" if reply.centimetres != (wire.settings.metres_per_unit == 0.01) else "",
            "it does not stream" if streaming and not reply.continuous else "",
        ]
        if any(differences):
            return "reset", "the device was reset: " + ", ".join(filter(None, differences))
    if isinstance(reply, OutputList) and reply.station in wire.characters.decode() and reply.items != wire.items:
        return "wrong list", f"the list of station {reply.station} is {','.join(map(str, reply.items))}"
    return None, ""
