"""Recordings of poses: what is written is read back exactly, older readers refuse it, damage costs its rows alone."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest

from harness.errors import BadFile, BadInput
from harness.stream.poses.options import PoseFileOptions
from harness.stream.poses.pose_log import BodyPoses, FileFinding, PoseLog
from harness.stream.recording.blocks import POSES_HEADER, RecordingBlock, encode_block, read_blocks
from harness.stream.recording.pose_recording import (
    is_pose_file,
    open_poses,
    read_pose_recording,
    write_pose_recording,
)
from harness.stream.recording.recording import read_recording
from harness.stream.recording.recording_writer import RecordingWriter
from harness.stream.recording.station_readings import CaptureReader
from tests.stream.poses.pose_files import COUNT, POSITIONS_M, QUATERNIONS, SAMPLES, TIMES_S, write
from tests.stream.recording.test_replay import write_capture

FINDINGS = (FileFinding("up", "z", "poses do not show it", assumed=True),)


def log(count: int = 10 * COUNT, start_unix_s: float | None = 1.5e9) -> PoseLog:
    """Two bodies, the second one half a step later; more rows than a block has."""
    rows = np.arange(count) % COUNT
    times_s = np.arange(count) / 50.0
    bodies = [BodyPoses(name, times_s + at_s, POSITIONS_M[rows], QUATERNIONS[rows]) for name, at_s in BODIES]
    return PoseLog(tuple(bodies), "a.csv", FINDINGS, "Unix time", start_unix_s)


BODIES = (("head", 0.0), ("hand", 0.01))


def assert_equal(found: PoseLog, expected: PoseLog) -> None:
    assert found.names == expected.names
    for mine, other in zip(found.bodies, expected.bodies, strict=True):
        for name in ("times_s", "positions_m", "quaternions"):
            np.testing.assert_array_equal(getattr(mine, name), getattr(other, name))


@pytest.mark.parametrize("start_unix_s", [None, 1.5e9 + 0.123])
def test_what_is_written_is_read_back_bit_by_bit(start_unix_s: float | None, tmp_path: Path) -> None:
    marks = [(0.0, "static"), (3.005, "slow"), (20.0, ""), (20.0, "fast"), (60.0, "")]
    write_pose_recording(tmp_path / "a.rec", log(start_unix_s=start_unix_s), {"plan": "ab12", "file": "a.csv"}, marks)
    found = read_pose_recording(tmp_path / "a.rec")
    assert_equal(found.log, log())
    assert (found.log.start_unix_s, found.log.clock, found.log.source) == (start_unix_s, "Unix time", "a.csv")
    assert found.log.findings == FINDINGS
    assert found.marks == tuple(marks)
    assert (found.plan, found.note["file"], found.damage) == ("ab12", "a.csv", ())


def test_marks_stand_before_the_rows_that_follow_them(tmp_path: Path) -> None:
    write_pose_recording(tmp_path / "a.rec", log(), {}, [(3.005, "slow")])
    kinds = [(block.kind, block.monotonic_s) for block in blocks(tmp_path / "a.rec")]
    at = kinds.index(("mark", 3.005))
    assert kinds[at + 1] == ("pose", 3.01)
    assert kinds[at - 1][0] == "pose"
    walls = [block.wall_s - block.monotonic_s for block in blocks(tmp_path / "a.rec")]
    np.testing.assert_allclose(walls, 1.5e9)


def blocks(path: Path) -> list[RecordingBlock]:
    found = list(read_blocks(path.read_bytes(), len(POSES_HEADER)))
    assert all(isinstance(block, RecordingBlock) for block in found)
    return found  # type: ignore[return-value]


def test_readers_of_version_1_refuse_it(tmp_path: Path) -> None:
    """The header is what every version begins with: its number and its check sum (`blocks`)."""
    write_pose_recording(tmp_path / "a.rec", log(), {})
    head = (tmp_path / "a.rec").read_bytes()[:16]
    magic, version, check = struct.unpack("<8sII", head)
    assert (magic, version, check) == (b"\x89IS900\r\n", 2, zlib.crc32(head[:12]))


def test_readers_of_lines_refuse_it_in_words(tmp_path: Path) -> None:
    write_pose_recording(tmp_path / "a.rec", log(), {})
    for read in (read_recording, CaptureReader, RecordingWriter):
        with pytest.raises(BadFile, match=r"of poses; expected a recording of a device's line\. .harness inspect"):
            read(tmp_path / "a.rec")


def test_poses_are_not_appended(tmp_path: Path) -> None:
    for path in (write_capture(tmp_path / "line.rec"), write(tmp_path / "other.rec", "text")):
        before = path.read_bytes()
        with pytest.raises(BadFile, match=r"it exists; expected a new file\. Poses are not appended"):
            write_pose_recording(path, log(), {})
        assert path.read_bytes() == before


def test_a_damaged_block_costs_its_rows_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    write_pose_recording(path, log(), {})
    data = bytearray(path.read_bytes())
    sizes = [len(encode_block(block)) for block in blocks(path)]
    data[16 + sum(sizes[:4])] ^= 1  # the third block of poses
    path.write_bytes(bytes(data))
    found = read_pose_recording(path)
    assert len(found.damage) == 1
    left = sum(len(body.times_s) for body in found.log.bodies)
    assert left == 2 * 10 * COUNT - 963
    path.write_bytes(bytes(data[: 16 + sum(sizes[:3]) + 9]))
    assert sum(len(body.times_s) for body in read_pose_recording(path).log.bodies) == 963


def test_a_log_whose_first_block_is_damaged_begins_later(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    write_pose_recording(path, log(), {}, [(20.0, "slow")])
    data = bytearray(path.read_bytes())
    sizes = [len(encode_block(block)) for block in blocks(path)]
    data[16 + sum(sizes[:2])] ^= 1
    path.write_bytes(bytes(data))
    found = read_pose_recording(path)
    begin_s = log().bodies[1].times_s[481]  # rows of both in turn: 963 of them are lost
    assert found.log.start_unix_s == pytest.approx(1.5e9 + begin_s)
    assert found.marks[0][0] == pytest.approx(20.0 - begin_s)


@pytest.mark.parametrize("lost", ["body", "pose"])
def test_without_names_or_poses_it_is_refused(lost: str, tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    write_pose_recording(path, log(), {})
    kept = b"".join(encode_block(block) for block in blocks(path) if block.kind != lost)
    path.write_bytes(POSES_HEADER + kept)
    with pytest.raises(BadFile, match="no poses"):
        read_pose_recording(path)


def test_rows_that_are_cut_in_a_sound_block_are_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "a.rec", POSES_HEADER + encode_block(RecordingBlock("pose", 0.0, 0.0, b"123")))
    with pytest.raises(BadFile, match="ends within a row"):
        read_pose_recording(path)


def test_a_recording_and_a_file_are_opened_alike(tmp_path: Path) -> None:
    text = write(tmp_path / "rig.csv", SAMPLES["own names"])
    first = open_poses([text])
    write_pose_recording(tmp_path / "a.rec", first.log, {})
    assert_equal(open_poses([tmp_path / "a.rec"]).log, first.log)
    assert (first.marks, first.plan) == ((), "")
    with pytest.raises(BadInput, match=r"a\.rec is a recording of poses\. Units"):
        open_poses([tmp_path / "a.rec"], PoseFileOptions(up="y"))
    assert open_poses([tmp_path / "a.rec"], PoseFileOptions(untimed=True)).log.duration_s == TIMES_S[-1]


def test_what_may_hold_poses(tmp_path: Path) -> None:
    write_pose_recording(tmp_path / "a.rec", log(), {})
    holds = {
        tmp_path / "a.rec": True,
        write(tmp_path / "b.csv", SAMPLES["own names"]): True,
        write(tmp_path / "c.txt", SAMPLES["utf-16"]): True,
        write_capture(tmp_path / "line.rec"): False,
        write(tmp_path / "d.rec", write_capture(tmp_path / "other.rec").read_bytes()[20:]): False,  # its header is lost
        write(tmp_path / "e.toml", "[motion]\nmotion = 'cmu'\n"): False,
        write(tmp_path / "f.bin", b"\0\1"): False,
        tmp_path: False,
        tmp_path / "none": False,
    }
    assert {path: is_pose_file(path) for path in holds} == holds
