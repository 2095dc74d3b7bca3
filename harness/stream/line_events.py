"""Events on the line to a device, and the interface of an observer that sees them. The driver and the recording share
it.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal, Protocol, runtime_checkable

from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec.reader import WireFormat

LineEventKind = Literal[
    "connected",  # streaming, for the first time or again
    "unplugged",  # the port or the connection is gone
    "stalled",  # nothing arrived for a moment, or the device's clock stands still
    "silent",  # nothing arrives and the device does not answer
    "reset",  # the device has lost its configuration
    "wrong list",  # the records are not of the configured output list
    "garbage",  # bytes that belong to no record and no reply
    "missing",  # a station of the session sends nothing any more
    "present",  # a station that was missing sends again
    "unexpected",  # a station that the session did not ask for was switched on
    "out of range",  # a station is farther away than the output list can report
    "device error",  # records carry an error of the device's own tests
    "settings",  # another program left settings in the device, or they are put back
    "refused",  # the device that came back cannot be used as it is
]


@dataclass(frozen=True)
class LineEvent:
    """An event that a person at the device should know. Each trouble is reported once, however long it lasts."""

    kind: LineEventKind
    monotonic_s: float
    """Time on the host's monotonic clock [s], the clock of `TrackerFrame.received_s`."""
    wall_s: float
    """Time on the host's wall clock, since 1970 [s]."""
    text: str


class EventObserver(Protocol):
    """Interface of an observer of events on the line."""

    def on_event(self, event: LineEvent) -> None:
        """Take an event on the line."""
        ...


class LineObserver(EventObserver, Protocol):
    """Interface of an observer of the line: it sees all bytes and events in order. `RecordingWriter` is one."""

    def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        """Take bytes read from the device; b"" where nothing arrived and an overdue frame was closed."""
        ...

    def on_sent(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        """Take bytes written to the device."""
        ...

    def on_configured(self, wire: WireFormat) -> None:
        """Take the format of the bytes that follow. It is called after each configuration, before the command `C`; the
        device's clock starts at zero there.
        """
        ...


@dataclass(frozen=True)
class TrackedBodies:
    """What the poses of a tracker that reports no bytes are of."""

    names: tuple[str, ...]
    """Station names, in the order of the rows of a frame."""
    source: str
    clock: str
    """What `measured_s` counts, in words."""
    start_unix_s: float
    """Unix time of the zero of `measured_s` [s]."""
    assumed: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """What the tracker does not tell: the value that is assumed, and why, by subject."""


@runtime_checkable
class PoseObserver(EventObserver, Protocol):
    """Interface of an observer of a tracker that reports poses. `PoseRecordingWriter` is one."""

    def on_bodies(self, bodies: TrackedBodies) -> None:
        """Take what the frames that follow are of; called once, before the first frame."""
        ...

    def on_frame(self, frame: TrackerFrame) -> None:
        """Take a frame."""
        ...


class NullLineObserver:
    """Observer that ignores everything."""

    def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None: ...
    def on_sent(self, data: bytes, monotonic_s: float, wall_s: float) -> None: ...
    def on_configured(self, wire: WireFormat) -> None: ...
    def on_event(self, event: LineEvent) -> None: ...


_SHOWN_ONCE: tuple[LineEventKind, ...] = ("garbage", "out of range", "wrong list")
"""Kinds that recur while frames go on. The others tell a change of the line's state and are always shown."""


class EventCounter:
    """Keeps all events, and sends the texts that are not repetitions to `show`. Call it with each event."""

    def __init__(self, show: Callable[[str], None]) -> None:
        self._show = show
        self.events: list[LineEvent] = []

    def __call__(self, event: LineEvent) -> None:
        again = event.kind in _SHOWN_ONCE and any(event.kind == earlier.kind for earlier in self.events)
        self.events.append(event)
        if not again:
            self._show(event.text)

    def counts(self) -> dict[str, int]:
        """Number of events by kind, in the order of their first one."""
        return dict(Counter(event.kind for event in self.events))
