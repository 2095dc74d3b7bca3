"""Recordings: the content is preserved despite truncation and damage, and no other file is ever written to."""

import json
import os
import signal
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.errors import BadFile, SystemFault
from harness.stream.line_events import LineEvent
from harness.stream.polhemus.codec.reader import ByteCapture, WireFormat
from harness.stream.polhemus.codec.records import RecordFormat
from harness.stream.recording.blocks import (
    BLOCK_MARKER,
    CONFIGURED,
    FILE_HEADER,
    MARK,
    MAX_PAYLOAD_BYTES,
    NOTE,
    POSES_VERSION,
    RECEIVED,
    SENT,
    DamagedSpan,
    RecordingBlock,
    encode_block,
    read_blocks,
)
from harness.stream.recording.recording import Recording, read_marks, read_recording
from harness.stream.recording.recording_writer import RecordingWriter, record_capture
from tests.stream.wire import FOUR

ENTRIES = [
    RecordingBlock(SENT, 10.0, 1e9, b"C"),
    RecordingBlock(RECEIVED, 10.5, 1e9 + 0.5, b"01 some bytes\r\n"),
    RecordingBlock(RECEIVED, 11.0, 1e9 + 1.0, BLOCK_MARKER + b"among data" + bytes(range(256))),
    RecordingBlock(RECEIVED, 11.5, 1e9 + 1.5, b""),
]
FILE_BYTES = FILE_HEADER + b"".join(map(encode_block, ENTRIES))


def read_entries(data: bytes) -> tuple[list[RecordingBlock], list[DamagedSpan]]:
    blocks = list(read_blocks(data, 0 if data[: len(FILE_HEADER)] != FILE_HEADER else len(FILE_HEADER)))
    return [e for e in blocks if isinstance(e, RecordingBlock)], [e for e in blocks if isinstance(e, DamagedSpan)]


def write_recording(path: Path) -> Path:
    """Write a small recording with blocks of every kind."""
    with RecordingWriter(path, {"source": "a test"}) as writer:
        writer.on_sent(b"c", 1.0, 101.0)
        writer.on_configured(FOUR, 1.1, 101.1)
        writer.on_sent(b"C", 1.2, 101.2)
        writer.on_received(b"01 ", 1.3, 101.3)
        writer.on_event(LineEvent("unplugged", 1.35, 101.35, "the port is gone"))
        writer.on_received(b"02 ", 1.4, 101.4)
    return path


def test_reading_returns_what_was_written(tmp_path: Path) -> None:
    recording = read_recording(write_recording(tmp_path / "a.rec"))
    assert recording.damage == ()
    assert recording.note == {"source": "a test"}
    assert recording.formats == (FOUR,)
    (event,) = recording.events
    assert event.pop("elapsed_s") == pytest.approx(0.35)
    assert event == {"monotonic_s": 1.35, "kind": "unplugged", "text": "the port is gone"}
    over_the_line = [b for b in recording.blocks() if b.kind in (SENT, RECEIVED)]
    assert over_the_line == [
        RecordingBlock(SENT, 1.0, 101.0, b"c"),
        RecordingBlock(SENT, 1.2, 101.2, b"C"),
        RecordingBlock(RECEIVED, 1.3, 101.3, b"01 "),
        RecordingBlock(RECEIVED, 1.4, 101.4, b"02 "),
    ]


@settings(max_examples=50)
@given(data=st.binary(max_size=300), monotonic_s=st.floats(0.0, 1e9), wall_s=st.floats(0.0, 1e10))
def test_any_bytes_at_any_time_are_preserved(data: bytes, monotonic_s: float, wall_s: float) -> None:
    block = RecordingBlock(RECEIVED, monotonic_s, wall_s, data)
    assert list(read_blocks(encode_block(block) * 2, 0)) == [block, block]


def test_the_wire_format_is_complete(tmp_path: Path) -> None:
    unusual_format = WireFormat(("head", "torso"), 75.0, (18, 20, 21), RecordFormat(0.0254, 1e-6, binary=False), b"2A")
    with RecordingWriter(tmp_path / "a.rec") as writer:
        writer.on_configured(unusual_format)
    assert read_recording(tmp_path / "a.rec").formats == (unusual_format,)


def test_long_data_are_split_into_blocks(tmp_path: Path) -> None:
    data = os.urandom(MAX_PAYLOAD_BYTES + 5)
    with RecordingWriter(tmp_path / "a.rec") as writer:
        writer.on_configured(FOUR, 1.0, 2.0)
        writer.on_received(data, 1.0, 2.0)
    read = [b for b in read_recording(tmp_path / "a.rec").blocks() if b.kind == RECEIVED]
    assert [len(b.payload) for b in read] == [MAX_PAYLOAD_BYTES, 5]
    assert b"".join(b.payload for b in read) == data


def test_a_recording_truncated_anywhere_is_readable_and_reports_the_damage(tmp_path: Path) -> None:
    all_bytes = write_recording(tmp_path / "a.rec").read_bytes()
    all_blocks = list(Recording(tmp_path, all_bytes).blocks())
    ends = [len(FILE_HEADER)]
    for block in all_blocks:
        ends.append(ends[-1] + len(encode_block(block)))
    assert ends[-1] == len(all_bytes)
    for cut in range(1, len(all_bytes)):
        (tmp_path / "cut.rec").write_bytes(all_bytes[:cut])
        recording = read_recording(tmp_path / "cut.rec")
        whole_blocks = sum(end <= cut for end in ends[1:])
        assert list(recording.blocks()) == all_blocks[:whole_blocks]
        begin = ends[whole_blocks] if cut >= len(FILE_HEADER) else 0
        assert [f"the last {cut - begin} bytes" in damage for damage in recording.damage] == [True] * (cut > begin)


@given(at=st.integers(0, len(FILE_BYTES) - 1), mask=st.integers(1, 255))
def test_a_flipped_byte_costs_its_block_and_is_reported(at: int, mask: int) -> None:
    data = bytearray(FILE_BYTES)
    data[at] ^= mask
    blocks, damage = read_entries(bytes(data))
    end, block_index = len(FILE_HEADER), 0
    while at >= end:
        end += len(encode_block(ENTRIES[block_index]))
        block_index += 1
    expected = [e for i, e in enumerate(ENTRIES) if i != block_index - 1]
    assert blocks == expected
    assert len(damage) == 1
    assert damage[0].begin <= at < damage[0].end


@given(
    garbage=st.lists(
        st.binary(max_size=80) | st.sampled_from([BLOCK_MARKER, encode_block(ENTRIES[0])[:20]]), max_size=5
    )
)
def test_garbage_between_blocks_hides_no_block(garbage: list[bytes]) -> None:
    data = FILE_HEADER + b"".join(encode_block(ENTRIES[1]) + part for part in garbage) + encode_block(ENTRIES[2])
    blocks, damage = read_entries(data)
    assert blocks == [*[ENTRIES[1]] * len(garbage), ENTRIES[2]]
    assert sum(e.end - e.begin for e in damage) == sum(map(len, garbage))


def test_damage_in_the_middle_is_reported_by_position_and_time(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "a.rec")
    data = bytearray(path.read_bytes())
    at = data.index(b"01 ")
    data[at] ^= 1
    path.write_bytes(data)
    (damage,) = read_recording(path).damage
    assert "damaged: between 0.200 s and" in damage


def test_a_damaged_header_does_not_cost_the_rest(tmp_path: Path) -> None:
    data = bytearray(write_recording(tmp_path / "a.rec").read_bytes())
    data[9] ^= 0xFF
    (tmp_path / "a.rec").write_bytes(data)
    recording = read_recording(tmp_path / "a.rec")
    assert recording.formats == (FOUR,)
    assert recording.damage == ("bytes 0 to 16 are damaged: the beginning; times count from the first whole block",)


def test_recording_continues_at_the_end_of_the_file(tmp_path: Path) -> None:
    """Also after a block that was cut off: nothing is ever removed."""
    path = write_recording(tmp_path / "a.rec")
    cut = path.read_bytes()[:-7]
    path.write_bytes(cut)
    with RecordingWriter(path, {"source": "another test"}) as writer:
        writer.on_configured(FOUR, 5.0, 105.0)
        writer.on_received(b"03 ", 5.1, 105.1)
    assert path.read_bytes()[: len(cut)] == cut
    recording = read_recording(path)
    assert [b.payload for b in recording.blocks() if b.kind == RECEIVED] == [b"01 ", b"03 "]
    assert len(recording.formats) == 2
    assert recording.note == {"source": "another test"}
    assert len(recording.damage) == 1


@pytest.mark.parametrize("size", range(len(FILE_HEADER)))
def test_a_truncated_header_is_completed(size: int, tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    path.write_bytes(FILE_HEADER[:size])
    with RecordingWriter(path) as writer:
        writer.on_sent(b"c", 1.0, 2.0)
    assert path.read_bytes().startswith(FILE_HEADER + BLOCK_MARKER)
    assert read_recording(path).damage == ()


def test_no_file_is_made_before_the_first_write(tmp_path: Path) -> None:
    with RecordingWriter(tmp_path / "a.rec"):
        pass
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("content", [b"x", b"# a scenario\nschema = 1\n" * 100, b"\x00" * 5000, FILE_HEADER[:7] + b"?"])
def test_another_file_is_refused_untouched(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "a.toml"
    path.write_bytes(content)
    for open_file in (RecordingWriter, read_recording):
        with pytest.raises(BadFile, match=r"(no recording|binary data); expected a recording"):
            open_file(path)
    assert path.read_bytes() == content


def newer_file(version: int = POSES_VERSION + 1) -> bytes:
    import struct
    import zlib

    head = FILE_HEADER[:8] + struct.pack("<I", version)
    return head + struct.pack("<I", zlib.crc32(head)) + b"what nobody knows yet"


def test_a_newer_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    path.write_bytes(newer_file())
    for open_file in (RecordingWriter, read_recording):
        with pytest.raises(
            BadFile, match=r"version 3; expected version 2 at most\. Use the newer version of the harness"
        ):
            open_file(path)
    assert path.read_bytes() == newer_file()


def test_unwritable_places_are_refused(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="The port comes first"):
        RecordingWriter("/dev/null")
    with pytest.raises(BadFile, match="The port comes first"):
        RecordingWriter(tmp_path)
    with pytest.raises(BadFile, match="no such folder"):
        RecordingWriter(tmp_path / "none" / "a.rec")


def test_reading_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="no such file"):
        read_recording(tmp_path / "a.rec")
    with pytest.raises(BadFile, match="a folder"):
        read_recording(tmp_path)
    (tmp_path / "empty.rec").touch()
    with pytest.raises(BadFile, match="an empty file"):
        read_recording(tmp_path / "empty.rec")


def test_other_stations_are_refused(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "a.rec")
    before = path.read_bytes()
    with (
        RecordingWriter(path) as writer,
        pytest.raises(BadFile, match="Record other stations into another file"),
    ):
        writer.on_configured(WireFormat(("head",), 40.0))
    assert path.read_bytes() == before


def test_two_writers_of_one_file_are_refused(tmp_path: Path) -> None:
    pytest.importorskip("fcntl", reason="only where the system has flock")
    with RecordingWriter(tmp_path / "a.rec") as first_writer:
        first_writer.on_configured(FOUR, 1.0, 2.0)
        with RecordingWriter(tmp_path / "a.rec") as second_writer, pytest.raises(BadFile, match="Another process"):
            second_writer.on_sent(b"c", 1.0, 2.0)
    assert len(list(read_recording(tmp_path / "a.rec").blocks())) == 2


def test_a_new_file_without_a_configuration_is_removed(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    with RecordingWriter(path) as writer:
        writer.on_sent(b"S", 1.0, 2.0)
        assert path.exists()
    assert not path.exists()
    before = write_recording(path).read_bytes()
    with RecordingWriter(path) as writer:
        writer.on_sent(b"S", 1.0, 2.0)
    assert path.read_bytes().startswith(before)


def test_a_full_disk_is_reported() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full to simulate a full disk")
    writer = RecordingWriter("unused")
    writer._file = os.open("/dev/full", os.O_WRONLY)
    with pytest.raises(SystemFault, match="No space left"):
        writer.on_sent(b"c", 1.0, 2.0)
    os.close(writer._file)


ENDLESS_WRITER = """
import sys
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.recording.recording_writer import RecordingWriter
writer = RecordingWriter(sys.argv[1], {"source": "a test"})
writer.on_configured(WireFormat(("head",), 40.0), 0.0, 0.0)
for count in range(10**9):
    writer.on_received(b"%d\\n" % count, float(count), float(count))
    if count % 1000 == 0:
        print(count, flush=True)
"""


def test_a_killed_process_loses_at_most_the_block_it_was_writing(tmp_path: Path) -> None:
    """As by `kill -9`: every block handed over before is in the file."""
    path = tmp_path / "a.rec"
    with subprocess.Popen(
        [sys.executable, "-c", ENDLESS_WRITER, str(path)], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        last_count = [int(process.stdout.readline()) for _ in range(3)][-1]
        time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
    recording = read_recording(path)
    counts = [int(b.payload) for b in recording.blocks() if b.kind == RECEIVED]
    assert counts == list(range(len(counts)))
    assert len(counts) > last_count
    assert len(recording.damage) <= 1


def test_conf_blocks_are_json(tmp_path: Path) -> None:
    configured = next(b for b in read_recording(write_recording(tmp_path / "a.rec")).blocks() if b.kind == "conf")
    content = json.loads(configured.payload)
    assert content["stations"] == list(FOUR.stations)
    assert content["items"] == list(FOUR.items)


@pytest.mark.parametrize(
    ("payload", "message"),
    [
        (b"no JSON", "a conf block that is not JSON"),
        (b"[]", "missing stations, rate_hz"),
        (b'{"stations": ["head"], "rate_hz": 0}', "0 records per second of each station. A device sends 0.001 to"),
        (b'{"stations": ["head"], "rate_hz": 40, "pace": 1}', "no key in wire format called 'pace'"),
        (b'{"stations": ["head"], "rate_hz": 40, "characters": "Z"}', "one of 123456789ABC for each"),
    ],
)
def test_an_unusable_format_is_refused(payload: bytes, message: str) -> None:
    data = FILE_HEADER + encode_block(RecordingBlock("conf", 1.0, 2.0, payload))
    with pytest.raises(BadFile, match=message):
        _ = Recording(Path("a.rec"), data).formats


def test_a_simulated_line_is_recorded_chunk_by_chunk_with_its_marks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chunks = [b"a" * (i % 3) for i in range(20)] + [b"b" * (MAX_PAYLOAD_BYTES + 1)]
    capture = ByteCapture(b"".join(chunks), np.cumsum([len(one) for one in chunks]), 5.0 + np.arange(21.0))
    marks = ((0.0, "static"), (9.5, "slow"), (99.0, "never"))
    contents = []
    for name, per_write in (("a.rec", 4096), ("b.rec", 3)):
        monkeypatch.setattr("harness.stream.recording.recording_writer._CHUNKS_PER_WRITE", per_write)
        writer = record_capture(tmp_path / name, FOUR, capture, {}, marks=marks)
        assert (writer.counts[RECEIVED], writer.counts[MARK]) == (len(capture.data), 2)
        contents.append((tmp_path / name).read_bytes())
    assert contents[0] == contents[1]
    blocks = list(read_recording(tmp_path / "a.rec").blocks())
    assert [block.kind for block in blocks] == [NOTE, CONFIGURED, MARK, *[RECEIVED] * 5, MARK, *[RECEIVED] * 17]
    received = [block for block in blocks if block.kind == RECEIVED]
    assert [block.payload for block in received] == [*chunks[:20], chunks[20][:-1], b"b"]
    assert [block.monotonic_s for block in received] == [*capture.received_s, 25.0]
    assert [(mark["monotonic_s"], mark["stretch"]) for mark in read_recording(tmp_path / "a.rec").marks] == [
        (0.0, "static"),
        (9.5, "slow"),
    ]
    record_capture(tmp_path / "c.rec", FOUR, capture, {}, seconds=4.0, marks=marks)
    assert sum(block.kind == RECEIVED for block in read_recording(tmp_path / "c.rec").blocks()) == 4
    assert len(read_recording(tmp_path / "c.rec").marks) == 1


def test_a_long_recording_is_continued_without_reading_it_whole(tmp_path: Path) -> None:
    path = write_recording(tmp_path / "a.rec")
    with RecordingWriter(path) as writer:
        for i in range(400):
            writer.on_received(bytes(MAX_PAYLOAD_BYTES), float(i), float(i))
    tracemalloc.start()
    RecordingWriter(path).close()
    assert read_marks(path) == []
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 0.6 * path.stat().st_size


@pytest.mark.skipif(not Path("/proc/self/fd").is_dir(), reason="the system does not list open files")
def test_a_closed_recording_holds_no_file(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"

    def is_open() -> bool:
        return any(
            link.is_symlink() and os.path.realpath(link) == str(path) for link in Path("/proc/self/fd").iterdir()
        )

    writer = RecordingWriter(path, {"source": "a test"})
    writer.on_configured(FOUR, 1.1, 101.1)
    assert is_open()
    writer.close()
    assert path.is_file()
    assert not is_open()


PLAN_NOTES: list[list[dict[str, str] | None]] = [
    [{"plan": "a" * 64}, None, {"plan": "b" * 64}],
    [{"plan": "a" * 64}, None, {}],
    [{}, None, {"plan": "a" * 64}],
    [None, {"plan": "a" * 64}],
]
"""Notes of a recording in file order; None stands for bytes from the device."""


def with_notes(path: Path, notes: list[dict[str, str] | None]) -> Path:
    blocks = [
        RecordingBlock(RECEIVED, 1.0, 1.0, b"01 ")
        if note is None
        else RecordingBlock(NOTE, 1.0, 1.0, json.dumps(note).encode())
        for note in notes
    ]
    path.write_bytes(FILE_HEADER + b"".join(map(encode_block, blocks)))
    return path


@pytest.mark.parametrize(
    ("notes", "values"),
    [
        (PLAN_NOTES[0], ("a" * 64, "b" * 64)),
        (PLAN_NOTES[1], ("a" * 64, "")),
        (PLAN_NOTES[2], ("", "a" * 64)),
        (PLAN_NOTES[3], ("", "a" * 64)),
        ([{"plan": "a" * 64}, None, {"plan": "a" * 64}, None], ("a" * 64,)),
        ([{}, None], ("",)),
        ([], ()),
    ],
)
def test_the_values_of_all_notes_and_of_data_before_them(
    tmp_path: Path, notes: list[dict[str, str] | None], values: tuple[str, ...]
) -> None:
    assert read_recording(with_notes(tmp_path / "a.rec", notes)).note_values("plan") == values


@pytest.mark.parametrize("plan", ["", "b" * 64])
@pytest.mark.parametrize("notes", [[{"plan": "a" * 64}], [{"plan": "a" * 64}, None], *PLAN_NOTES])
def test_the_plan_of_a_recording_is_not_renewed(tmp_path: Path, notes: list[dict[str, str] | None], plan: str) -> None:
    path = with_notes(tmp_path / "a.rec", notes)
    before = path.read_bytes()
    with pytest.raises(BadFile, match="never renewed"):
        RecordingWriter(path, {"plan": plan} if plan else {})
    assert path.read_bytes() == before


@pytest.mark.parametrize("notes", [[None], [{}, None], [{}]])
def test_a_plan_comes_before_the_first_data(tmp_path: Path, notes: list[dict[str, str] | None]) -> None:
    path = with_notes(tmp_path / "a.rec", notes)
    with pytest.raises(BadFile, match="a recording for no plan; expected one for the plan aaaaaaaaaaaa"):
        RecordingWriter(path, {"plan": "a" * 64})
    with RecordingWriter(path) as writer:
        writer.on_sent(b"c", 2.0, 2.0)
    assert read_recording(path).note_values("plan") == ("",)


def test_a_recording_of_a_plan_goes_on_under_it(tmp_path: Path) -> None:
    path = with_notes(tmp_path / "a.rec", [{"plan": "a" * 64}, None])
    with RecordingWriter(path, {"plan": "a" * 64}) as writer:
        writer.on_configured(FOUR, 2.0, 2.0)
    assert read_recording(path).note_values("plan") == ("a" * 64,)
    (tmp_path / "empty.rec").touch()
    RecordingWriter(tmp_path / "empty.rec", {"plan": "a" * 64}).close()
