"""A tracker that reports poses, recorded: every pose and mark, continued files, and what is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile, BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.line_events import LineEvent, TrackedBodies
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.poses.pose_log import FileFinding
from harness.stream.recording.guided_capture import finished_stretches
from harness.stream.recording.pose_recording import read_pose_recording
from harness.stream.recording.pose_writer import PoseRecordingWriter, open_writer
from harness.stream.recording.recorder import RecordingSwitch
from harness.stream.recording.recording import read_marks
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.vrpn.client import VrpnConfig

START_S = 1_700_000_000.25
BODIES = TrackedBodies(("head", "torso"), "vrpn:T@lab", "seconds", START_S, {"length unit": ("m", "a convention")})


def frame_at(*times_s: float, x_m: float = 0.5) -> TrackerFrame:
    """A frame with a pose at each of these times; NaN for none."""
    measured_s = np.array(times_s)
    valid = np.isfinite(measured_s)
    place = np.where(valid[:, None], [x_m, -1.0, 2.0], np.nan)
    turn = np.where(valid[:, None], [0.5, 0.5, -0.5, 0.5], np.nan)
    none = np.zeros(len(measured_s), dtype=bool)
    return TrackerFrame(9.0, measured_s, place, turn, valid, valid, valid.astype(float), none)


def times_of(path: Path) -> list[list[float]]:
    return [body.times_s.tolist() for body in read_pose_recording(path).log.bodies]


def test_poses_are_kept_as_they_came(tmp_path: Path) -> None:
    path, nan = tmp_path / "a.rec", float("nan")
    with PoseRecordingWriter(path, {"source": "test"}) as writer:
        writer.on_bodies(BODIES)
        writer.on_frame(frame_at(0.0, 0.002))
        writer.on_frame(frame_at(nan, 0.012, x_m=0.1 + 0.2))
        writer.on_event(LineEvent("unplugged", 1.0, 2.0, "gone"))
        writer.on_frame(frame_at(0.03, 0.021))
        assert writer.counts == writer.counts | {"pose": 5, "evnt": 1, "left_out": 0}
    found = read_pose_recording(path)
    assert (found.log.names, found.log.source, found.log.start_unix_s) == (("head", "torso"), "vrpn:T@lab", START_S)
    assert found.log.findings == (FileFinding("length unit", "m", "a convention", assumed=True),)
    assert found.note == {"source": "test"}
    assert times_of(path) == [[0.0, 0.03], [0.002, 0.012, 0.021]]
    torso = found.log.bodies[1]
    assert torso.positions_m[1].tolist() == [0.1 + 0.2, -1.0, 2.0]
    assert torso.quaternions[1].tolist() == [0.5, 0.5, -0.5, 0.5]


def test_half_a_pose_and_a_pose_that_is_not_later_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    with PoseRecordingWriter(path) as writer:
        writer.on_bodies(BODIES)
        writer.on_frame(frame_at(0.0, 0.0))
        lost = frame_at(0.01, 0.01)
        no_turn = np.where([[True], [False]], lost.tracker_from_station, np.nan)
        writer.on_frame(replace(lost, orientation_valid=np.array([True, False]), tracker_from_station=no_turn))
        writer.on_frame(frame_at(0.01, 0.02))
        assert writer.counts["left_out"] == 1
    assert times_of(path) == [[0.0, 0.01], [0.0, 0.02]]


def test_a_recording_goes_on_by_the_trackers_clock(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    with PoseRecordingWriter(path) as writer:
        writer.on_bodies(BODIES)
        writer.on_frame(frame_at(0.0, 0.0))
        writer.on_mark({"stretch": "static"})
        writer.on_frame(frame_at(0.5, 0.5))
        writer.on_mark({"stretch": "", "finished": "static"})
    with PoseRecordingWriter(path) as writer:
        writer.on_bodies(replace(BODIES, start_unix_s=START_S + 10.0))
        writer.on_mark({"stretch": "slow"})
        writer.on_frame(frame_at(-9.75, 0.25))
        assert writer.counts["left_out"] == 1
    assert times_of(path) == [[0.0, 0.5], [0.0, 0.5, 10.25]]
    (first_s, _), (end_s, _), (slow_s, _) = read_pose_recording(path).marks
    assert 0.0 < first_s < 1e-300
    assert 0.5 < end_s == slow_s < 0.5 + 1e-15
    assert [mark["stretch"] for mark in read_marks(path)] == ["static", "", "slow"]
    assert finished_stretches(path) == {"static"}


def test_an_empty_recording_leaves_no_file(tmp_path: Path) -> None:
    with PoseRecordingWriter(tmp_path / "a.rec") as writer:
        writer.on_bodies(BODIES)
        assert writer.empty
    assert not (tmp_path / "a.rec").exists()


def test_other_bodies_plans_and_kinds_of_recording_are_refused(tmp_path: Path) -> None:
    path, line = tmp_path / "a.rec", tmp_path / "b.rec"
    with PoseRecordingWriter(path, {"plan": "1234"}) as writer:
        writer.on_bodies(BODIES)
        writer.on_frame(frame_at(0.0, 0.0))
    with RecordingWriter(line) as bytes_writer:
        bytes_writer.on_configured(WireFormat(("a",), 40.0))
    kept = path.read_bytes(), line.read_bytes()
    writer = PoseRecordingWriter(path, {"plan": "1234"})
    with pytest.raises(BadFile, match="a recording of the stations head, torso; expected one of head"):
        writer.on_bodies(replace(BODIES, names=("head",)))
    writer.close()
    with pytest.raises(BadFile, match="a recording for the plan 1234; expected one for no plan"):
        PoseRecordingWriter(path)
    with pytest.raises(BadFile, match="no recording of poses"):
        PoseRecordingWriter(line)
    with pytest.raises(BadFile, match="a recording of poses"):
        RecordingWriter(path)
    assert (path.read_bytes(), line.read_bytes()) == kept


def test_a_tracker_decides_the_kind_of_its_recording(tmp_path: Path) -> None:
    assert isinstance(open_writer(tmp_path / "a.rec", {}, VrpnConfig()), PoseRecordingWriter)
    assert type(open_writer(tmp_path / "b.rec", {}, DriverConfig())) is RecordingWriter


def test_a_part_of_a_session_is_recorded(tmp_path: Path) -> None:
    path, switch = tmp_path / "a.rec", RecordingSwitch({"origin": "test"})
    switch.on_bodies(BODIES)
    switch.on_frame(frame_at(0.0, 0.0))
    switch.start(path)
    switch.on_frame(frame_at(0.25, 0.25))
    switch.on_frame(frame_at(0.5, 0.5))
    assert switch.stop() == path
    switch.on_frame(frame_at(0.75, 0.75))
    assert times_of(path) == [[0.0, 0.25]] * 2
    assert read_pose_recording(path).log.start_unix_s == START_S + 0.25


def test_a_switch_needs_a_device() -> None:
    with pytest.raises(BadInput, match="No device is set up"):
        RecordingSwitch().start(Path("a.rec"))
