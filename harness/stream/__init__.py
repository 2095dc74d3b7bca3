"""Frames of a tracker, whatever device delivers them, and the inputs that a method is given."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.frame import TrackerFrame, TrackerStream, split_frames
    from harness.stream.host_clock import HostClockEstimator
    from harness.stream.inputs import INPUT_COMBINATIONS, make_inputs
    from harness.stream.line_events import EventCounter, LineEvent
    from harness.stream.ports import TrackerConfig, open_tracker_at
    from harness.stream.station_counts import FRAME_COLUMNS, StationCounts, StreamSummary, format_csv_row, frame_rows
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "FRAME_COLUMNS",
    "INPUT_COMBINATIONS",
    "EventCounter",
    "HostClockEstimator",
    "LineEvent",
    "StationCounts",
    "StreamSummary",
    "TrackerConfig",
    "TrackerFrame",
    "TrackerStream",
    "format_csv_row",
    "frame_rows",
    "make_inputs",
    "open_tracker_at",
    "split_frames",
]
