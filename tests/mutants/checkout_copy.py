"""A copy of the checkout in which mutations are tested, so that the checkout itself never changes."""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from tests.mutants.operators import Mutation
from tests.mutants.process_groups import ProcessGroups

_LEFT_OUT = (".git", ".venv", "build", ".mypy_cache", ".ruff_cache", ".pytest_cache", ".hypothesis", "site")
"""Folders of the checkout that tests do not need. Folders of compiled code are copied, which saves its compilation."""
_OPTIONS = ("-x", "-q", "-n", "0", "-p", "no:cacheprovider", "-m", "not slow and not long")
TIMEOUT = "timeout"
"""Reason of a run that reached its time limit."""
_LIMITED_PYTEST = Path(__file__).with_name("limited_pytest.py")


class PytestRun(NamedTuple):
    """Outcome of one pytest process."""

    passed: bool
    """Whether all tests passed, or none was selected."""
    reason: str
    """The first failing test, "timeout", or the exit code; "" if all passed."""
    seconds: float


@dataclass(frozen=True)
class CheckoutCopy:
    """A copy of the checkout, and the tests that run in it."""

    root: Path
    scratch: Path
    """Folder of temporary files of the tests."""
    processes: ProcessGroups = field(default_factory=ProcessGroups)
    """Where the tests run; `stop` ends them."""

    @classmethod
    def make(cls, checkout: Path, folder: Path, processes: ProcessGroups | None = None) -> "CheckoutCopy":
        """Copy a checkout into a folder; RuntimeError if Python would import the package from elsewhere."""
        shutil.copytree(checkout, folder / "checkout", ignore=shutil.ignore_patterns(*_LEFT_OUT), symlinks=True)
        (folder / "scratch").mkdir()
        copy = cls(folder / "checkout", folder / "scratch", processes or ProcessGroups())
        imported = Path(copy.python("-c", "import harness; print(harness.__file__)"))
        if not imported.is_relative_to(copy.root):
            raise RuntimeError(f"harness is imported from {imported}, not from the copy")
        return copy

    def python(self, *arguments: str) -> str:
        """Output of a Python process in the copy; CalledProcessError."""
        command = [sys.executable, *arguments]
        done = subprocess.run(
            command, cwd=self.root, env=self._environment(), capture_output=True, text=True, check=True
        )
        return done.stdout.strip()

    @contextmanager
    def mutated(self, mutation: Mutation) -> Iterator[None]:
        """The copy with one mutation, until the end of the block."""
        file = self.root / mutation.file
        source, times = file.read_text(encoding="utf-8"), file.stat()
        self._write(file, mutation.apply(source))
        try:
            yield
        finally:
            self._write(file, source)
            os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))

    def run_tests(self, files: Sequence[str], limit_s: float) -> PytestRun:
        """Run the fast tests of some files, in their order, until the first failure or the time limit [s]. Stopped."""
        command = [sys.executable, "-P", str(_LIMITED_PYTEST), *_OPTIONS]
        command += ["--basetemp", str(self.scratch / "pytest"), *files]
        start = time.monotonic()
        try:
            code, output = self.processes.run(command, cwd=self.root, env=self._environment(), limit_s=limit_s)
        except subprocess.TimeoutExpired:
            return PytestRun(False, TIMEOUT, time.monotonic() - start)
        seconds = time.monotonic() - start
        if code in (0, 5):  # 5: no test was selected
            return PytestRun(True, "", seconds)
        failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - |$)", output, re.M)
        return PytestRun(False, failed[1] if failed else f"exit code {code}", seconds)

    def _write(self, file: Path, text: str) -> None:
        """Write a source file and remove its bytecode.

        Python compares bytecode by size and whole seconds, so it would miss a change of one character.
        """
        file.write_text(text, encoding="utf-8")
        for bytecode in (file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"):
            bytecode.unlink()

    def _environment(self) -> dict[str, str]:
        """That of this process, but tests may write bytecode: without it every run compiles the whole package anew."""
        left_out = ("PYTEST_", "NUMBA_CACHE", "PYTHONDONTWRITEBYTECODE")
        kept = {name: value for name, value in os.environ.items() if not name.startswith(left_out)}
        folder = str(self.scratch)
        return kept | {"PYTHONPATH": str(self.root), "TMPDIR": folder, "OPENBLAS_NUM_THREADS": "1"}
