"""The viewer in its own process: pictures of the newest pose, and clear errors where it cannot draw."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from harness.body import Kinematics, build_body, tpose
from harness.calibrate import POSES, GuidedPose, PerformerPose
from harness.core.humanoid24 import standard_skeleton
from harness.errors import BadFile, BadInput
from harness.live.pose_sheet import SHEET_NAME, draw_poses
from harness.live.viewer import ViewerOutput, _prepare_folder
from tests.live.posing import live_pose

pytest.importorskip("pyvista", reason="pyvista is not installed (extra `viz`)")
OWN = build_body().skeleton


def finished_pictures(folder: Path) -> list[Path]:
    """The pictures of a folder. One that the viewer was writing when it was killed has a temporary name."""
    return sorted(folder.glob("[0-9]*.png"))


def wait_for(pictures: int, folder: Path) -> list[Path]:
    until_s = time.monotonic() + 60.0
    while len(found := finished_pictures(folder)) < pictures and time.monotonic() < until_s:
        time.sleep(0.02)
    return found


def test_frames_show_the_newest_pose(tmp_path: Path) -> None:
    from matplotlib.image import imread

    shown, kinematics = (
        ViewerOutput("frames", OWN, tmp_path / "frames", force=False),
        Kinematics(build_body()),
    )
    try:
        qpos = np.array(tpose(OWN))
        shown.send(live_pose(qpos, 0))
        wait_for(1, tmp_path / "frames")
        qpos[7:] += 0.3
        for number in range(1, 2001):
            shown.send(live_pose(qpos, number, kinematics=kinematics))
        found = wait_for(2, tmp_path / "frames")
        shown._process.kill()
        with pytest.raises(OSError, match="ended"):
            shown.send(live_pose(qpos))
    finally:
        shown.close()
    found = finished_pictures(tmp_path / "frames")
    assert found[0].name == "00000000.png"
    assert len(found) < 500  # most poses were never drawn, and none was waited for
    first, last = imread(found[0]), imread(found[-1])
    assert first.shape[:2] == (640, 640)
    assert np.abs(first - last).mean() > 1e-3
    with pytest.raises(BadFile, match="pictures in it"):
        ViewerOutput("frames", OWN, tmp_path / "frames", force=False)


def test_pictures_of_others_are_left_alone(tmp_path: Path) -> None:
    mine = [tmp_path / name for name in ("holiday.png", "1234567.png", "00000000.jpg")]
    ours = [tmp_path / name for name in ("00000000.png", "00000012.png")]
    for path in (*mine, *ours):
        path.write_text("")
    with pytest.raises(BadFile, match="there are 2 pictures in it"):
        _prepare_folder(tmp_path, force=False)
    _prepare_folder(tmp_path, force=True)
    assert sorted(tmp_path.iterdir()) == sorted(mine)
    _prepare_folder(tmp_path, force=False)


def test_what_cannot_be_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadInput, match="needs a folder"):
        ViewerOutput("frames", OWN, force=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(BadInput, match="there is no screen"):
        ViewerOutput("window", OWN, force=False)


def test_the_performer_stands_beside_the_pose(tmp_path: Path) -> None:
    """One picture for each pose, which is replaced as the performer moves; both bodies and the meter are in it.

    The next pose is alone until the performer is known again.
    """
    from matplotlib.image import imread

    qpos = tpose(OWN)
    performer = PerformerPose(qpos, np.zeros(4))
    shown = ViewerOutput("frames", OWN, tmp_path, force=False)
    pictures = []
    try:
        for guided in (
            GuidedPose(1, qpos, None, "", 0.0, ""),
            GuidedPose(1, qpos, performer, "head", 0.0, ""),
            GuidedPose(1, qpos, performer, "head", 2.0, ""),
            GuidedPose(2, qpos, None, "", 0.0, ""),
            GuidedPose(2, qpos, performer, "head", 0.0, ""),
        ):
            before = tmp_path / f"{guided.number:08d}.png"
            stamp = before.stat().st_mtime_ns if before.exists() else 0
            shown.show(guided)
            deadline_s = time.monotonic() + 60.0
            while not before.exists() or before.stat().st_mtime_ns == stamp:
                assert time.monotonic() < deadline_s
                time.sleep(0.02)
            pictures.append(imread(before))
    finally:
        shown.close()
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["00000001.png", "00000002.png"]
    alone, pair, later, next_alone, next_pair = (picture.astype(float)[..., :3] for picture in pictures)
    coloured = [np.ptp(picture[:600], axis=2) > 60.0 * picture.max() / 255.0 for picture in (alone, pair)]
    blue = [picture[:600, :, 2] > picture[:600, :, 0] + 40.0 * picture.max() / 255.0 for picture in (alone, pair)]
    assert coloured[0].sum() > 5_000
    assert not blue[0].any()
    assert blue[1].sum() > 3_000
    assert np.flatnonzero(blue[1].any(axis=0)).mean() > 320.0
    assert np.abs(pair[:560] - later[:560]).max() < 0.02 * pair.max()
    assert np.abs(pair[580:] - later[580:]).max() > 0.3 * pair.max()
    assert np.abs(alone - next_alone).max() < 0.02 * alone.max()
    assert np.abs(pair - next_pair).max() < 0.02 * pair.max()


pytest.importorskip("pyvista", reason="pyvista is not installed (extra `viz`)")


def test_each_pose_and_all_on_a_sheet(tmp_path: Path) -> None:
    drawn = draw_poses(POSES[:2], standard_skeleton(), tmp_path, force=False)
    assert [path.name for path in drawn] == ["pose_1.png", "pose_2.png", SHEET_NAME]
    assert sorted(tmp_path.iterdir()) == drawn
    pictures = [Image.open(path).convert("RGB") for path in drawn]
    assert pictures[0].size == pictures[1].size == (640, 640)
    assert pictures[0].tobytes() != pictures[1].tobytes()
    assert pictures[2].size == (1280, 354)
    (tmp_path / "00000001.png").write_text("of a session")
    with pytest.raises(BadFile, match="there are 1 pictures in it"):
        draw_poses(POSES[:2], standard_skeleton(), tmp_path, force=False)
