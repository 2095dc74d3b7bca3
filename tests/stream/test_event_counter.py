"""Events on the line are shown without repetition."""

from harness.stream.line_events import EventCounter, LineEvent, LineEventKind


def test_garbage_is_shown_once_and_counted_and_changes_are_always_shown() -> None:
    shown: list[str] = []
    events = EventCounter(shown.append)
    kinds: list[LineEventKind] = ["garbage", "unplugged", "connected", "garbage", "unplugged", "garbage"]
    for k, kind in enumerate(kinds):
        events(LineEvent(kind, float(k), float(k), f"{kind} {k}"))
    assert shown == ["garbage 0", "unplugged 1", "connected 2", "unplugged 4"]
    assert events.counts() == {"garbage": 3, "unplugged": 2, "connected": 1}
    assert len(events.events) == 6
