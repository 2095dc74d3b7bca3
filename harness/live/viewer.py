"""The 3-D viewer of a live session: a process of its own that draws the newest pose.

The session never waits for the viewer. It writes each pose to shared memory; the viewer draws the newest pose when it
is ready for one and skips the others. If OpenGL is missing or crashes, only the viewer's process ends.
"""

import os
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from harness.calibrate import GuidedPose
from harness.core.arrays import Floats
from harness.core.child_process import SPAWN, FunctionProcess
from harness.core.interrupts import shield_children
from harness.core.skeleton import Skeleton
from harness.errors import BadFile, BadInput, MissingExtra
from harness.live.pose import LivePose
from harness.live.shared_memory import READY, SharedPose, ViewerConfig, ViewerKind, first_message

_PICTURE_PATTERN = "[0-9]" * 8 + ".png"
"""Names that `viewer_process` gives its pictures; other files in the folder are left alone."""
_END_TIMEOUT_S = 2.0
_RATE_HZ: dict[ViewerKind, float] = {"window": 30.0, "frames": 4.0}
"""Most pictures per second."""


class ViewerOutput:
    """An `Output` that shows poses in a window, or writes pictures to a folder."""

    def __init__(self, kind: ViewerKind, skeleton: Skeleton, out: Path | None = None, *, force: bool) -> None:
        """Start the viewer and wait until it has drawn the T-pose.

        `out` is the folder of the pictures; `force` allows to replace the pictures of another session in it. Raises
        BadInput when nothing can be drawn, BadFile for a folder that cannot be used, MissingExtra without pyvista.
        """
        self.name = f"--view {kind}"
        self.description = f"view: {'a window' if kind == 'window' else f'pictures in {out}'}"
        if find_spec("pyvista") is None:
            raise MissingExtra(self.name, "pyvista", "viz")
        screenless = sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
        if kind == "window" and screenless:
            raise BadInput("--view window: there is no screen (DISPLAY is not set).", "Use --view frames --out DIR.")
        if kind == "frames":
            _prepare_folder(out, force)
        config = ViewerConfig(kind, skeleton.bone_m, str(out or ""), _RATE_HZ[kind])
        with shield_children():  # a signal ends the session, and the session ends the viewer
            self._shared = SharedPose(SPAWN)
            self._process = FunctionProcess(_run_viewer_process, config, self._shared)
        try:
            message = first_message(self._process)
        except BaseException:
            self.close()
            raise
        if message != READY:
            self.close()
            advice = "Check that this computer has OpenGL, or leave the option out."
            raise BadInput(f"{self.name} cannot be drawn: {message}.", advice)

    def send(self, pose: LivePose) -> None:
        """Show a pose; OSError when the viewer's process has ended."""
        self._require_process()
        self._shared.put(pose)

    def show_pose(self, number: int, qpos: Floats) -> None:
        """Show a configuration (55,) until the next one; OSError when the viewer's process has ended."""
        self._require_process()
        self._shared.set(number, qpos)

    def show(self, guided: GuidedPose) -> None:
        """Show the wanted pose, the performer beside it, and a meter of stillness; OSError as `show_pose`.

        A viewer that writes pictures replaces that of the pose.
        """
        self._require_process()
        beside = None if guided.performer is None else guided.performer.qpos
        self._shared.set(guided.number, guided.target, beside, guided.still_share)

    def _require_process(self) -> None:
        try:
            message = str(self._process.receive(0.0))
        except TimeoutError:
            return
        except EOFError:
            message = "its process ended"
        raise OSError(message)

    def close(self) -> None:
        self._process.close(_END_TIMEOUT_S)


def _prepare_folder(out: Path | None, force: bool) -> None:
    """Make the folder; remove the pictures of another session if `force`, else raise BadFile when there are any."""
    if out is None:
        raise BadInput("--view frames needs a folder.", "Name one with --out DIR.")
    out.mkdir(parents=True, exist_ok=True)
    old = sorted(out.glob(_PICTURE_PATTERN))
    if old and not force:
        advice = "Name another folder, or use --force."
        raise BadFile(out, f"there are {len(old)} pictures in it", "a folder without pictures", advice)
    for picture in old:
        picture.unlink()


def _run_viewer_process(pipe: Any, config: ViewerConfig, shared: SharedPose) -> None:
    """Entry point of the viewer's process, which runs at low priority. It reports its errors through the pipe."""
    if hasattr(os, "nice"):
        os.nice(10)
    os.environ["LP_NUM_THREADS"] = "1"  # without a GPU, Mesa draws with as many threads as there are cores
    try:
        from harness.live.viewer_process import run_viewer

        run_viewer(config, shared, pipe)
    except Exception as error:  # the session's process reports it to the user
        with suppress(OSError):  # the session has been killed
            pipe.send(f"{type(error).__name__}: {error}")
