"""The viewer's process: draws the newest pose of a live session until the session closes the pipe."""

import os
import sys
from pathlib import Path
from typing import Any

if sys.platform == "linux" and not os.environ.get("DISPLAY"):
    os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")  # read when pyvista is imported

import numpy as np
from PIL import Image

from harness.body import BodyMesh, RenderScene, tpose
from harness.core import humanoid24, rotations
from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.files import atomic_path
from harness.core.skeleton import Skeleton, forward_kinematics
from harness.live.shared_memory import BESIDE, CLOSED, CONFIGURATION, READY, STILL_SHARE, SharedPose, ViewerConfig

_COLOURS = {Status.SOLVED: "#e8850c", Status.HELD: "#a98a63", Status.LOST: "#9aa3ab"}
"""The fewer readings a pose rests on, the paler it is drawn."""
_SIZE = (640, 640)
_VIEW_ANGLE_DEG = 33.0
"""Wide enough for raised arms."""
_PAIR_VIEW_ANGLE_DEG, _BESIDE_M = 48.0, 1.7
"""View angle for two bodies side by side, and the distance between them [deg, m]."""
_BESIDE_COLOUR, _METER_COLOUR = "#2f7fb5", "#2b3138"
_METER = "meter"
"""Name of the meter's text in the plotter."""


class BodyRenderer:
    """One body on a floor, seen by a camera that follows it."""

    def __init__(self, skeleton: Skeleton, *, off_screen: bool) -> None:
        self._skeleton = skeleton
        self.scene = RenderScene(_SIZE, 0.0, off_screen=off_screen)
        self.scene.plotter.camera.view_angle = _VIEW_ANGLE_DEG
        self._mesh = BodyMesh(self.scene.plotter, skeleton, _COLOURS[Status.SOLVED], girth=1.0, opacity=1.0)
        self._beside: BodyMesh | None = None

    def pose(self, qpos: Floats, status: Status) -> None:
        """Move the body to a configuration (55,) and colour it by its status."""
        self._move(self._mesh, qpos)
        self._mesh.look.color = _COLOURS[status]
        self.scene.follow(qpos[:3])

    def pose_beside(self, qpos: Floats, other: Floats, still_share: float) -> None:
        """Draw a second body to the right of a configuration (55,), and a meter of stillness below both."""
        camera = self.scene.plotter.camera
        if self._beside is None:
            self._beside = BodyMesh(self.scene.plotter, self._skeleton, _BESIDE_COLOUR, girth=1.0, opacity=1.0)
        self._beside.set_visible(True)
        camera.view_angle = _PAIR_VIEW_ANGLE_DEG
        away = np.array(camera.position) - np.array(camera.focal_point)
        right = np.array([-away[1], away[0], 0.0]) / np.hypot(*away[:2])
        shifted = np.array(other)
        shifted[:3] += qpos[:3] * [1.0, 1.0, 0.0] - other[:3] * [1.0, 1.0, 0.0] + _BESIDE_M * right
        self._move(self._beside, shifted)
        self.scene.follow(qpos[:3] + 0.5 * _BESIDE_M * right)
        self.scene.plotter.add_text(
            f"left: the pose   right: you   still {100.0 * still_share:.0f} %",
            position="lower_edge",
            font_size=12,
            color=_METER_COLOUR,
            name=_METER,
        )

    def hide_beside(self) -> None:
        """Hide the second body and the meter, if there are any."""
        if self._beside is not None:
            self._beside.set_visible(False)
            self.scene.plotter.remove_actor(_METER, render=False)
            self.scene.plotter.camera.view_angle = _VIEW_ANGLE_DEG

    def _move(self, mesh: BodyMesh, qpos: Floats) -> None:
        root_m, quaternion, angles_rad = humanoid24.unpack(qpos[None])
        pose = forward_kinematics(self._skeleton, root_m, quaternion, angles_rad)
        mesh.move(root_m[0], rotations.to_matrix(quaternion[0]), pose.start_m[0], pose.world_from_bone[0])


def run_viewer(config: ViewerConfig, shared: SharedPose, pipe: Any) -> None:
    """Draw until the pipe closes. Sends READY after the first picture, and CLOSED when the user closes the window."""
    skeleton = humanoid24.standard_skeleton().with_bones(config.bone_m)
    viewer = BodyRenderer(skeleton, off_screen=config.kind == "frames")
    viewer.pose(tpose(skeleton), Status.SOLVED)
    if config.kind == "window":
        viewer.scene.plotter.show(interactive_update=True, auto_close=False, title="harness live")
    viewer.scene.picture()
    pipe.send(READY)
    drawn = b""
    while not pipe.poll(1.0 / config.rate_hz):  # a closed pipe is readable
        newest = shared.get()
        number, status = int(newest[0]), Status(int(newest[2]))
        if number >= 0 and newest.tobytes() != drawn:
            viewer.pose(newest[CONFIGURATION], status)
            if np.isfinite(newest[STILL_SHARE]) and np.isfinite(newest[BESIDE]).all():
                viewer.pose_beside(newest[CONFIGURATION], newest[BESIDE], float(newest[STILL_SHARE]))
            else:
                viewer.hide_beside()
            if config.kind == "frames":
                _save_picture(viewer.scene.picture(), Path(config.out) / f"{number:08d}.png")
            drawn = newest.tobytes()
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
