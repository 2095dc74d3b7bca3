"""Pictures of the calibration poses."""

from pathlib import Path

import pytest
from PIL import Image

from harness.calibrate.poses import POSES
from harness.core.humanoid24 import standard_skeleton
from harness.errors import BadFile
from harness.live.viewer import SHEET_NAME, draw_poses

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
