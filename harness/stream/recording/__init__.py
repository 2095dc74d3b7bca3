"""Recordings of a line: written while a device streams, read and played again."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.recording.block_content import EXPECTED_FILE as EXPECTED_FILE
    from harness.stream.recording.block_content import PLAN_FILE as PLAN_FILE
    from harness.stream.recording.blocks import CONFIGURED as CONFIGURED
    from harness.stream.recording.blocks import FILE_HEADER as FILE_HEADER
    from harness.stream.recording.blocks import NOTE as NOTE
    from harness.stream.recording.blocks import RECEIVED as RECEIVED
    from harness.stream.recording.blocks import RecordingBlock as RecordingBlock
    from harness.stream.recording.blocks import encode_block as encode_block
    from harness.stream.recording.blocks import read_blocks as read_blocks
    from harness.stream.recording.command_recording import check_commands as check_commands
    from harness.stream.recording.command_recording import format_exchanges as format_exchanges
    from harness.stream.recording.command_recording import record_commands as record_commands
    from harness.stream.recording.guided_capture import Stretch as Stretch
    from harness.stream.recording.guided_capture import capture_stretches as capture_stretches
    from harness.stream.recording.guided_capture import finished_stretches as finished_stretches
    from harness.stream.recording.line_server import serve_line as serve_line
    from harness.stream.recording.pose_recording import PoseRecording as PoseRecording
    from harness.stream.recording.pose_recording import is_pose_file as is_pose_file
    from harness.stream.recording.pose_recording import open_poses as open_poses
    from harness.stream.recording.pose_recording import write_pose_recording as write_pose_recording
    from harness.stream.recording.pose_replay import PoseLogStream as PoseLogStream
    from harness.stream.recording.pose_writer import open_writer as open_writer
    from harness.stream.recording.recorder import RecordingSwitch as RecordingSwitch
    from harness.stream.recording.recorder import record_port as record_port
    from harness.stream.recording.recording import Recording as Recording
    from harness.stream.recording.recording import read_recording as read_recording
    from harness.stream.recording.recording_writer import RecordingWriter as RecordingWriter
    from harness.stream.recording.recording_writer import record_capture as record_capture
    from harness.stream.recording.replay import RecordingStream as RecordingStream
    from harness.stream.recording.replay import ReplaySpeed as ReplaySpeed
    from harness.stream.recording.replay import parse_speed as parse_speed
    from harness.stream.recording.station_readings import CaptureBlock as CaptureBlock
    from harness.stream.recording.station_readings import CaptureReader as CaptureReader
    from harness.stream.recording.station_readings import StationReadings as StationReadings
else:
    __getattr__, __dir__ = lazy_names(__name__)
