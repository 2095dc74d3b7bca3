"""Nothing of the working folder is run but the method that a command names and what that imports from beside itself.

Files of settings in the working folder and the environment do not change the libraries that the harness imports.
"""

import ast
import os
import re
import shutil
import subprocess
import sys
from ast import literal_eval
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from harness.core.package_data import PACKAGE_FOLDER
from harness.core.working_folder import (
    WORKING_FOLDER_FILES,
    FolderFinder,
    name_module,
    plain_import,
    python_command,
    python_environment,
    safe_import_path,
    serve_folder,
    served_folders,
)
from tests.fuzz.kinds import KINDS
from tests.testing import upright

CHILD_TRAPS = ("ezc3d", "numpy", "runpy", "pickle", "multiprocessing", "pyvista", "distributed", "ctypes")
"""Modules that the processes of the harness import."""
TRAPS = (
    *("IPython", "PyQt5", "_winapi", "bottleneck", "cffi", "colorama", "coverage", "cvista", "cython", "docutils"),
    *("envwrap", "ipywidgets", "lxml", "nt", "numexpr", "org", "orjson", "paramiko", "psutil", "scikits", "simplejson"),
    *("sksparse", "tornado", "torch", "uarray", "ujson", "winreg", "xxhash", "yaml", *CHILD_TRAPS),
)
"""Modules that libraries import where they exist, as a trace of `list`, `run`, `check` and `plot` shows, and others."""
PLAIN = ("mink", "mujoco", "numba", "pyvista")
"""Libraries that are imported with the modules that need them; matplotlib is imported while a chart is drawn."""
SCENARIO = """
schema = 1
methods = ["mine:Mine"]
noise = "clean"
[motion]
source = "builtin"
body = "common"
longest_s = 1.5
behaviours = ["walking"]
test = ["walking_p1_01"]
[stations]
head = { bone = "head", along = 1.0 }
"""
METHOD = """
import beside
from package.part import PART
from upright import Upright

class Mine(Upright):
    def fit(self, body, examples, rng):
        import later
        return super().fit(body, examples, rng)
"""
POOL = """
import sys
from harness.core.workers import run_in_workers
from harness.experiment.workers import executors
def paths():
    return sys.path
if __name__ == "__main__":
    for _, future in run_in_workers(paths, [()], 1):
        print(future.result())
    if sys.argv[1:]:
        with executors.dask_executor("local", 1) as executor:
            for _, future in executor(paths, [()]):
                print(future.result())
"""
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


@pytest.fixture
def trap_folder(tmp_path: Path) -> Path:
    """A working folder with a method, its helpers, and traps; each module leaves a file when it is imported."""
    folder = tmp_path / "here"
    (folder / "package").mkdir(parents=True)
    (folder / "mine.py").write_text(METHOD)
    (folder / "upright.py").write_text(Path(upright.__file__).read_text())
    for name in ("beside", "later", "package/part", "package/__init__", *TRAPS):
        text = f"PART = open({str(tmp_path / name.replace('/', '.'))!r} + '.ran', 'w')\n"
        (folder / f"{name}.py").write_text(text + ("" if name.split("/")[0] in METHOD else "raise SystemExit(9)\n"))
    (folder / "small.toml").write_text(SCENARIO)
    (folder / "matplotlibrc").write_text("text.usetex: True\n")
    (folder / ".numba_config.yaml").write_text("disable_jit: 1\n")
    return folder


def run_python(folder: Path, *words: str, code: int = 0, **environment: str) -> str:
    """What a Python that starts in a folder prints; without the user's own settings of Python."""
    inherited = {name: value for name, value in os.environ.items() if name not in ("PYTHONSAFEPATH", "PYTHONPATH")}
    options = {**inherited, "PYTHONPATH": str(PACKAGE_FOLDER.parent), **environment}
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, env=options, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == code, done.stderr
    return done.stdout


def modules_that_ran(folder: Path) -> set[str]:
    return {file.stem for file in folder.parent.glob("*.ran")}


def test_the_traps_work(trap_folder: Path) -> None:
    run_python(trap_folder, "-m", "numpy", code=9)
    assert modules_that_ran(trap_folder)


@pytest.mark.long
@pytest.mark.parametrize("pythonpath", [str(PACKAGE_FOLDER.parent), f"{PACKAGE_FOLDER.parent}:"])
def test_a_list_runs_nothing(trap_folder: Path, pythonpath: str) -> None:
    """Nor with an empty entry of PYTHONPATH, which names the working folder."""
    if pythonpath.endswith(":"):
        for name in ("_winapi", "nt", "org"):  # Python imports them before the program can take the folder off the path
            (trap_folder / f"{name}.py").unlink()
    run_python(trap_folder, "-m", "harness", "list", PYTHONPATH=pythonpath)
    assert modules_that_ran(trap_folder) == set()


@pytest.mark.long
def test_a_run_runs_the_method_and_its_helpers(trap_folder: Path) -> None:
    """Also in the process of the method; the page is drawn although a matplotlibrc asks for LaTeX."""
    run_python(trap_folder, "-m", "harness", "run", "small.toml", "--jobs", "2", "--out", "out")
    assert modules_that_ran(trap_folder) == {"beside", "later", "package.part", "package.__init__"}
    assert list((trap_folder / "out" / "plots").glob("*.svg"))


@pytest.mark.long
def test_the_installed_command_reads_a_c3d_file_beside_modules_of_the_working_folder(trap_folder: Path) -> None:
    """The first import path of the command is the folder of its script."""
    script = trap_folder.parent / "harness_command.py"
    script.write_text("import sys\nfrom harness.cli import main\nsys.exit(main())\n")
    KINDS["c3d"].make(trap_folder)
    assert "c3d" in run_python(trap_folder, str(script), "inspect", "91_01.c3d")
    assert modules_that_ran(trap_folder) == set()


@pytest.mark.long
def test_workers_do_not_import_from_the_working_folder(trap_folder: Path) -> None:
    """Those of Dask, which needs the extra cluster, have a path of their own."""
    program = trap_folder.parent / "program.py"
    program.write_text(POOL)
    words = [] if find_spec("distributed") is None else ["dask"]
    paths = [literal_eval(line) for line in run_python(trap_folder, str(program), *words).splitlines()]
    assert len(paths) == 1 + len(words)
    assert all(str(trap_folder) not in path for path in paths)
    assert modules_that_ran(trap_folder) == set()


@pytest.mark.long
def test_libraries_that_start_python_do_not_either(trap_folder: Path) -> None:
    program = trap_folder.parent / "program.py"
    program.write_text("from harness.cli import main\nmain(['list'])\nimport mujoco")
    run_python(trap_folder, str(program))
    assert modules_that_ran(trap_folder) == set()


def test_other_children_do_not_either(trap_folder: Path) -> None:
    code = (
        "import subprocess; from harness.core.working_folder import *\n"
        "subprocess.run(python_command('-c', 'import numpy, pickle'), env=python_environment(), check=True)"
    )
    run_python(trap_folder, "-P", "-c", code)
    assert modules_that_ran(trap_folder) == set()


def test_a_checkout_that_is_the_working_folder_still_runs(tmp_path: Path) -> None:
    shutil.copytree(PACKAGE_FOLDER, tmp_path / "harness", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("models", "scenarios"):
        (tmp_path / name).symlink_to(PACKAGE_FOLDER.parent / name)
    (tmp_path / "numbers.py").write_text("raise SystemExit('numbers of the working folder')")
    run_python(tmp_path, "-m", "harness", "--version", PYTHONPATH="")
    ours = subprocess.run(
        python_command("-c", "import harness; print(harness.__file__)"),
        cwd=tmp_path, env=python_environment(), capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert ours.stdout.strip() == str(PACKAGE_FOLDER / "__init__.py")


def test_relative_folders_of_pythonpath_are_left_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", ".", "lib", str(tmp_path)]))
    folders = python_environment()["PYTHONPATH"].split(os.pathsep)
    assert folders[0] == str(tmp_path)
    assert all(map(os.path.isabs, folders))
    assert python_command("-m", "x") == [sys.executable, "-P", "-m", "x"]


@pytest.mark.parametrize("before", [None, "0"])
def test_the_import_path_is_as_before_afterwards(monkeypatch: pytest.MonkeyPatch, before: str | None) -> None:
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    if before is not None:
        monkeypatch.setenv("PYTHONSAFEPATH", before)
    with safe_import_path():
        assert os.environ["PYTHONSAFEPATH"] == "1"
    assert os.environ.get("PYTHONSAFEPATH") == before


@pytest.fixture
def served(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A served folder; what is imported from it is forgotten after the test."""
    monkeypatch.setattr(sys, "meta_path", [f for f in sys.meta_path if not isinstance(f, FolderFinder)])
    before = set(sys.modules)
    serve_folder(str(tmp_path))
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


def test_only_named_modules_are_found_from_outside(served: Path) -> None:
    (served / "strange_helper.py").write_text("")
    (served / "strange_method.py").write_text("import importlib\nimportlib.import_module('strange_helper')\n")
    assert find_spec("strange_helper") is None
    assert find_spec("strange_method") is None
    name_module("strange_method.inner")
    import_module("strange_method")
    assert "strange_helper" in sys.modules


def test_libraries_below_the_folder_do_not_find_its_modules(served: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An environment in the project's folder, as `.venv`."""
    site = served / ".venv" / "lib" / "site-packages"
    site.mkdir(parents=True)
    (site / "strange_library.py").write_text("try:\n    import strange_option\nexcept ImportError:\n    pass\n")
    (served / "strange_option.py").write_text("")
    monkeypatch.syspath_prepend(str(site))
    import_module("strange_library")
    assert "strange_option" not in sys.modules


def test_installed_modules_come_first(served: Path) -> None:
    (served / "numpy.py").write_text("raise SystemExit(9)")
    name_module("numpy")
    found = find_spec("numpy.linalg")
    assert found is not None
    assert served not in Path(str(found.origin)).parents


def test_a_folder_is_served_once_with_all_names(served: Path) -> None:
    name_module("one")
    serve_folder(str(served), ["two"])
    assert served_folders() == {str(served): ["one", "two"]}


@pytest.mark.long
def test_settings_do_not_reach_the_libraries(trap_folder: Path) -> None:
    """A name of no renderer would end the import of MuJoCo."""
    printed = run_python(trap_folder, "-P", "-c", DRAW, MUJOCO_GL="foo", MPLBACKEND="garbage")
    assert printed.strip() == '[false, true, 0, "foo"]'


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
    importing = re.compile(rf"^\s*(import|from) ({'|'.join(PLAIN)})\b", re.MULTILINE)
    files = [file for file in PACKAGE_FOLDER.rglob("*.py") if importing.search(file.read_text(encoding="utf-8"))]
    assert len(files) >= len(PLAIN)
    for file in files:
        tree = ast.parse(file.read_text(encoding="utf-8"))
        blocks = [
            node for node in ast.walk(tree) if isinstance(node, ast.With) and "plain_import()" in ast.unparse(node)
        ]
        plain = {statement for block in blocks for statement in ast.walk(block)}
        for node in ast.walk(tree):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [str(node.module)] if isinstance(node, ast.ImportFrom) else []
            if {name.partition(".")[0] for name in names} & {*PLAIN}:
                assert node in plain, f"{file}: {ast.unparse(node)}"
