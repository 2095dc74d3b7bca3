"""How long `harness --help` takes, beside a bare interpreter."""

import subprocess
import time

import numpy as np

from harness.bench.rows import BenchmarkRow
from harness.core.python_process import python_command, python_environment


def bench_startup(repeats: int = 7) -> list[BenchmarkRow]:
    """Medians of interleaved runs, so that load on the machine affects both equally."""
    bare = python_command("-c", "pass")
    help_text = python_command("-m", "harness.cli", "--help")
    seconds = np.array([[_time_command(bare), _time_command(help_text)] for _ in range(repeats)])
    bare_s, help_s = np.median(seconds, axis=0)
    return [
        BenchmarkRow("harness --help", float(help_s), "s", f"bare interpreter {bare_s:.3f} s", "< 0.3"),
        BenchmarkRow("harness --help / bare interpreter", float(help_s / bare_s), "x", "the same runs", ""),
    ]


def _time_command(command: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, env=python_environment(), check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start
