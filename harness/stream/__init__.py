"""Frames of a tracker, whatever device delivers them, and the inputs that a method is given."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.emulators import open_emulator as open_emulator
    from harness.stream.emulators import serve_emulator as serve_emulator
    from harness.stream.frame import TrackerFrame as TrackerFrame
    from harness.stream.frame import TrackerStream as TrackerStream
    from harness.stream.frame import split_frames as split_frames
    from harness.stream.host_clock import HostClockEstimator as HostClockEstimator
    from harness.stream.host_clock import UnixTimeEstimator as UnixTimeEstimator
    from harness.stream.inputs import INPUT_COMBINATIONS as INPUT_COMBINATIONS
    from harness.stream.inputs import make_inputs as make_inputs
    from harness.stream.line_events import EventCounter as EventCounter
    from harness.stream.line_events import LineEvent as LineEvent
    from harness.stream.ports import TrackerConfig as TrackerConfig
    from harness.stream.ports import open_tracker_at as open_tracker_at
    from harness.stream.poses.options import PoseFileOptions as PoseFileOptions
    from harness.stream.poses.pose_conversion import UNTIMED as UNTIMED
    from harness.stream.poses.pose_log import BodyPoses as BodyPoses
    from harness.stream.poses.pose_log import FileFinding as FileFinding
    from harness.stream.poses.pose_log import PoseLog as PoseLog
    from harness.stream.poses.pose_statistics import FEWEST_POSES as FEWEST_POSES
    from harness.stream.poses.pose_statistics import measure_sampling as measure_sampling
    from harness.stream.station_counts import FRAME_COLUMNS as FRAME_COLUMNS
    from harness.stream.station_counts import StationCounts as StationCounts
    from harness.stream.station_counts import StreamSummary as StreamSummary
    from harness.stream.station_counts import format_csv_row as format_csv_row
    from harness.stream.station_counts import frame_rows as frame_rows
    from harness.stream.tracker import OpenTracker as OpenTracker
else:
    __getattr__, __dir__ = lazy_names(__name__)
