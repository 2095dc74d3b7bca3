"""The viewer's process: draws the newest pose of a live session until the session closes the pipe."""

import os
import sys
from pathlib import Path
from typing import Any

if sys.platform == "linux" and not os.environ.get("DISPLAY"):
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # read when pyvista is imported

import numpy as np
from PIL import Image

from harness.body.humanoid import tpose
from harness.body.rendering import BodyMesh, RenderScene
from harness.core import humanoid24, rotations
from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.files import atomic_path
from harness.core.skeleton import Skeleton, forward_kinematics
from harness.live.shared_pose import CLOSED, READY, SharedPose, ViewerConfig

_COLOURS = {Status.SOLVED: "#e8850c", Status.HELD: "#a98a63", Status.LOST: "#9aa3ab"}
"""The fewer readings a pose rests on, the paler it is drawn."""
_SIZE = (640, 640)
_VIEW_ANGLE_DEG = 33.0
"""Wide enough for raised arms."""


class BodyRenderer:
    """One body on a floor, seen by a camera that follows it."""

    def __init__(self, skeleton: Skeleton, *, off_screen: bool) -> None:
        self._skeleton = skeleton
        self.scene = RenderScene(_SIZE, 0.0, off_screen=off_screen)
        self.scene.plotter.camera.view_angle = _VIEW_ANGLE_DEG
        self._mesh = BodyMesh(self.scene.plotter, skeleton, _COLOURS[Status.SOLVED], girth=1.0, opacity=1.0)

    def pose(self, qpos: Floats, status: Status) -> None:
        """Move the body to a configuration (55,) and colour it by its status."""
        root_m, quaternion, angles_rad = humanoid24.unpack(qpos[None])
        pose = forward_kinematics(self._skeleton, root_m, quaternion, angles_rad)
        self._mesh.move(root_m[0], rotations.to_matrix(quaternion[0]), pose.start_m[0], pose.world_from_bone[0])
        self._mesh.look.color = _COLOURS[status]
        self.scene.follow(root_m[0])


def run_viewer(config: ViewerConfig, shared: SharedPose, pipe: Any) -> None:
    """Draw until the pipe closes. Sends READY after the first picture, and CLOSED when the user closes the window."""
    skeleton = humanoid24.standard_skeleton().with_bones(config.bone_m)
    viewer = BodyRenderer(skeleton, off_screen=config.kind == "frames")
    viewer.pose(tpose(skeleton), Status.SOLVED)
    if config.kind == "window":
        viewer.scene.plotter.show(interactive_update=True, auto_close=False, title="harness live")
    viewer.scene.picture()
    pipe.send(READY)
    drawn = -1
    while not pipe.poll(1.0 / config.rate_hz):  # a closed pipe is readable
        newest = shared.get()
        number, status = int(newest[0]), Status(int(newest[2]))
        if number != drawn:
            viewer.pose(newest[3:], status)
            if config.kind == "frames":
                _save_picture(viewer.scene.picture(), Path(config.out) / f"{number:08d}.png")
            drawn = number
        if config.kind == "window":
            viewer.scene.plotter.update()
            if viewer.scene.plotter.render_window is None or viewer.scene.plotter.iren.interactor.GetDone():
                pipe.send(CLOSED)
                break
    viewer.scene.close()


def _save_picture(picture: "np.ndarray[Any, Any]", path: Path) -> None:
    """Write a PNG under another name, then rename it, so that a reader never sees half a picture."""
    with atomic_path(path) as temporary:
        Image.fromarray(picture).save(temporary, format="png", compress_level=1)
