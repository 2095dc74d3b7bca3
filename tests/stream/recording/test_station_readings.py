"""Readings of recordings: as frames have them, in pieces, from damaged files, and with marks."""

import tracemalloc
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.core.arrays import Floats
from harness.errors import BadFile, HarnessError
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.polhemus.codec.records import RecordValues, encode_records
from harness.stream.recording.blocks import read_blocks
from harness.stream.recording.recording import read_recording
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.recording.replay import RecordingStream
from harness.stream.recording.station_readings import CaptureBlock, CaptureReader, StationReadings

WIRE = WireFormat(("head", "torso", "left_hand"), 40.0)
RNG_SEED = 5


def records(frames: int, *, first: int = 0, seed: int = RNG_SEED) -> list[bytes]:
    """Records of slowly moving stations, some of them lost."""
    rng = np.random.default_rng(seed)
    count = frames * len(WIRE.stations)
    time_s = (first + np.repeat(np.arange(frames), 3)) / 40.0 + np.tile(np.arange(3) * 0.004, frames)
    position_m = 0.1 * np.sin(time_s)[:, None] + 0.001 * rng.normal(size=(count, 3))
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1))
    quality = np.where(rng.random(count) < 0.05, 0.0, 1.0)
    characters = np.tile(np.frombuffer(WIRE.characters, np.uint8), frames)
    table = encode_records(WIRE.items, characters, RecordValues(time_s, position_m, turn, quality), WIRE.settings)
    return [table[i : i + 1].tobytes() for i in range(count)]


def write(path: Path, marks: Iterable[tuple[int, str]] = (), frames: int = 200, junk: bytes = b"") -> None:
    """A recording of one chunk a record; `marks` are frames at which a stretch begins."""
    stretch_at = dict(marks)
    with RecordingWriter(path, {"source": "test"}) as writer:
        writer.on_configured(WIRE, 100.0, 100.0)
        for i, record in enumerate(records(frames)):
            now_s = 100.01 + i / 120.0
            if i % 3 == 0 and i // 3 in stretch_at:
                writer.on_mark({"stretch": stretch_at[i // 3]}, now_s, now_s)
            writer.on_received((junk if i == 30 else b"") + record, now_s, now_s)


def join(blocks: Iterable[CaptureBlock], station: str) -> list[Floats]:
    parts = [block.stations[station] for block in blocks if block.stations]
    return [np.concatenate([getattr(part, name) for part in parts]) for name in StationReadings.__dataclass_fields__]


def test_readings_agree_with_frames(tmp_path: Path) -> None:
    write(tmp_path / "one.rec", junk=b"\x01\x02\x03\x04\x05")
    frames = list(RecordingStream(tmp_path / "one.rec"))
    blocks = list(CaptureReader(tmp_path / "one.rec").blocks())
    assert len(blocks) == 1
    assert blocks[0].garbage_bytes == 5
    for row, station in enumerate(WIRE.stations):
        readings = blocks[0].stations[station]
        assert len(readings) == len(frames) == 200
        for name in ("measured_s", "position_m", "tracker_from_station", "quality", "suspect"):
            expected = np.array([getattr(frame, name)[row] for frame in frames])
            np.testing.assert_array_equal(getattr(readings, name), expected)
        np.testing.assert_array_equal(readings.stamp_s, readings.measured_s)
        assert np.isnan(readings.position_m[readings.quality == 0.0]).all()
        assert readings.received_s[0] == pytest.approx(100.01 + row / 120.0)


def test_pieces_together_are_the_whole(tmp_path: Path) -> None:
    write(tmp_path / "one.rec", frames=400)
    whole = list(CaptureReader(tmp_path / "one.rec").blocks())
    pieces = list(CaptureReader(tmp_path / "one.rec").blocks(1.0))
    assert len(pieces) > 8
    assert sum(piece.records for piece in pieces) == whole[0].records == 1200
    for station in WIRE.stations:
        for one, other in zip(join(whole, station), join(pieces, station), strict=True):
            np.testing.assert_array_equal(one, other)


def test_marks_name_stretches_and_other_readers_skip_them(tmp_path: Path) -> None:
    write(tmp_path / "marked.rec", [(40, "static"), (120, "fast"), (160, "")])
    write(tmp_path / "plain.rec")
    blocks = list(CaptureReader(tmp_path / "marked.rec").blocks())
    assert [(block.stretch, block.records) for block in blocks] == [
        ("", 120),
        ("static", 240),
        ("fast", 120),
        ("", 120),
    ]
    assert [mark["stretch"] for mark in read_recording(tmp_path / "marked.rec").marks] == ["static", "fast", ""]
    marked, plain = (list(RecordingStream(tmp_path / name)) for name in ("marked.rec", "plain.rec"))
    assert [frame.received_s for frame in marked] == [frame.received_s for frame in plain]


def test_a_second_configuration_begins_a_session(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "two.rec") as writer:
        for session in range(2):
            begin_s = 100.0 + 50.0 * session
            writer.on_configured(WIRE, begin_s, begin_s)
            for i, record in enumerate(records(20)):
                writer.on_received(record, begin_s + 0.01 + i / 120.0, begin_s)
    blocks = list(CaptureReader(tmp_path / "two.rec").blocks())
    assert [(block.session, block.configured_s, block.records) for block in blocks] == [(0, 100.0, 60), (1, 150.0, 60)]
    assert blocks[1].stations["head"].measured_s[0] == 0.0


def test_reading_leaves_the_file_as_it_is_and_says_what_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "one.rec"
    write(path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(bytes(data[:-3]))
    before = path.read_bytes()
    reader = CaptureReader(path)
    found = sum(block.records for block in reader.blocks())
    assert 590 <= found < 600
    assert reader.damage == list(read_recording(path).damage)
    assert len(reader.damage) == 2
    assert path.read_bytes() == before


@given(data=st.data())
def test_a_damaged_capture_is_read_or_refused(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("damaged") / "one.rec"
    write(path, [(5, "static")], frames=20)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(0, 5))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(bytes(content[: data.draw(st.integers(0, len(content)))]))
    with suppress(HarnessError):
        reader = CaptureReader(path)
        assert sum(block.records for block in reader.blocks()) <= 60


@settings(max_examples=40)
@given(data=st.data())
def test_records_of_a_damaged_capture_are_those_of_its_frames(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Lost, changed and repeated bytes on the line: frames and readings have the same poses, station by station."""
    path = tmp_path_factory.mktemp("line") / "one.rec"
    with RecordingWriter(path) as writer:
        writer.on_configured(WIRE, 100.0, 100.0)
        for i, record in enumerate(records(15)):
            chunk, at = record, data.draw(st.integers(0, len(record) - 1))
            match data.draw(st.sampled_from(("whole", "whole", "whole", "lost", "changed", "repeated", "cut"))):
                case "lost":
                    chunk = record[:at] + record[at + 1 :]
                case "changed":
                    chunk = record[:at] + bytes([data.draw(st.integers(0, 255))]) + record[at + 1 :]
                case "repeated":
                    chunk = record + record
                case "cut":
                    chunk = record[:at]
            writer.on_received(chunk, 100.01 + i / 120.0, 100.0)
    frames, blocks = list(RecordingStream(path)), list(CaptureReader(path).blocks())
    for row, station in enumerate(WIRE.stations):
        parts = [block.stations[station] for block in blocks if block.stations]
        for name in ("position_m", "tracker_from_station"):
            found = np.concatenate(
                [np.zeros((0, 3 if name == "position_m" else 4)), *(getattr(p, name) for p in parts)]
            )
            expected = np.array([getattr(frame, name)[row] for frame in frames]).reshape(-1, found.shape[1])
            np.testing.assert_array_equal(
                found[np.isfinite(found).all(axis=1)], expected[np.isfinite(expected).all(axis=1)]
            )


def test_a_repeated_record_is_there_twice(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.rec") as writer:
        writer.on_configured(WIRE, 100.0, 100.0)
        for i, record in enumerate(records(40)):
            writer.on_received(record * (2 if i == 61 else 1), 100.01 + i / 120.0, 100.0)
    (block,) = CaptureReader(tmp_path / "a.rec").blocks()
    torso = block.stations["torso"]
    assert [len(readings) for readings in block.stations.values()] == [40, 41, 40]
    (row,) = np.flatnonzero(np.diff(torso.stamp_s) == 0.0)
    assert row == 20
    np.testing.assert_array_equal(torso.position_m[20], torso.position_m[21])
    assert torso.received_s[20] == torso.received_s[21]


def test_a_clock_of_the_host_that_began_anew_parts_the_capture(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.rec") as writer:
        writer.on_configured(WIRE, 100.0, 100.0)
        for i, record in enumerate(records(40)):
            now_s = 100.01 + i / 120.0 - (90.0 if i >= 60 else 0.0)
            writer.on_received(record, now_s, 100.0)
    blocks = list(CaptureReader(tmp_path / "a.rec").blocks())
    assert [block.records for block in blocks] == [60, 60]
    assert all((np.diff(block.stations["head"].received_s) > 0.0).all() for block in blocks)


def test_memory_does_not_grow_with_the_length(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.stream.recording.blocks._PIECE_BYTES", 1 << 17)
    monkeypatch.setattr("harness.stream.recording.station_readings._BATCH_BYTES", 1 << 16)
    sizes, peaks = [], []
    for name, frames in (("short.rec", 1000), ("long.rec", 5000)):
        write(tmp_path / name, frames=frames)
        sizes.append((tmp_path / name).stat().st_size)
        tracemalloc.start()
        found = sum(block.records for block in CaptureReader(tmp_path / name).blocks(20.0))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert found == 3 * frames
    assert sizes[1] - sizes[0] > 7e5
    assert peaks[1] - peaks[0] < 3e5


def test_a_file_without_readings_is_refused(tmp_path: Path) -> None:
    empty, other = tmp_path / "empty.rec", tmp_path / "other.rec"
    empty.write_bytes(b"")
    other.write_bytes(b"no recording" * 100)
    for path, problem in ((empty, "empty"), (other, "no recording"), (tmp_path / "none.rec", "no such file")):
        with pytest.raises(BadFile, match=problem):
            CaptureReader(path)
    with RecordingWriter(tmp_path / "note.rec") as writer:
        writer.keep()
        writer.on_received(b"\r\n", 1.0, 1.0)
    with pytest.raises(BadFile, match="never configured"):
        CaptureReader(tmp_path / "note.rec")


@pytest.mark.parametrize("piece", [1, 7, 64, 1000])
def test_blocks_are_the_same_from_pieces_of_any_size(
    piece: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write(tmp_path / "one.rec", frames=10)
    data = bytearray((tmp_path / "one.rec").read_bytes())
    for place in (100, 300, 301, 777):
        data[place] ^= 0x55
    whole = list(read_blocks(bytes(data)))
    monkeypatch.setattr("harness.stream.recording.blocks._PIECE_BYTES", piece)
    assert list(read_blocks(bytes(data))) == whole
    assert any(type(entry).__name__ == "DamagedSpan" for entry in whole)
