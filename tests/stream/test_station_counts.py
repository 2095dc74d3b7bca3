"""Counts of what the stations of a stream reported."""

import numpy as np

from harness.stream.frame import TrackerFrame
from harness.stream.line_events import EventCounter, LineEvent, LineEventKind
from harness.stream.station_counts import StationCounts


def test_a_reading_is_a_position_or_an_orientation_and_only_its_quality_counts() -> None:
    counts = StationCounts(3)
    assert counts.loss.tolist() == [1.0, 1.0, 1.0]
    assert counts.mean_quality.tolist() == [0.0, 0.0, 0.0]
    position, orientation = np.array([True, False, False]), np.array([True, True, False])
    for measured_s in ([0.0, 0.0, 0.0], [1.0, 1.0, np.nan]):  # the third station sends a record that holds nothing
        frame = TrackerFrame(
            received_s=measured_s[0],
            measured_s=np.array(measured_s),
            position_m=np.where(position[:, None], np.zeros((3, 3)), np.nan),
            tracker_from_station=np.where(orientation[:, None], [1.0, 0.0, 0.0, 0.0], np.nan),
            position_valid=position,
            orientation_valid=orientation,
            quality=np.array([0.5, 1.0, 0.7]),
            suspect=np.array([False, False, True]),
        )
        counts.add(frame)
    assert counts.frames == 2
    assert counts.records.tolist() == [2, 2, 1]
    assert counts.positions.tolist() == [2, 0, 0]
    assert counts.orientations.tolist() == [2, 2, 0]
    assert counts.readings.tolist() == [2, 2, 0]
    assert counts.suspect.tolist() == [0, 0, 2]
    assert counts.loss.tolist() == [0.0, 0.0, 1.0]
    assert counts.mean_quality.tolist() == [0.5, 1.0, 0.0]


def test_garbage_is_shown_once_and_counted_and_changes_are_always_shown() -> None:
    shown: list[str] = []
    events = EventCounter(shown.append)
    kinds: list[LineEventKind] = ["garbage", "unplugged", "connected", "garbage", "unplugged", "garbage"]
    for k, kind in enumerate(kinds):
        events(LineEvent(kind, float(k), float(k), f"{kind} {k}"))
    assert shown == ["garbage 0", "unplugged 1", "connected 2", "unplugged 4"]
    assert events.counts() == {"garbage": 3, "unplugged": 2, "connected": 1}
    assert len(events.events) == 6
