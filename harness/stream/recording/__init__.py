"""Recordings of a line: written while a device streams, read and played again."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.recording.blocks import (
        CONFIGURED,
        FILE_HEADER,
        NOTE,
        RECEIVED,
        RecordingBlock,
        encode_block,
        read_blocks,
    )
    from harness.stream.recording.command_recording import check_commands, format_exchanges, record_commands
    from harness.stream.recording.guided_capture import Stretch, capture_stretches, finished_stretches
    from harness.stream.recording.line_server import serve_line
    from harness.stream.recording.pose_recording import (
        PoseRecording,
        is_pose_file,
        open_poses,
        write_pose_recording,
    )
    from harness.stream.recording.pose_replay import PoseLogStream
    from harness.stream.recording.pose_writer import open_writer
    from harness.stream.recording.recorder import RecordingSwitch, record_port
    from harness.stream.recording.recording import (
        EXPECTED_FILE,
        PLAN_FILE,
        Recording,
        RecordingWriter,
        read_recording,
        record_capture,
    )
    from harness.stream.recording.replay import RecordingStream, ReplaySpeed, parse_speed
    from harness.stream.recording.station_readings import CaptureBlock, CaptureReader, StationReadings
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "CONFIGURED",
    "EXPECTED_FILE",
    "FILE_HEADER",
    "NOTE",
    "PLAN_FILE",
    "RECEIVED",
    "CaptureBlock",
    "CaptureReader",
    "PoseLogStream",
    "PoseRecording",
    "Recording",
    "RecordingBlock",
    "RecordingStream",
    "RecordingSwitch",
    "RecordingWriter",
    "ReplaySpeed",
    "StationReadings",
    "Stretch",
    "capture_stretches",
    "check_commands",
    "encode_block",
    "finished_stretches",
    "format_exchanges",
    "is_pose_file",
    "open_poses",
    "open_writer",
    "parse_speed",
    "read_blocks",
    "read_recording",
    "record_capture",
    "record_commands",
    "record_port",
    "serve_line",
    "write_pose_recording",
]
