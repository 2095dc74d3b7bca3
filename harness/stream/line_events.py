"""What happened on the line, and who else is told."""

from dataclasses import dataclass
from typing import Literal, Protocol

from harness.stream.codec.reader import WireFormat

LineEventKind = Literal[
    "connected",  # streaming, for the first time or again
    "unplugged",  # the port or the connection is gone
    "stalled",  # nothing came for a moment, or the device's clock stands still
    "silent",  # nothing comes and nothing answers
    "reset",  # the device has forgotten what it was told
    "wrong list",  # the records are not those that were asked for
    "garbage",  # bytes that belong to nothing
    "missing",  # a station that was there is not
    "refused",  # what came back cannot be used as it is
]


@dataclass(frozen=True)
class LineEvent:
    """Something a person at the device wants to know; each trouble is told once, however long it lasts."""

    kind: LineEventKind
    monotonic_s: float
    """Host's monotonic clock [s], that of `TrackerFrame.received_s`."""
    wall_s: float
    """Seconds since 1970."""
    text: str


class LineObserver(Protocol):
    """Sees all that goes over the line, in order; a recording is one."""

    def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None:
        """What was read; b"" where nothing was there and a frame was given up waiting for."""
        ...

    def on_sent(self, data: bytes, monotonic_s: float, wall_s: float) -> None: ...
    def on_configured(self, wire: WireFormat) -> None:
        """After each successful set-up, before `C`: what follows is in this format, and the clock starts anew."""
        ...

    def on_event(self, event: LineEvent) -> None: ...


class NullLineObserver:
    """Nobody looks on."""

    def on_received(self, data: bytes, monotonic_s: float, wall_s: float) -> None: ...
    def on_sent(self, data: bytes, monotonic_s: float, wall_s: float) -> None: ...
    def on_configured(self, wire: WireFormat) -> None: ...
    def on_event(self, event: LineEvent) -> None: ...
