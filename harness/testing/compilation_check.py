"""Check that functions are compiled, in a process of its own that `check_compilation` starts.

The process that imports the function forks the one that compiles it, as the server of method processes does. A second
one loads the machine code.
"""

import multiprocessing
import subprocess
import sys
from tempfile import TemporaryDirectory
from typing import Any

from harness.core.cache_folder import cache_folder, folder_bytes
from harness.core.child_process import PythonProcess
from harness.core.compiled import compiled

_TIMEOUT_S = 300.0  # a busy machine


@compiled
def halve(value: float) -> float:
    """Half of a value."""
    return 0.5 * value


def check_compilation() -> tuple[bool, str]:
    """Compile a function in a new process with an empty cache folder: whether that works, and what was seen."""
    with TemporaryDirectory(prefix="harness-doctor-") as folder:
        options: dict[str, Any] = {"stdout": subprocess.PIPE, "env": {"NUMBA_CACHE_DIR": folder}}
        with PythonProcess(__name__, watched=False, **options) as process:
            ended = process.finish(_TIMEOUT_S)
    if ended is None:
        return False, f"a small function was not compiled within {_TIMEOUT_S:g} s"
    lines = (ended[0] or ended[1]).strip().splitlines()
    return process.returncode == 0, lines[-1] if lines else f"exit code {process.returncode}"


def describe_cache() -> str:
    """Where machine code is kept, and how much."""
    folder = cache_folder()
    if folder is None:
        return "nowhere: no private folder can be written, so every process compiles anew (docs/installation.md)"
    return f"{folder_bytes(folder) / 1e6:.1f} MB in {folder}"


def _call() -> None:
    if halve(3.0) != 1.5:
        sys.exit("half of 3 is not 1.5")


def _hits() -> None:
    _call()
    statistics = halve.stats  # type: ignore[attr-defined]  # of numba, which has no types
    sys.exit(0 if sum(statistics.cache_hits.values()) else 1)


def main() -> None:
    kind = "fork" if "fork" in multiprocessing.get_all_start_methods() else "spawn"
    context: Any = multiprocessing.get_context(kind)
    codes = []
    for target in (_call, _hits):
        process = context.Process(target=target)
        process.start()
        process.join()
        codes.append(process.exitcode)
    if codes[0]:
        sys.exit(f"a process that was started by {kind} cannot compile (exit code {codes[0]})")
    kept = "the next process loads it" if codes[1] == 0 else "it is not kept, so every process compiles anew"
    print(f"a small function was compiled, {kept}")
