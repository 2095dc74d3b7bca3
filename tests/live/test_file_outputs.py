"""Files of a live session: equal to those of an export, and complete at any moment."""

import csv
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from harness.body import Kinematics, build_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Status
from harness.core.humanoid24 import unpack
from harness.errors import BadFile
from harness.live.file_outputs import BvhOutput, PoseTableOutput
from harness.live.pose import LivePose
from harness.mocap import read_clip
from harness.mocap.write import PosedMotion, bvh_files
from tests.live.posing import configuration, frame, live_pose

RATE_HZ = 40.0
BODY = build_body()


def walked(rng: np.random.Generator, frames: int) -> Floats:
    """(F, 55) configurations with full rotations, so that angles wrap."""
    qpos = np.array([configuration(rng, 0.1) for _ in range(frames)])
    turns = np.cumsum(rng.normal(scale=0.4, size=(frames, 3)), axis=0)
    qpos[:, 3:7] = rotations.exp(turns)
    return qpos


def exported(qpos: Floats, frame_index: list[int]) -> str:
    """Text of the file that `harness export` writes for these frames."""
    _, world_from_root, angles_rad = unpack(qpos)
    kinematics = Kinematics(BODY)
    posed = [live_pose(row, kinematics=kinematics) for row in qpos]
    joints_m, bones = [], []
    for pose in posed:
        joints_m.append(pose.joints_m)
        bones.append(rotations.to_matrix(pose.bones[1]))
    index = np.array(frame_index)
    motion = PosedMotion(
        BODY.skeleton, RATE_HZ, index, index / RATE_HZ, world_from_root,
        angles_rad, np.array(joints_m), np.array(bones), {},
    )  # fmt: skip
    return bvh_files(motion)[".bvh"]


def written(path: Path, qpos: Floats, frame_index: list[int]) -> BvhOutput:
    """An open BVH output to which these frames were sent."""
    output, kinematics = BvhOutput(path, BODY.skeleton, RATE_HZ), Kinematics(BODY)
    for row, index in zip(qpos, frame_index, strict=True):
        at_s = index / RATE_HZ
        output.send(LivePose(index, frame(at_s), at_s, at_s, at_s, Estimate(row, Status.SOLVED), kinematics))
    return output


@pytest.mark.parametrize("frame_index", [list(range(12)), [0, 1, 2, 5, 6, 10, 11, 12, 13, 14, 15, 16]])
def test_a_live_bvh_is_an_exported_one(tmp_path: Path, rng: np.random.Generator, frame_index: list[int]) -> None:
    qpos = walked(rng, len(frame_index))
    written(tmp_path / "live.bvh", qpos, frame_index).close()
    live, export = (tmp_path / "live.bvh").read_text().split("\n"), exported(qpos, frame_index).split("\n")
    assert [line.split() for line in live[:-1] if "." not in line] == [x.split() for x in export[:-1] if "." not in x]
    first = export.index("MOTION") + 3
    assert [line.split() for line in live[:first]] == [line.split() for line in export[:first]]
    np.testing.assert_allclose(np.loadtxt(live[first:]), np.loadtxt(export[first:]), atol=2e-6)


def test_a_bvh_that_was_never_closed_keeps_its_frames(tmp_path: Path, rng: np.random.Generator) -> None:
    qpos = walked(rng, 100)
    output = written(tmp_path / "live.bvh", qpos, list(range(100)))
    lines = (tmp_path / "live.bvh").read_text().split("\n")
    (count,) = (int(line.split()[1]) for line in lines if line.startswith("Frames:"))
    assert count > 100 - RATE_HZ - 2  # it is saved every second
    assert len(lines) >= lines.index("MOTION") + 3 + count
    output.close()


KILLED = """
import os, sys
import numpy as np
from pathlib import Path
from tests.live.test_file_outputs import BODY, RATE_HZ, walked, written
written(Path(sys.argv[1]), walked(np.random.default_rng(1), 90), list(range(90)))
os.kill(os.getpid(), 9)
"""


@pytest.mark.long
def test_a_bvh_of_a_killed_process_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "live.bvh"
    done = subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False, capture_output=True)
    assert done.returncode == -9, done.stderr
    clip = read_clip(path)
    assert len(clip) > 90 - RATE_HZ - 2  # it is saved every second
    assert not any("killed" in note for note in clip.notes)
    lines = path.read_text().split("\n")
    assert lines[-1] == ""
    assert len(lines) == lines.index("MOTION") + 3 + len(clip) + 1


@pytest.mark.parametrize("cut", [0, 1, 40, 4000])
@pytest.mark.parametrize("announced", [1, 7, 12])
def test_a_bvh_whose_count_was_not_written_any_more_keeps_its_whole_frames(
    tmp_path: Path, rng: np.random.Generator, announced: int, cut: int
) -> None:
    path = tmp_path / "live.bvh"
    written(path, walked(rng, 12), list(range(12))).close()
    text = path.read_text().replace(f"Frames: {12:>10}", f"Frames: {announced:>10}")
    path.write_text(text[: len(text) - cut])
    whole = text[: len(text) - cut].count("\n") - text[: text.index("MOTION")].count("\n") - 3
    if whole < announced:
        with pytest.raises(BadFile):
            read_clip(path)
        return
    clip = read_clip(path)
    assert len(clip) == whole
    assert any(f"{announced} frames are announced, {whole} are whole" in note for note in clip.notes) == (
        whole > announced or (cut > 0 and whole == announced)
    )


def test_frames_beyond_the_count_of_any_other_bvh_are_refused(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "export.bvh"
    path.write_text(exported(walked(rng, 3), [0, 1, 2]).replace("Frames: 3", "Frames: 2"))
    with pytest.raises(BadFile, match="3 frames"):
        read_clip(path)


def test_a_file_ends_with_a_whole_line_between_two_saves(tmp_path: Path, rng: np.random.Generator) -> None:
    output, kinematics = PoseTableOutput(tmp_path / "poses.csv", BODY.skeleton, ("head",)), Kinematics(BODY)
    for n, row in enumerate(walked(rng, 60)):
        output.send(LivePose(n, frame(0.0), 0.0, 0.0, n / 40.0, Estimate(row, Status.SOLVED), kinematics))
        assert (tmp_path / "poses.csv").read_bytes().endswith(b"\n")
    output.close()
    assert (tmp_path / "poses.csv").read_text().count("\n") == 61


def test_a_long_break_is_one_frame(tmp_path: Path, rng: np.random.Generator) -> None:
    written(tmp_path / "live.bvh", walked(rng, 3), [0, 4000, 3]).close()
    assert "Frames:          3\n" in (tmp_path / "live.bvh").read_text()


def test_a_table_is_read_back_exactly(tmp_path: Path, rng: np.random.Generator) -> None:
    qpos, kinematics = walked(rng, 4), Kinematics(BODY)
    output = PoseTableOutput(tmp_path / "poses.csv", BODY.skeleton, ("head", "hand"))
    for n, row in enumerate(qpos):
        output.send(
            LivePose(n, frame(n / 3, n / 7), n / 3 + 0.1, n / 3 + 0.2, 0.0, Estimate(row, Status.HELD), kinematics)
        )
    output.close()
    with (tmp_path / "poses.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["frame"]) for row in rows] == [0, 1, 2, 3]
    assert {(row["status"], row["origin"]) for row in rows} == {("held", "model")}
    for n, row in enumerate(rows):
        assert (float(row["received_s"]), float(row["ready_s"])) == (n / 3, n / 3 + 0.2)
        assert float(row["device_s.hand"]) == n / 7
        np.testing.assert_array_equal([float(value) for value in list(row.values())[8:]], qpos[n])
    names = list(rows[0])[8:]
    for name in ("lradius.rx_rad", "lfemur.rz_rad"):
        joint = BODY.model.joint(name.removesuffix("_rad"))
        assert names.index(name) == int(joint.qposadr[0])


def test_nothing_is_written_over_unless_told(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "there"
    path.write_text("mine")
    for make in (lambda: BvhOutput(path, BODY.skeleton, RATE_HZ), lambda: PoseTableOutput(path, BODY.skeleton, ())):
        with pytest.raises(BadFile, match="it exists"):
            make()
    assert path.read_text() == "mine"
    output = PoseTableOutput(path, BODY.skeleton, ("a", "b"), force=True)
    output.send(live_pose(configuration(rng)))
    output.close()
    assert path.read_text().startswith("frame,status")
    with pytest.raises(BadFile, match="there is a file, not a folder"):
        PoseTableOutput(path / "below", BODY.skeleton, ())
    PoseTableOutput(tmp_path / "new" / "folder", BODY.skeleton, ()).close()
    assert (tmp_path / "new").is_dir()


def test_a_file_is_written_over_by_the_first_pose_not_before(tmp_path: Path, rng: np.random.Generator) -> None:
    path, link = tmp_path / "there", tmp_path / "link"
    link.symlink_to(path)
    for make in (
        lambda: BvhOutput(link, BODY.skeleton, RATE_HZ, force=True),
        lambda: PoseTableOutput(path, BODY.skeleton, ("a", "b"), force=True),
    ):
        path.write_text("mine")
        output = make()
        assert path.read_text() == "mine"
        output.close()
        assert path.read_text() == "mine"
        output = make()
        output.send(live_pose(configuration(rng)))
        first = path.read_text()
        assert len(first) > 500  # there already, however the program ends
        output.send(live_pose(configuration(rng), 1, 0.025))
        output.close()
        assert path.read_text().count("\n") == first.count("\n") + 1
        assert sorted(tmp_path.iterdir()) == [link, path]
    assert link.is_symlink()


def test_what_cannot_take_its_place_leaves_the_old_file(
    tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*paths: Path) -> None:
        raise PermissionError("not here")

    path = tmp_path / "there"
    path.write_text("mine")
    monkeypatch.setattr("os.replace", refused)
    for output in (
        BvhOutput(path, BODY.skeleton, RATE_HZ, force=True),
        PoseTableOutput(path, BODY.skeleton, ("a", "b"), force=True),
    ):
        with pytest.raises(PermissionError):
            output.send(live_pose(configuration(rng)))
        output.close()
        assert path.read_text() == "mine"
        assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(BadFile, match="it is not a file"):
        PoseTableOutput(tmp_path, BODY.skeleton, (), force=True)


def test_no_file_is_left_of_no_frame(tmp_path: Path) -> None:
    for output in (
        BvhOutput(tmp_path / "a.bvh", BODY.skeleton, RATE_HZ),
        PoseTableOutput(tmp_path / "a.csv", BODY.skeleton, ()),
    ):
        output.close()
        output.close()
    assert not list(tmp_path.iterdir())
