"""The body in three dimensions as it moves: in a process of its own, which shows the newest pose when it is ready to.

Nothing here waits for it. A pose lies in memory that both processes share; while the other one looks, the next poses
go by. OpenGL that is missing or broken may end that process, not this one.
"""

import os
import sys
from dataclasses import dataclass
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Literal

import numpy as np

from harness.core.arrays import Floats
from harness.core.estimate import Status
from harness.core.skeleton import Skeleton
from harness.core.workers import ignore_sigint
from harness.errors import BadFile, BadInput, MissingExtra
from harness.live.pose import LivePose

ViewerKind = Literal["window", "frames"]
_PICTURE_PATTERN = "[0-9]" * 8 + ".png"
"""As `screen` names them; whatever else a folder holds is not ours."""
READY, CLOSED = "ready", "its window was closed"
"""What the other process says."""
_START_TIMEOUT_S, _END_TIMEOUT_S = 60.0, 10.0
_RECORD_SIZE = 3 + 55
_RATE_HZ: dict[ViewerKind, float] = {"window": 30.0, "frames": 4.0}
"""Pictures per second at most."""


@dataclass(frozen=True)
class ViewerConfig:
    """What the other process is to show, and where."""

    kind: ViewerKind
    bone_m: Floats
    """(B, 3) of the body [m]."""
    out: str
    """Folder of the frames."""
    rate_hz: float
    """Pictures per second at most."""


class SharedPose:
    """The newest pose, in memory that two processes share: its number, time [s] and status, then `qpos`."""

    def __init__(self, context: Any) -> None:
        self._lock = context.Lock()
        self._memory = context.RawArray("d", _RECORD_SIZE)
        self._memory[0] = -1.0

    def put(self, pose: LivePose) -> None:
        """Unless the other process is looking at this very moment."""
        if self._lock.acquire(block=False):
            try:
                self._fill(pose.number, pose.measured_s, pose.estimate.status, pose.estimate.qpos)
            finally:
                self._lock.release()

    def set(self, number: int, qpos: Floats) -> None:
        """A pose of no time, as soon as nobody is looking."""
        with self._lock:
            self._fill(number, 0.0, Status.SOLVED, qpos)

    def _fill(self, number: int, at_s: float, status: Status, qpos: Floats) -> None:
        self._memory[:3] = [number, at_s, status]
        self._memory[3:] = qpos

    def get(self) -> Floats:
        """(3 + 55,) as above; the number is -1 before the first."""
        with self._lock:
            return np.array(self._memory)


class ViewerOutput:
    """An `Output`: a window, or pictures in a folder."""

    def __init__(self, kind: ViewerKind, own: Skeleton, out: Path | None = None, *, force: bool) -> None:
        """Returns when a first picture, of the T-pose, was drawn; BadInput, BadFile, MissingExtra when it cannot be."""
        self.name, self.description = (
            f"--view {kind}",
            f"view: {'a window' if kind == 'window' else f'pictures in {out}'}",
        )
        if find_spec("pyvista") is None:
            raise MissingExtra(self.name, "pyvista", "viz")
        screenless = sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
        if kind == "window" and screenless:
            raise BadInput("--view window: there is no screen (DISPLAY is not set).", "Take --view frames --out DIR.")
        if kind == "frames":
            _prepare_folder(out, force)
        context = get_context("spawn")
        self._shared = SharedPose(context)
        self._ours, theirs = context.Pipe()
        screen = ViewerConfig(kind, own.bone_m, str(out or ""), _RATE_HZ[kind])
        self._process = context.Process(
            target=_run_viewer_process, args=(screen, self._shared, theirs), name="view", daemon=True
        )
        with ignore_sigint():  # it ends with us, not beside us
            self._process.start()
        theirs.close()
        try:
            said = self._ours.recv() if self._ours.poll(_START_TIMEOUT_S) else "it does not answer"
        except EOFError:
            self._process.join(_END_TIMEOUT_S)
            said = f"its process ended with {self._process.exitcode}"
        if said != READY:
            self.close()
            raise BadInput(f"{self.name} cannot be drawn: {said}.", "Does this computer have OpenGL? Leave it out.")

    def send(self, pose: LivePose) -> None:
        """OSError when the process is gone."""
        self._require_process()
        self._shared.put(pose)

    def show(self, number: int, qpos: Floats) -> None:
        """A configuration (55,) to look at until the next one; OSError as `send`."""
        self._require_process()
        self._shared.set(number, qpos)

    def _require_process(self) -> None:
        if self._ours.poll():
            try:
                said = str(self._ours.recv())
            except EOFError:
                said = "its process ended"
            raise OSError(said)

    def close(self) -> None:
        self._ours.close()
        self._process.join(_END_TIMEOUT_S)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()


def _prepare_folder(out: Path | None, force: bool) -> None:
    """The folder is there, and has no pictures of another session."""
    if out is None:
        raise BadInput("--view frames needs a folder.", "Name one with --out DIR.")
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadFile(out, f"it cannot be made ({error.strerror})", "a folder", "Name another.") from error
    old = sorted(out.glob(_PICTURE_PATTERN))
    if old and not force:
        raise BadFile(out, f"there are {len(old)} pictures in it", "a folder without", "Name another, or say --force.")
    for picture in old:
        picture.unlink()


def _run_viewer_process(screen: ViewerConfig, shared: SharedPose, told: Any) -> None:
    """The other process; it takes what the computer has left over."""
    if hasattr(os, "nice"):
        os.nice(10)
    os.environ["LP_NUM_THREADS"] = "1"  # Mesa draws by as many threads as there are cores where there is no GPU
    try:
        from harness.live.viewer_process import run_viewer

        run_viewer(screen, shared, told)
    except Exception as error:  # whoever started us tells the user
        told.send(f"{type(error).__name__}: {error}")
