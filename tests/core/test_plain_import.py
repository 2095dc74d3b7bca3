"""Files of the working folder and the environment do not change the libraries that the harness imports."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from harness.core.package_data import PACKAGE_FOLDER
from harness.core.plain_import import WORKING_FOLDER_FILES, plain_import

PLAIN = {"mink", "mujoco", "numba", "pyvista"}
"""Libraries that are imported with the modules that need them; matplotlib is imported while a chart is drawn."""
DRAW = """
import json
from harness.report.kit.chart import draw_chart
chart = draw_chart("name", "title", "caption", "alt", lambda figure: figure.subplots().set_xlabel("a_b$"), 3.0)
import matplotlib, os
import harness.body.humanoid  # MuJoCo
import harness.core.compiled  # numba
from numba.core import config
print(json.dumps([matplotlib.rcParams["text.usetex"], config.NUMBA_DEFAULT_NUM_THREADS > 0, config.DISABLE_JIT,
                  os.environ.get("MUJOCO_GL")]))
"""


@pytest.mark.long
@pytest.mark.parametrize("renderer", ["osmesa", "foo"])
def test_settings_do_not_reach_the_libraries(tmp_path: Path, renderer: str) -> None:
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
    (tmp_path / ".numba_config.yaml").write_text("disable_jit: 1\n")
    environment = {
        **os.environ,
        "MUJOCO_GL": renderer,
        "MPLBACKEND": "garbage",
        "PYTHONPATH": str(PACKAGE_FOLDER.parent),
    }
    done = subprocess.run(
        [sys.executable, "-P", "-c", DRAW], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.stdout.strip() == f'[false, true, 0, "{renderer}"]', done.stderr


def test_the_environment_is_as_before_afterwards(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.delenv("MATPLOTLIBRC", raising=False)
    monkeypatch.chdir(tmp_path)
    for name in WORKING_FOLDER_FILES:
        (tmp_path / name).touch()
    with plain_import():
        assert os.environ["MUJOCO_GL"] == "disable"
        assert not any(map(os.path.exists, WORKING_FOLDER_FILES))
        assert os.path.exists(tmp_path)
    assert os.environ["MUJOCO_GL"] == "egl"
    assert "MATPLOTLIBRC" not in os.environ
    assert all(map(os.path.exists, WORKING_FOLDER_FILES))


def test_every_module_imports_these_libraries_plainly() -> None:
    for file in PACKAGE_FOLDER.rglob("*.py"):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        blocks = [
            node for node in ast.walk(tree) if isinstance(node, ast.With) and "plain_import()" in ast.unparse(node)
        ]
        plain = {statement for block in blocks for statement in ast.walk(block)}
        for node in ast.walk(tree):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            if {name.partition(".")[0] for name in names} & PLAIN:
                assert node in plain, f"{file}: {ast.unparse(node)}"
