"""What the report's tests share: whether this machine can render, found out in a process that may crash."""

import os
import subprocess
import sys

import pytest

PROBE = "import pyvista as pv; p = pv.Plotter(off_screen=True); p.add_mesh(pv.Sphere()); p.show(); print('drawn')"


@pytest.fixture(scope="session")
def renders() -> None:
    """Skips where nothing can be rendered off-screen."""
    environment = dict(os.environ)
    if not environment.get("DISPLAY"):
        environment["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkEGLRenderWindow"
    done = subprocess.run(
        [sys.executable, "-c", PROBE], env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    if "drawn" not in done.stdout:
        pytest.skip(f"no off-screen rendering here (exit code {done.returncode})")
