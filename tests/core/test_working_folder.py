"""Nothing of the working folder is run but the method that a command names and what that imports from beside itself."""

import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

from harness.core.package_data import PACKAGE_FOLDER
from harness.core.working_folder import FolderFinder, name_module, serve_folder, served_folders
from tests.testing import upright

TRAPS = (
    *("IPython", "PyQt5", "_winapi", "bottleneck", "cffi", "colorama", "coverage", "cvista", "cython", "docutils"),
    *("envwrap", "ipywidgets", "lxml", "nt", "numexpr", "org", "orjson", "paramiko", "psutil", "scikits", "simplejson"),
    *("sksparse", "tornado", "torch", "uarray", "ujson", "winreg", "xxhash", "yaml"),
)
"""Modules that libraries import where they exist, as a trace of `list`, `run`, `check` and `plot` shows, and others."""
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
    (folder / ".numba_config.yaml").write_text("num_threads: 0\n")
    return folder


def run_harness(folder: Path, *words: str, **environment: str) -> set[str]:
    """The names of the modules of a folder that a command runs there."""
    inherited = {name: value for name, value in os.environ.items() if name not in ("PYTHONSAFEPATH", "PYTHONPATH")}
    path = {"PYTHONPATH": str(PACKAGE_FOLDER.parent)}
    command, options = [sys.executable, "-m", "harness", *words], inherited | path | environment
    done = subprocess.run(command, cwd=folder, env=options, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stderr
    return {file.stem for file in folder.parent.glob("*.ran")}


@pytest.mark.long
def test_a_list_runs_nothing(trap_folder: Path) -> None:
    assert run_harness(trap_folder, "list") == set()


@pytest.mark.long
def test_an_empty_entry_of_pythonpath_changes_nothing(trap_folder: Path) -> None:
    for name in ("_winapi", "nt", "org"):  # Python imports them before the program can take the folder off the path
        (trap_folder / f"{name}.py").unlink()
    assert run_harness(trap_folder, "list", PYTHONPATH=f"{PACKAGE_FOLDER.parent}:") == set()


@pytest.mark.long
def test_a_run_runs_the_method_and_its_helpers(trap_folder: Path) -> None:
    """Also in the process of the method; the page is drawn although a matplotlibrc asks for LaTeX."""
    found = run_harness(trap_folder, "run", "small.toml", "--jobs", "2", "--out", "out")
    assert found == {"beside", "later", "package.part", "package.__init__"}
    assert list((trap_folder / "out" / "plots").glob("*.svg"))


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
