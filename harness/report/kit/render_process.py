"""Rendering in a process of its own: VTK without a working OpenGL may crash, and must not take the report with it."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.core.arrays import Floats
from harness.core.files import TEMPORARY
from harness.errors import MissingExtra

_STARTUP_TIMEOUT_S, _FRAME_TIMEOUT_S = 60.0, 2.0
"""Patience: until the first picture, and for every one [s]."""
_POLL_INTERVAL_S = 0.5

ProgressCallback = Callable[[str, int, int], None]
"""Called with what was done last, how many are finished and how many were planned."""


@dataclass(frozen=True, eq=False)
class RenderJob:
    """One strip of pictures, or one movie, of K frames."""

    output: Path
    bone_m: Floats
    """(B, 3) of the true body [m]."""
    estimate_bone_m: Floats
    """(B, 3) of the estimated one [m]."""
    truth_qpos: Floats
    """(K, 55)."""
    estimate_qpos: Floats
    """(K, 55)."""
    fps: float = 0.0
    """Of a movie; 0 makes a strip."""
    title: str = ""
    """Written into a movie."""


class RenderProcess:
    """Jobs being rendered while the caller does something else; `finish` waits."""

    def __init__(self, jobs: Sequence[RenderJob]) -> None:
        self._jobs = jobs
        self._reason = _missing_package(jobs)
        self._folder = TemporaryDirectory(prefix="harness-report-")
        self._process: subprocess.Popen[str] | None = None
        for job in jobs:
            job.output.unlink(missing_ok=True)
        if jobs and not self._reason:
            self._process = self._start()

    def finish(self, progress: ProgressCallback = lambda last, done, planned: None) -> str:
        """Wait for the pictures: those that could be made are there. Why others are missing, "" if none is.

        `progress` is told what was made last, how many are there and how many there shall be.
        """
        if self._process is not None:
            frames = sum(len(job.truth_qpos) for job in self._jobs)
            until_s = time.monotonic() + _STARTUP_TIMEOUT_S + _FRAME_TIMEOUT_S * frames
            said: str | None = None
            while said is None and time.monotonic() < until_s:
                try:
                    _, said = self._process.communicate(timeout=_POLL_INTERVAL_S)
                except subprocess.TimeoutExpired:
                    made = [job.output.name for job in self._jobs if job.output.exists()]
                    progress(made[-1] if made else "", len(made), len(self._jobs))
            if said is None:
                self._process.kill()
                self._process.communicate()
                self._reason = "the renderer did not finish in time"
            else:
                self._reason = "" if self._process.returncode == 0 else describe_exit(self._process.returncode, said)
        self.close()
        return self._reason

    def close(self) -> None:
        """End what still runs and remove its files."""
        if self._process is not None and self._process.poll() is None:
            self._process.kill()
            self._process.communicate()
        for job in self._jobs:
            for temporary in job.output.parent.glob(f"{TEMPORARY}*-{job.output.name}"):
                temporary.unlink(missing_ok=True)
        self._folder.cleanup()

    def _start(self) -> "subprocess.Popen[str]":
        files = []
        for n, job in enumerate(self._jobs):
            files.append(str(Path(self._folder.name) / f"{n}.npz"))
            np.savez(
                files[-1],
                bone_m=job.bone_m,
                estimate_bone_m=job.estimate_bone_m,
                truth_qpos=job.truth_qpos,
                estimate_qpos=job.estimate_qpos,
                fps=np.array(job.fps),
                title=np.array(job.title),
                output=np.array(str(job.output.resolve())),
            )
        return start_renderer("harness.report.kit.render_worker", files)


def start_renderer(module: str, arguments: Sequence[str]) -> "subprocess.Popen[str]":
    """A process that renders, where there is no screen too; what it says of its end goes to stderr."""
    environment = dict(os.environ)
    if sys.platform == "linux" and not environment.get("DISPLAY"):
        environment.setdefault("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    command, none = [sys.executable, "-m", module, *arguments], subprocess.DEVNULL
    return subprocess.Popen(command, env=environment, stdin=none, stdout=none, stderr=subprocess.PIPE, text=True)


def _missing_package(jobs: Sequence[RenderJob]) -> str:
    """Which package is not installed."""
    for package, needed in (("pyvista", bool(jobs)), ("imageio_ffmpeg", any(job.fps for job in jobs))):
        if needed and find_spec(package) is None:
            return str(MissingExtra("A rendered picture", package, "viz"))
    return ""


def describe_exit(code: int, said: str) -> str:
    """What ended the renderer, in one line."""
    if code < 0:
        name = signal.Signals(-code).name
        return f"the renderer was ended by {name}; does this machine have OpenGL (EGL) for off-screen pictures?"
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    return f"the renderer failed ({lines[-1] if lines else f'exit code {code}'})"
