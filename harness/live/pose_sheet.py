"""Pictures of the calibration poses as the viewer shows them, each in a file, and all on one sheet."""

import time
from collections.abc import Sequence
from pathlib import Path

from PIL import Image, ImageDraw, ImageFont

from harness.calibrate import CalibrationPose, pose_configuration
from harness.core.skeleton import Skeleton
from harness.errors import BadInput
from harness.live.viewer import ViewerOutput

SHEET_NAME = "poses.png"
_COLUMNS, _PIXELS, _MARGIN, _TEXT = 4, 320, 34, 15
_PAPER, _INK = "#f3f5f7", "#2b3138"
_DRAW_TIMEOUT_S = 60.0


def draw_poses(poses: Sequence[CalibrationPose], skeleton: Skeleton, folder: Path, *, force: bool) -> list[Path]:
    """Draw `pose_1.png` and so on, and the sheet `poses.png`; returns the paths.

    Raises BadFile for a folder with pictures of a viewer in it (unless `force`), BadInput where nothing can be drawn.
    """
    viewer = ViewerOutput("frames", skeleton, folder, force=force)
    try:
        drawn = []
        for number, pose in enumerate(poses, 1):
            viewer.show_pose(number, pose_configuration(pose, skeleton))
            picture, deadline_s = folder / f"{number:08d}.png", time.monotonic() + _DRAW_TIMEOUT_S
            while not picture.exists():
                if time.monotonic() > deadline_s:
                    raise BadInput(f"Pose {number} was not drawn.", "Check that this computer has OpenGL.")
                time.sleep(0.02)
            drawn.append(picture.replace(folder / f"pose_{number}.png"))
    finally:
        viewer.close()
    sheet = folder / SHEET_NAME
    _save_sheet(
        [(path, f"{n}  {pose.name}") for n, (path, pose) in enumerate(zip(drawn, poses, strict=True), 1)], sheet
    )
    return [*drawn, sheet]


def _save_sheet(pictures: Sequence[tuple[Path, str]], path: Path) -> None:
    """Save the pictures with their names below as rows of one picture."""
    rows = -(-len(pictures) // _COLUMNS)
    sheet = Image.new("RGB", (_COLUMNS * _PIXELS, rows * (_PIXELS + _MARGIN)), _PAPER)
    pen, font = ImageDraw.Draw(sheet), ImageFont.load_default(_TEXT)
    for index, (picture, name) in enumerate(pictures):
        x, y = _PIXELS * (index % _COLUMNS), (_PIXELS + _MARGIN) * (index // _COLUMNS)
        with Image.open(picture) as image:
            sheet.paste(image.convert("RGB").resize((_PIXELS, _PIXELS)), (x, y))
        pen.text((x + _PIXELS // 2, y + _PIXELS + _MARGIN // 2 - 4), name, fill=_INK, font=font, anchor="mm")
    sheet.quantize(128).save(path, optimize=True)  # 128 colours reduce the file to a third
