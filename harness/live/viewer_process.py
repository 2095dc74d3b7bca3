"""What the view's process does: draws the newest pose, again and again, until the other end is closed."""

import os
import sys
from pathlib import Path
from typing import Any

if sys.platform == "linux" and not os.environ.get("DISPLAY"):
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # looked at when pyvista is imported

import numpy as np
from PIL import Image

from harness.body.humanoid import tpose
from harness.body.rendering import BodyMesh, RenderScene
from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.files import atomic_path
from harness.core.skeleton import Skeleton
from harness.live.viewer import CLOSED, READY, SharedPose, ViewerConfig

_COLOURS = {Status.SOLVED: "#e8850c", Status.HELD: "#a98a63", Status.LOST: "#9aa3ab"}
"""Paler the less a pose rests on readings."""
_SIZE = (640, 640)
_VIEW_ANGLE_DEG = 33.0
"""Arms that are raised are in it too."""


class BodyRenderer:
    """One body on a stage."""

    def __init__(self, own: Skeleton, *, off_screen: bool) -> None:
        self._own = own
        self.stage = RenderScene(_SIZE, 0.0, off_screen=off_screen)
        self.stage.plotter.camera.view_angle = _VIEW_ANGLE_DEG
        self._figure = BodyMesh(self.stage.plotter, own, _COLOURS[Status.SOLVED], girth=1.0, opacity=1.0)

    def pose(self, qpos: Floats, status: Status) -> None:
        """Take up a configuration (55,)."""
        root_m, quaternion, angles_rad = humanoid24.unpack(qpos[None])
        at = skeleton.forward_kinematics(self._own, root_m, quaternion, angles_rad)
        root = rotations.to_matrix(quaternion[0])
        self._figure.move(root_m[0], root, at.start_m[0], at.world_from_bone[0])
        self._figure.look.color = _COLOURS[status]
        self.stage.follow(root_m[0])


def run_viewer(screen: ViewerConfig, shared: SharedPose, told: Any) -> None:
    """Tells READY after the first picture, and CLOSED when the user closes the window."""
    own = humanoid24.standard_skeleton().with_bones(screen.bone_m)
    viewer = BodyRenderer(own, off_screen=screen.kind == "frames")
    viewer.pose(tpose(own), Status.SOLVED)
    if screen.kind == "window":
        viewer.stage.plotter.show(interactive_update=True, auto_close=False, title="harness live")
    viewer.stage.picture()
    told.send(READY)
    drawn = -1
    while not told.poll(1.0 / screen.rate_hz):  # which it is at its end
        newest = shared.get()
        number, status = int(newest[0]), Status(int(newest[2]))
        if number != drawn:
            viewer.pose(newest[3:], status)
            if screen.kind == "frames":
                _save_picture(viewer.stage.picture(), Path(screen.out) / f"{number:08d}.png")
            drawn = number
        if screen.kind == "window":
            viewer.stage.plotter.update()
            if viewer.stage.plotter.render_window is None or viewer.stage.plotter.iren.interactor.GetDone():
                told.send(CLOSED)
                break
    viewer.stage.close()


def _save_picture(picture: "np.ndarray[Any, Any]", path: Path) -> None:
    """Write a picture atomically."""
    with atomic_path(path) as temporary:
        Image.fromarray(picture).save(temporary, format="png", compress_level=1)
