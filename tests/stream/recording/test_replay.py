"""Replay: the frames of a recording, whatever the speed and the split of the bytes."""

import io
import json
import threading
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from harness.errors import BadFile, BadInput
from harness.stream.frame import TrackerFrame
from harness.stream.polhemus.codec.reader import ByteCapture, WireFormat
from harness.stream.polhemus.codec.records import RecordFormat, RecordValues, encode_records
from harness.stream.recording.blocks import (
    ANSWERED,
    CONFIGURED,
    FILE_HEADER,
    RECEIVED,
    SENT,
    RecordingBlock,
    encode_block,
)
from harness.stream.recording.recording import Recording, read_recording
from harness.stream.recording.recording_writer import RecordingWriter, record_capture
from harness.stream.recording.replay import RecordingStream, ReplaySpeed, parse_speed, wait_for_enter
from harness.testing.stream_checks import check_stream
from tests.stream.wire import FOUR, RATE_HZ, RECORD, decode_frames, device_bytes, frames_equal, in_chunks, stamps_s

ROUNDS = 24
STAMPS_S = stamps_s(ROUNDS, begin_s=0.1)
DATA = device_bytes(STAMPS_S)


def all_equal(first: Sequence[TrackerFrame], second: Sequence[TrackerFrame]) -> bool:
    return len(first) == len(second) and all(frames_equal(a, b) for a, b in zip(first, second, strict=True))


def write_capture(path: Path, capture: ByteCapture | None = None) -> Path:
    record_capture(path, FOUR, in_chunks(DATA, STAMPS_S) if capture is None else capture, {})
    return path


@pytest.fixture
def recording_path(tmp_path: Path) -> Path:
    return write_capture(tmp_path / "whole.rec")


@pytest.fixture
def damaged_path(tmp_path: Path) -> Path:
    """A recording with silences, lost and damaged records, and a second configuration after a minute."""
    with RecordingWriter(tmp_path / "broken.rec") as writer:
        for begin_s in (100.0, 160.0):
            writer.on_configured(FOUR, begin_s - 0.1, 1e9)
            for i, at_s in enumerate((STAMPS_S - STAMPS_S[0] + begin_s).tolist()):
                record = DATA[i * RECORD : (i + 1) * RECORD]
                if i % 7 == 3:
                    continue
                if i > 30:
                    at_s += 0.5
                if i % 11 == 5:
                    record = record[:9] + b"\xff" + record[10:]
                writer.on_received(record, at_s, at_s + 1e9)
    return tmp_path / "broken.rec"


def test_the_stream_contract_holds(recording_path: Path, damaged_path: Path) -> None:
    assert len(check_stream(lambda: RecordingStream(recording_path), rate_hz=RATE_HZ)) == ROUNDS
    assert len(check_stream(lambda: RecordingStream(damaged_path), rate_hz=RATE_HZ)) > ROUNDS


def test_frames_are_those_of_the_wire(recording_path: Path) -> None:
    assert all_equal(list(RecordingStream(recording_path)), decode_frames(in_chunks(DATA, STAMPS_S)))


@settings(max_examples=10, deadline=None)
@given(chunk=st.integers(1, 300))
@example(chunk=159)
def test_chunks_change_only_the_times_of_reception(chunk: int, tmp_path_factory: pytest.TempPathFactory) -> None:
    capture = in_chunks(DATA, STAMPS_S, chunk)
    path = tmp_path_factory.mktemp("cut") / "a.rec"
    assert all_equal(list(RecordingStream(write_capture(path, capture))), decode_frames(capture))


@pytest.mark.parametrize("speed", [40.0, 1000.0, "step"])
def test_frames_are_the_same_at_any_speed(speed: ReplaySpeed, damaged_path: Path) -> None:
    assert all_equal(list(RecordingStream(damaged_path)), list(RecordingStream(damaged_path, 1e6)))
    recording_path = write_capture(damaged_path.with_name("whole.rec"))
    assert all_equal(
        list(RecordingStream(recording_path)), list(RecordingStream(recording_path, speed, step=lambda: True))
    )


def test_replay_keeps_the_recorded_pace(recording_path: Path) -> None:
    """It is never faster, however busy the computer; half a second of motion at half its speed."""
    began_s = time.monotonic()
    frames = list(RecordingStream(recording_path, 0.5))
    assert time.monotonic() - began_s >= 2.0 * (frames[-1].received_s - frames[0].received_s) - 0.01


def test_a_frame_is_closed_when_the_driver_closed_it(tmp_path: Path) -> None:
    """It is not delayed until the next bytes arrive."""
    path = tmp_path / "a.rec"
    with RecordingWriter(path) as writer:
        writer.on_configured(FOUR, 99.0, 99.0)
        writer.on_received(DATA[: 5 * RECORD], 100.0, 100.0)
        writer.on_received(b"", 100.0 + 2.0 / RATE_HZ, 100.0 + 2.0 / RATE_HZ)
        writer.on_received(DATA[8 * RECORD :], 3600.0, 3600.0)
    stream = RecordingStream(path, 1.0)
    frames = iter(stream)
    began_s = time.monotonic()
    assert [int(next(frames).position_valid.sum()) for _ in range(2)] == [4, 1]
    assert time.monotonic() - began_s < 60.0
    stream.close()
    assert list(frames) == []
    assert all_equal(list(RecordingStream(path)), list(RecordingStream(path, 1e9)))


def test_closing_ends_a_wait(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    with RecordingWriter(path) as writer:
        writer.on_configured(FOUR, 99.0, 99.0)
        writer.on_received(DATA[: 4 * RECORD], 100.0, 100.0)
        writer.on_received(DATA[4 * RECORD :], 1e6, 1e6)
    stream = RecordingStream(path, 1.0)
    frames = iter(stream)
    next(frames)
    threading.Timer(0.05, stream.close).start()
    assert list(frames) == []


def test_a_step_reads_a_line_of_input(recording_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("\n\n\n"))
    assert len(list(RecordingStream(recording_path, "step", step=wait_for_enter))) == 3


def test_a_second_configuration_continues_the_stream(damaged_path: Path) -> None:
    stream = RecordingStream(damaged_path)
    frames = list(stream)
    received_s = np.array([frame.received_s for frame in frames])
    latest_s = np.array([np.nanmax(frame.measured_s) for frame in frames])
    assert (np.diff(received_s) > 0.0).all()
    assert (np.diff(latest_s) > 0.0).all()
    jump = int(np.argmax(np.diff(received_s)))
    assert np.diff(latest_s)[jump] == pytest.approx(np.diff(received_s)[jump], abs=13.0)
    assert stream.counts["sessions"] == 2
    assert stream.device_zero_s > 0.0


def test_the_wall_clock_bridges_a_restart_of_the_computer(tmp_path: Path) -> None:
    """The monotonic clock starts again after a restart."""
    path = tmp_path / "a.rec"
    for begin_s, wall_s in ((5000.0, 1e9), (7.0, 1e9 + 300.0)):
        with RecordingWriter(path) as writer:
            writer.on_configured(FOUR, begin_s, wall_s)
            for i, at_s in enumerate((STAMPS_S - STAMPS_S[0]).tolist()):
                writer.on_received(DATA[i * RECORD : (i + 1) * RECORD], begin_s + 0.1 + at_s, wall_s + 0.1 + at_s)
    stream = RecordingStream(path)
    wall_times_s, frames = [], []
    for frame in stream:
        frames.append(frame)
        wall_times_s.append(stream.wall_s(frame.received_s))
    assert len(frames) == 2 * ROUNDS
    gaps_s = [b.received_s - a.received_s for a, b in pairwise(frames)]
    assert max(gaps_s) == pytest.approx(300.0, abs=1.0)
    assert min(gaps_s) > 0.0
    np.testing.assert_allclose(np.diff(wall_times_s), gaps_s, atol=1e-5)
    check_stream(lambda: RecordingStream(path), rate_hz=RATE_HZ)


def test_a_damaged_block_costs_only_its_records(recording_path: Path) -> None:
    data = bytearray(recording_path.read_bytes())
    at = data.index(DATA[40 * RECORD : 41 * RECORD])
    data[at + 5] ^= 0x55
    recording_path.write_bytes(data)
    stream = RecordingStream(recording_path)
    frames = list(stream)
    assert len(stream.recording.damage) == 1
    clean = decode_frames(in_chunks(DATA, STAMPS_S))
    assert [i for i, (a, b) in enumerate(zip(frames, clean, strict=True)) if not frames_equal(a, b)] == [10]
    assert frames[10].position_valid.tolist() == [False, True, True, True]


def test_a_recording_truncated_anywhere_is_replayed_or_refused(recording_path: Path) -> None:
    data = recording_path.read_bytes()[: 2000 + len(FILE_HEADER)]
    max_frames = 0
    for cut in range(1, len(data), 7):
        recording = Recording(recording_path, data[:cut])
        if not recording.formats:
            with pytest.raises(BadFile, match="never configured in it"):
                RecordingStream(recording)
            continue
        frames = list(RecordingStream(recording))
        block_count = sum(block.kind == RECEIVED for block in recording.blocks())
        assert len(frames) == -(-block_count // 4)
        max_frames = max(max_frames, len(frames))
    assert max_frames > 3


def test_a_recording_without_a_configuration_is_refused(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.rec") as writer:
        writer.on_received(DATA, 1.0, 2.0)
        with pytest.raises(BadFile, match="the device was never configured in it"):
            RecordingStream(tmp_path / "a.rec")


def test_stations_never_change(recording_path: Path, tmp_path: Path) -> None:
    second = tmp_path / "other.rec"
    record_capture(second, WireFormat(("head",), RATE_HZ), in_chunks(DATA, STAMPS_S), {})
    both = recording_path.read_bytes() + second.read_bytes()[len(FILE_HEADER) :]
    with pytest.raises(BadFile, match=r"stations head, .* become head; expected the same stations"):
        RecordingStream(Recording(recording_path, both))


def test_a_growing_file_is_replayed_as_it_was_read(recording_path: Path) -> None:
    stream = RecordingStream(read_recording(recording_path))
    with RecordingWriter(recording_path) as writer:
        writer.on_configured(FOUR, 1e4, 1e4)
    assert len(list(stream)) == len(list(stream)) == ROUNDS


@pytest.mark.parametrize(("text", "speed"), [("step", "step"), ("max", "max"), ("1", 1.0), ("0.25", 0.25)])
def test_speeds(text: str, speed: ReplaySpeed) -> None:
    assert parse_speed(text) == speed


@pytest.mark.parametrize("text", ["", "fast", "0", "-1", "nan", "inf"])
def test_an_impossible_speed_is_refused(text: str) -> None:
    with pytest.raises(BadInput, match="`step`, `max`, or a positive number"):
        parse_speed(text)


def test_a_recording_of_an_earlier_version_replays_as_before(tmp_path: Path) -> None:
    """It has item 16 of two bytes, and another meaning of `G` and `H` in its exchanges."""
    items, settings = (2, 11, 16, 21, 1), RecordFormat(stylus_bytes=2)
    stamp_s = STAMPS_S
    values = decode_frames(in_chunks(DATA, STAMPS_S))
    position_m = np.concatenate([frame.position_m for frame in values])
    quaternion = np.concatenate([frame.tracker_from_station for frame in values])
    table = encode_records(
        items,
        np.frombuffer(b"1234" * ROUNDS, np.uint8),
        RecordValues(stamp_s, position_m, quaternion, np.ones(len(stamp_s))),
        settings,
    )
    size = table.dtype.itemsize
    wire = {
        "stations": ["head", "torso", "left_wrist", "right_wrist"],
        "rate_hz": RATE_HZ,
        "items": list(items),
        "settings": {"metres_per_unit": 0.01, "seconds_per_tick": 0.001, "binary": True, "stylus_bytes": 2},
        "characters": "1234",
    }
    answer = {
        "command": "H1", "sent": "48 31 0d 0a", "received": "32 31 48",
        "answers": [{"kind": "GeometryReply", "station": "1", "letter": "H", "values": [10.0, 20.0, 30.0]}],
    }  # fmt: skip
    blocks = [
        RecordingBlock(SENT, 99.0, 1e9, b"G1\r\nH1\r\nH1,0.000,0.000,0.000\r\n"),
        RecordingBlock(RECEIVED, 99.1, 1e9, b"21G   0.00   0.00   0.00\r\n21H  10.00  20.00  30.00\r\n"),
        RecordingBlock(ANSWERED, 99.2, 1e9, json.dumps(answer).encode()),
        RecordingBlock(CONFIGURED, 99.9, 1e9, json.dumps(wire).encode()),
    ]
    data = table.tobytes()
    for i, at_s in enumerate((stamp_s - stamp_s[0] + 100.0).tolist()):
        blocks.append(RecordingBlock(RECEIVED, at_s, 1e9, data[i * size : (i + 1) * size]))
    path = tmp_path / "old.rec"
    path.write_bytes(FILE_HEADER + b"".join(map(encode_block, blocks)))
    stream = RecordingStream(path)
    frames = list(stream)
    assert len(frames) == ROUNDS
    assert stream.counts["garbage_bytes"] == 0
    np.testing.assert_allclose([frame.position_m for frame in frames], position_m.reshape(ROUNDS, 4, 3), atol=1e-6)
    assert read_recording(path).answers[0]["answers"][0]["letter"] == "H"
