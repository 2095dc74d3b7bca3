"""What a killed process leaves behind."""

import os
import subprocess
import sys
from pathlib import Path

from harness.core.files import temporary_path


def dead_process() -> int:
    """The number of a process that has ended."""
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        process.wait()
    return process.pid


def leave_behind(target: Path, *, folder: bool = False) -> Path:
    """The temporary file or folder of a killed process that wrote `target`."""
    mine = temporary_path(target)
    left = mine.with_name(mine.name.replace(f"{os.getpid()}-", f"{dead_process()}-"))
    left.parent.mkdir(parents=True, exist_ok=True)
    if folder:
        left.mkdir()
    (left / "part" if folder else left).touch()
    return left
