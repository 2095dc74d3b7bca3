"""Python processes of the harness run no file of the working folder."""

import os
import shutil
import subprocess
import sys
from ast import literal_eval
from importlib.util import find_spec
from pathlib import Path

import pytest

from harness.core.package_data import PACKAGE_FOLDER
from harness.core.python_process import python_command, python_environment, safe_import_path

TRAPS = ("ezc3d", "numpy", "runpy", "pickle", "multiprocessing", "pyvista", "distributed")
"""Modules that children import; one that is called so in the working folder says that it was run."""
POOL = """
import sys
from harness.core.workers import run_in_workers
from harness.experiment import executors
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


@pytest.fixture
def trap_folder(tmp_path: Path) -> Path:
    """A working folder with a module for each of TRAPS, which leaves a file when it is imported."""
    folder = tmp_path / "here"
    folder.mkdir()
    for name in TRAPS:
        (folder / f"{name}.py").write_text(f"open({str(tmp_path / name)!r} + '.ran', 'w')\nraise SystemExit(9)\n")
    return folder


def _environment() -> dict[str, str]:
    """The environment of a user, who has not set PYTHONSAFEPATH; other tests may have."""
    inherited = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"}
    return {**inherited, "PYTHONPATH": str(PACKAGE_FOLDER.parent)}


def _run(arguments: list[str], folder: Path) -> str:
    command = [sys.executable, *arguments]
    done = subprocess.run(command, cwd=folder, env=_environment(), capture_output=True, text=True, timeout=100)
    assert done.returncode == 0, done.stderr
    assert [path.name for path in folder.parent.glob("*.ran")] == []
    return done.stdout


def test_the_traps_work(trap_folder: Path) -> None:
    command = [sys.executable, "-m", "numpy"]
    assert subprocess.run(command, cwd=trap_folder, env=_environment(), check=False).returncode != 0
    assert [path.name for path in trap_folder.parent.glob("*.ran")]


def test_a_c3d_file_is_read_beside_modules_of_the_working_folder(trap_folder: Path) -> None:
    from tests.fuzz.kinds import KINDS

    KINDS["c3d"].make(trap_folder)
    for options in (["-P", "-m", "harness"], [str(_script(trap_folder))]):
        assert "c3d" in _run([*options, "inspect", "91_01.c3d"], trap_folder)


def _script(folder: Path) -> Path:
    """The installed command, whose first import path is the folder of the script."""
    script = folder.parent / "bin" / "harness"
    script.parent.mkdir(exist_ok=True)
    script.write_text("import sys\nfrom harness.cli import main\nsys.exit(main())\n")
    return script


def test_workers_do_not_import_from_the_working_folder(trap_folder: Path) -> None:
    program = trap_folder.parent / "program.py"
    program.write_text(POOL)
    assert str(trap_folder) not in _run([str(program)], trap_folder)


@pytest.mark.long
@pytest.mark.skipif(find_spec("distributed") is None, reason="Dask needs the extra cluster")
def test_dask_workers_do_not_either(trap_folder: Path) -> None:
    program = trap_folder.parent / "program.py"
    program.write_text(POOL)
    assert str(trap_folder) not in literal_eval(_run([str(program), "dask"], trap_folder).splitlines()[-1])


def test_libraries_that_start_python_do_not_either(trap_folder: Path) -> None:
    (trap_folder / "ctypes.py").write_text((trap_folder / "numpy.py").read_text().replace("numpy", "ctypes"))
    program = trap_folder.parent / "program.py"
    program.write_text("from harness.cli import main\nmain(['list'])\nimport mujoco")
    _run([str(program)], trap_folder)


def test_other_children_do_not_either(trap_folder: Path) -> None:
    code = (
        "import subprocess; from harness.core.python_process import *\n"
        "subprocess.run(python_command('-c', 'import numpy, pickle'), env=python_environment(), check=True)"
    )
    _run(["-P", "-c", code], trap_folder)


def test_the_module_form_of_the_command_leaves_the_working_folder_out(tmp_path: Path) -> None:
    (tmp_path / "numpy.py").write_text("raise SystemExit('numpy of the working folder')")
    (tmp_path / "x.toml").write_text("schema = 1")
    done = subprocess.run(
        [sys.executable, "-m", "harness", "list"], cwd=tmp_path, env=_environment(), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr


def test_a_checkout_that_is_the_working_folder_still_runs(tmp_path: Path) -> None:
    shutil.copytree(PACKAGE_FOLDER, tmp_path / "harness", ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("models", "scenarios"):
        (tmp_path / name).symlink_to(PACKAGE_FOLDER.parent / name)
    (tmp_path / "numbers.py").write_text("raise SystemExit('numbers of the working folder')")
    environment = {name: value for name, value in _environment().items() if name != "PYTHONPATH"}
    code = "import harness, sys; print(harness.__file__)"
    probe = [sys.executable, "-m", "harness", "--version"]
    assert subprocess.run(probe, cwd=tmp_path, env=environment, capture_output=True, check=False).returncode == 0
    ours = subprocess.run(
        python_command("-c", code), cwd=tmp_path, env=python_environment(), capture_output=True, text=True, check=True
    )
    assert ours.stdout.strip() == str(PACKAGE_FOLDER / "__init__.py")


def test_relative_folders_of_pythonpath_are_left_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["", ".", "lib", str(tmp_path)]))
    folders = python_environment()["PYTHONPATH"].split(os.pathsep)
    assert folders[0] == str(tmp_path)
    assert all(map(os.path.isabs, folders))
    assert python_command("-m", "x") == [sys.executable, "-P", "-m", "x"]


@pytest.mark.parametrize("before", [None, "0"])
def test_the_environment_is_as_before_afterwards(monkeypatch: pytest.MonkeyPatch, before: str | None) -> None:
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    if before is not None:
        monkeypatch.setenv("PYTHONSAFEPATH", before)
    with safe_import_path():
        assert os.environ["PYTHONSAFEPATH"] == "1"
    assert os.environ.get("PYTHONSAFEPATH") == before
