"""A recording that is started and stopped while a device runs: each part can be replayed alone."""

from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile, BadInput
from harness.experiment import Playback, prepare_playback
from harness.stream.frame import TrackerFrame
from harness.stream.line_events import LineEvent
from harness.stream.recording import recorder
from harness.stream.recording.recorder import RecordingSwitch
from harness.stream.recording.recording import read_recording
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.recording.replay import RecordingStream
from harness.stream.vrpn import VrpnConfig


@pytest.fixture(scope="module")
def played() -> Playback:
    return prepare_playback("demo", clip="boxing_p1_01", stations=4)


def feed(switch: RecordingSwitch, played: Playback, first: int, stop: int) -> None:
    """Hand a part of the simulated bytes to the switch."""
    capture = played.simulation.wire
    ends = [0, *capture.ends.tolist()]
    for chunk in range(first, stop):
        at_s = float(capture.received_s[chunk])
        switch.on_received(capture.data[ends[chunk] : ends[chunk + 1]], at_s, 1e9 + at_s)


def test_a_part_of_a_session_is_recorded(played: Playback, tmp_path: Path) -> None:
    switch = RecordingSwitch({"origin": "test"})
    switch.on_configured(played.simulation.wire_format)
    feed(switch, played, 0, 100)
    assert switch.path is None
    switch.start(tmp_path / "a.rec")
    assert switch.path == tmp_path / "a.rec"
    feed(switch, played, 100, 300)
    switch.on_event(LineEvent("garbage", 1.0, 2.0, "noise"))
    assert switch.stop() == tmp_path / "a.rec"
    feed(switch, played, 300, 400)
    stream = RecordingStream(tmp_path / "a.rec")
    frames, wire = list(stream), read_recording(tmp_path / "a.rec").formats[0]
    assert wire.zeroed is False
    assert stream.recording.note == {"origin": "test"}
    assert [event["text"] for event in stream.recording.events] == ["noise"]
    whole = played.simulation.frames
    firsts = [int(np.argmin([abs(f.received_s - frame.received_s) for f in whole])) for frame in frames]
    assert firsts == list(range(firsts[0], firsts[0] + len(frames)))
    assert firsts[0] > 0
    assert firsts[-1] < len(whole) - 1


class _Device:
    """A tracker whose first frames were received before it was open, as of a VRPN server."""

    identification, station_list, setup_note, counts = "a tracker", "1 head", "", {"records": 100}

    def __init__(self, frames: Sequence[TrackerFrame]) -> None:
        self.left = iter(frames)

    def __iter__(self) -> Iterator[TrackerFrame]:
        yield from self.left

    def close(self) -> None: ...

    def health(self) -> dict[str, float]:
        return {"frames": 1.0, "out_of_range": 0.0}


def test_seconds_count_from_the_first_frame(played: Playback, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    frames = played.simulation.frames[:200]
    for seconds in (0.5, 1.0):
        device = _Device(frames)
        monkeypatch.setattr(recorder, "open_tracker_at", lambda *args, device=device, **kwargs: nullcontext(device))
        with RecordingWriter(tmp_path / f"{seconds}.rec") as writer:
            recorder.record_port("vrpn:a@b", VrpnConfig(), writer, seconds=seconds)
        taken = [frame for frame in frames if frame.received_s < frames[0].received_s + seconds]
        assert len(frames) - len(list(device.left)) == len(taken) + 1


def test_starting_and_stopping_out_of_turn_is_refused(played: Playback, tmp_path: Path) -> None:
    switch = RecordingSwitch()
    with pytest.raises(BadInput, match="No device is set up"):
        switch.start(tmp_path / "a.rec")
    switch.on_configured(played.simulation.wire_format)
    with pytest.raises(BadInput, match="No recording runs"):
        switch.stop()
    with pytest.raises(BadFile, match="no such folder"):
        switch.start(tmp_path / "none" / "a.rec")
    assert switch.path is None
    switch.start(tmp_path / "a.rec")
    with pytest.raises(BadInput, match=r"A recording into .*a\.rec runs"):
        switch.start(tmp_path / "b.rec")
    switch.close()
    switch.close()
    assert read_recording(tmp_path / "a.rec").formats


def test_an_error_of_the_file_ends_the_recording_alone(played: Playback, tmp_path: Path) -> None:
    """A device that comes back with other stations cannot be recorded into the same file."""
    wire = played.simulation.wire_format
    switch = RecordingSwitch()
    switch.on_configured(wire)
    switch.start(tmp_path / "a.rec")
    other = type(wire)(wire.stations[:2], wire.rate_hz)
    switch.on_configured(other)
    assert switch.path is None
    assert "Record other stations into another file" in switch.failure
    switch.start(tmp_path / "b.rec")
    assert switch.failure == ""
    switch.close()
    assert read_recording(tmp_path / "b.rec").formats[0].stations == wire.stations[:2]
