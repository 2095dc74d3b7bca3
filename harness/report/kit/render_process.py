"""Rendering in a separate process, because VTK may crash without a working OpenGL."""

import os
import signal
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Self

import numpy as np

from harness.core.arrays import Floats
from harness.core.child_process import PythonProcess
from harness.core.files import TEMPORARY
from harness.core.progress import report_step
from harness.errors import MissingExtra

_STARTUP_TIMEOUT_S, _FRAME_TIMEOUT_S = 60.0, 2.0
"""Time allowed for the start, and for each picture [s]."""
_OPENGL_VARIABLES = (
    *("DISPLAY", "EGL_PLATFORM", "GALLIUM_DRIVER", "LIBGL_DRIVERS_PATH", "MESA_LOADER_DRIVER_OVERRIDE"),
    *("VTK_DEFAULT_OPENGL_WINDOW", "__EGL_VENDOR_LIBRARY_FILENAMES"),
)
"""Environment variables that decide how VTK finds OpenGL."""


@dataclass(frozen=True, eq=False)
class RenderJob:
    """A strip of K pictures to render."""

    output: Path
    bone_m: Floats
    """(B, 3) bone vectors of the true body [m]."""
    estimate_bone_m: Floats
    """(B, 3) bone vectors of the estimated body [m]."""
    truth_qpos: Floats
    """(K, 55) true configurations."""
    estimate_qpos: Floats
    """(K, 55) estimated configurations."""
    size: tuple[int, int] = (300, 384)
    """Width and height of each picture [px]."""


class RenderProcess:
    """Renders jobs in the background; a context manager, which starts and ends the process. `finish` waits for it."""

    def __init__(self, jobs: Sequence[RenderJob]) -> None:
        self._jobs = jobs
        self._reason = _missing_package(jobs)
        self._process: PythonProcess | None = None

    def __enter__(self) -> Self:
        self._folder = TemporaryDirectory(prefix="harness-report-")
        for job in self._jobs:
            job.output.unlink(missing_ok=True)
        if self._jobs and not self._reason:
            self._process = self._start()
        return self

    def __exit__(self, *raised: object) -> None:
        self._close()

    def finish(self) -> str:
        """Wait for the renderer; returns the reason why pictures are missing, "" if none is.

        Pictures that were finished before a failure are kept.
        """
        if self._process is not None:
            report_step("rendered pictures")
            frames = sum(len(job.truth_qpos) for job in self._jobs)
            self._reason = finish_renderer(self._process, _STARTUP_TIMEOUT_S + _FRAME_TIMEOUT_S * frames)
        return self._reason

    def _close(self) -> None:
        """Kill a renderer that still runs, and remove unfinished and temporary files."""
        if self._process is not None:
            self._process.close()
        for job in self._jobs:
            for temporary in job.output.parent.glob(f"{TEMPORARY}*-{job.output.name}"):
                temporary.unlink(missing_ok=True)
        self._folder.cleanup()

    def _start(self) -> PythonProcess:
        files = []
        for n, job in enumerate(self._jobs):
            files.append(str(Path(self._folder.name) / f"{n}.npz"))
            np.savez(
                files[-1],
                bone_m=job.bone_m,
                estimate_bone_m=job.estimate_bone_m,
                truth_qpos=job.truth_qpos,
                estimate_qpos=job.estimate_qpos,
                size=np.array(job.size),
                output=np.array(str(job.output.resolve())),
            )
        return start_renderer("harness.report.kit.render_worker", files)


def start_renderer(module: str, arguments: Sequence[str]) -> PythonProcess:
    """Start a rendering module with arguments; it works without a screen and writes errors to stderr."""
    variable, environment = "VTK_DEFAULT_OPENGL_WINDOW", dict[str, str]()
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        environment[variable] = os.environ.get(variable, "vtkEGLRenderWindow")
    return PythonProcess(module, *arguments, env=environment)


def finish_renderer(process: PythonProcess, limit_s: float, look: Callable[[], object] = lambda: None) -> str:
    """Wait for a renderer; returns the reason why it failed, "" if it did not. `look` is called meanwhile."""
    ended = process.finish(limit_s, look)
    if ended is None:
        return "the renderer did not finish in time"
    return describe_exit(process.returncode, ended[1]) if process.returncode else ""


def _missing_package(jobs: Sequence[RenderJob]) -> str:
    """Message that names the package which the jobs need, if it is not installed; or ""."""
    missing = jobs and find_spec("pyvista") is None
    return str(MissingExtra("A rendered picture", "pyvista", "viz")) if missing else ""


def describe_exit(code: int, stderr: str) -> str:
    """Why the renderer ended, in one line: the signal, or the last line of its stderr, and settings of OpenGL."""
    settings = " and ".join(f"{name}={os.environ[name]}" for name in _OPENGL_VARIABLES if os.environ.get(name))
    where = f" where {settings} is set" if settings else ""
    if code < 0:
        name = signal.Signals(-code).name
        return (
            f"the renderer was killed by {name}{where}; does this machine have OpenGL (EGL) for off-screen rendering?"
        )
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    return f"the renderer failed{where} ({lines[-1] if lines else f'exit code {code}'})"
