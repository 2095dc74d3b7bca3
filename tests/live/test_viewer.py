"""The viewer in its own process: pictures of the newest pose, and clear errors where it cannot draw."""

import sys
import time
from pathlib import Path

import numpy as np
import pytest

from harness.body import humanoid
from harness.body.kinematics import Kinematics
from harness.errors import BadFile, BadInput
from harness.live.viewer import ViewerOutput, _prepare_folder
from tests.live.posing import live_pose

pytest.importorskip("pyvista", reason="pyvista is not installed (extra `viz`)")
OWN = humanoid.build_body().skeleton


def wait_for(pictures: int, folder: Path) -> list[Path]:
    until_s = time.monotonic() + 60.0
    while len(found := sorted(folder.glob("*.png"))) < pictures and time.monotonic() < until_s:
        time.sleep(0.02)
    return found


def test_frames_show_the_newest_pose(tmp_path: Path) -> None:
    from matplotlib.image import imread

    shown, kinematics = (
        ViewerOutput("frames", OWN, tmp_path / "frames", force=False),
        Kinematics(humanoid.build_body()),
    )
    try:
        qpos = np.array(humanoid.tpose(OWN))
        shown.send(live_pose(qpos, 0))
        wait_for(1, tmp_path / "frames")
        qpos[7:] += 0.3
        for number in range(1, 2001):
            shown.send(live_pose(qpos, number, kinematics=kinematics))
        found = wait_for(2, tmp_path / "frames")
    finally:
        shown.close()
    found = sorted((tmp_path / "frames").glob("*.png"))
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


def test_a_dead_view_is_an_output_that_failed(tmp_path: Path) -> None:
    shown = ViewerOutput("frames", OWN, tmp_path, force=False)
    shown._process.kill()
    shown._process.join()
    with pytest.raises(OSError, match="ended"):
        shown.send(live_pose(humanoid.tpose(OWN)))
    shown.close()


def test_what_cannot_be_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(BadInput, match="needs a folder"):
        ViewerOutput("frames", OWN, force=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(BadInput, match="there is no screen"):
        ViewerOutput("window", OWN, force=False)
    (tmp_path / "file").write_text("")
    with pytest.raises(BadFile, match="cannot be created"):
        ViewerOutput("frames", OWN, tmp_path / "file", force=False)


def test_a_pose_is_shown_until_the_next(tmp_path: Path) -> None:
    shown = ViewerOutput("frames", OWN, tmp_path, force=False)
    try:
        for number in (1, 2):
            shown.show(number, np.array(humanoid.tpose(OWN)))
            until_s = time.monotonic() + 60.0
            while not (tmp_path / f"{number:08d}.png").exists() and time.monotonic() < until_s:
                time.sleep(0.02)
    finally:
        shown.close()
    assert [path.name for path in sorted(tmp_path.iterdir())] == ["00000001.png", "00000002.png"]
