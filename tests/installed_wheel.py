"""Try the wheel as a new user has it: `python -m tests.installed_wheel`, which `.ci/run` calls.

A new environment, a home folder without a cache, and a working folder outside of the checkout. Every function that a
verb needs is compiled by the verb itself, also in processes that were forked. Takes about three minutes.
"""

import os
import re
import subprocess
import sys
import venv
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]
_SMALL = """schema = 1
methods = ["ik:previous"]
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
LEFT_OUT = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "PYTHONPATH", "PYTHONDONTWRITEBYTECODE")


def install_wheel(folder: Path) -> Path:
    """Build the wheel, install it in a new environment, and return the folder of its programs."""
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    built = [*pip, "wheel", "--no-deps", "--wheel-dir", str(folder / "wheel"), str(ROOT)]
    subprocess.run(built, check=True, stdout=subprocess.DEVNULL)
    venv.create(folder / "venv", with_pip=False)
    python = next((folder / "venv").glob("[bS]*/python*"))
    (wheel,) = (folder / "wheel").glob("tracker_harness-*.whl")
    chosen = ["--constraint", str(ROOT / "requirements.lock"), str(wheel)]
    subprocess.run([*pip, "--python", str(python), "install", "--quiet", *chosen], check=True)
    return python.parent


def write_method(folder: Path) -> None:
    """Write the whole method of docs/own_method.md into the working folder, and a small scenario."""
    page = (ROOT / "docs" / "own_method.md").read_text(encoding="utf-8")
    source = re.search(r"```python\n(# upright\.py\n.*?)```", page, re.S)
    assert source is not None, "docs/own_method.md has no whole method"
    (folder / "upright.py").write_text(source.group(1), encoding="utf-8")
    (folder / "small.toml").write_text(_SMALL, encoding="utf-8")


def run_harness(programs: Path, home: Path, working_folder: Path, words: Sequence[str]) -> str:
    """Run a verb of the installed program; its output. CalledProcessError, with the output, unless it passes."""
    environment = {name: value for name, value in os.environ.items() if name not in LEFT_OUT}
    command = [str(programs / "harness"), *words]
    print("$ harness", *words, flush=True)
    done = subprocess.run(
        command, cwd=working_folder, env=environment | {"HOME": str(home)}, text=True, capture_output=True, check=False
    )
    print(*done.stdout.splitlines()[-3:], sep="\n", flush=True)
    if done.returncode:
        sys.exit(f"exit code {done.returncode}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def main() -> None:
    with TemporaryDirectory(prefix="harness-wheel-") as name:
        folder = Path(name)
        home, working_folder = folder / "home", folder / "work"
        home.mkdir()
        working_folder.mkdir()
        programs = install_wheel(folder)
        write_method(working_folder)
        for words in (
            ["check", "upright:Upright"],
            ["run", "small.toml", "--methods", "upright:Upright", "--out", "own", "--jobs", "2"],
            ["run", "small.toml", "--isolate", "--no-report", "--out", "apart"],
            ["doctor"],
        ):
            run_harness(programs, home, working_folder, words)
        package = next((folder / "venv").rglob("harness/core")).parent
        cache = home / ".cache" / "tracker-harness"
        assert not [*package.rglob("*.nb[ic]")], "machine code lies in the package"
        assert [*cache.rglob("*.nbc")], "no machine code was kept"
        python = str(programs / "python")
        subprocess.run(
            [sys.executable, "-m", "pip", "--python", python, "uninstall", "-y", "-q", "tracker-harness"], check=True
        )
        assert not package.exists(), f"{package} is left after pip uninstall"


if __name__ == "__main__":
    main()
