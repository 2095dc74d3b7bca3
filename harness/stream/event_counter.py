"""Messages about events on the line, without repetition: an event of a kind that recurs is shown once, then counted."""

from collections import Counter
from collections.abc import Callable

from harness.stream.line_events import LineEvent, LineEventKind

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
