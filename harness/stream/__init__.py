"""Frames of a tracker, whatever device delivers them, and the inputs that a method is given."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.emulators import open_emulator, serve_emulator
    from harness.stream.frame import TrackerFrame, TrackerStream, split_frames
    from harness.stream.host_clock import HostClockEstimator, UnixTimeEstimator
    from harness.stream.inputs import INPUT_COMBINATIONS, make_inputs
    from harness.stream.line_events import EventCounter, LineEvent
    from harness.stream.ports import TrackerConfig, open_tracker_at
    from harness.stream.poses.options import PoseFileOptions
    from harness.stream.poses.pose_conversion import UNTIMED
    from harness.stream.poses.pose_log import BodyPoses, FileFinding, PoseLog
    from harness.stream.poses.pose_statistics import FEWEST_POSES, measure_sampling
    from harness.stream.station_counts import FRAME_COLUMNS, StationCounts, StreamSummary, format_csv_row, frame_rows
    from harness.stream.tracker import OpenTracker
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "FEWEST_POSES",
    "FRAME_COLUMNS",
    "INPUT_COMBINATIONS",
    "UNTIMED",
    "BodyPoses",
    "EventCounter",
    "FileFinding",
    "HostClockEstimator",
    "LineEvent",
    "OpenTracker",
    "PoseFileOptions",
    "PoseLog",
    "StationCounts",
    "StreamSummary",
    "TrackerConfig",
    "TrackerFrame",
    "TrackerStream",
    "UnixTimeEstimator",
    "format_csv_row",
    "frame_rows",
    "make_inputs",
    "measure_sampling",
    "open_emulator",
    "open_tracker_at",
    "serve_emulator",
    "split_frames",
]
