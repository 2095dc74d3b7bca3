"""How long `harness --help` and the demo take, the demo with and without machine code of an earlier run.

A first run compiles the loops of the methods (`core.compiled`). numba keeps the machine code in the folder that
NUMBA_CACHE_DIR names, which is empty for the cold run here and filled for the warm one.
"""

import os
import subprocess
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread

import numpy as np

from harness.bench.rows import BenchmarkRow
from harness.core.python_process import python_command, python_environment
from harness.errors import HarnessError

_POLL_INTERVAL_S = 0.05
_FIRST_LINE_S, _FIRST_RESULT_S, _REPORT_S = 2.0, 20.0, 60.0
"""Targets of the cold demo [s]."""


@dataclass(frozen=True)
class DemoTimes:
    """Times of one demo from its start [s]."""

    first_line_s: float
    """Until the first line of output."""
    first_result_s: float
    """Until the first cell is finished."""
    report_s: float
    """Until the command has ended; the report is written then."""
    cpu_s: float
    """CPU time of the command and its workers."""


def bench_startup(repeats: int = 7) -> list[BenchmarkRow]:
    """The help beside a bare interpreter, in medians of interleaved runs, and one cold and one warm demo."""
    bare = python_command("-c", "pass")
    help_text = python_command("-m", "harness.cli", "--help")
    seconds = np.array([[_time_command(bare), _time_command(help_text)] for _ in range(repeats)])
    bare_s, help_s = np.median(seconds, axis=0)
    rows = [
        BenchmarkRow("harness --help", float(help_s), "s", f"bare interpreter {bare_s:.3f} s", "< 0.3"),
        BenchmarkRow("harness --help / bare interpreter", float(help_s / bare_s), "x", "the same runs", ""),
    ]
    with TemporaryDirectory(prefix="harness-startup-") as folder:
        cold, warm = (time_demo(Path(folder) / name, Path(folder) / "machine code") for name in ("cold", "warm"))
    for name, target, read in _QUANTITIES:
        limit = f"<= {target:g}" if target else ""
        rows.append(BenchmarkRow(f"demo, cold: {name}", read(cold), "s", f"warm {read(warm):.1f} s", limit))
    return rows


_QUANTITIES: tuple[tuple[str, float, Callable[[DemoTimes], float]], ...] = (
    ("first line", _FIRST_LINE_S, lambda times: times.first_line_s),
    ("first result", _FIRST_RESULT_S, lambda times: times.first_result_s),
    ("report", _REPORT_S, lambda times: times.report_s),
    ("CPU time of all processes", 0.0, lambda times: times.cpu_s),
)


def time_demo(out: Path, machine_code: Path, *options: str) -> DemoTimes:
    """Time `harness demo` in a process; HarnessError when it fails.

    `machine_code` is the folder in which numba looks for functions that are compiled already.
    """
    machine_code.mkdir(exist_ok=True)
    command = python_command("-m", "harness", "demo", "--out", str(out), *options)
    environment = {**python_environment(), "NUMBA_CACHE_DIR": str(machine_code)}
    start, line_s, result_s, lines = time.perf_counter(), float("nan"), float("nan"), list[str]()

    def read_lines(output: Iterable[str]) -> None:
        nonlocal line_s
        for line in output:
            line_s = line_s if lines else time.perf_counter() - start
            lines.append(line)

    with subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=out.parent
    ) as process:
        reader = Thread(target=read_lines, args=(process.stdout,))
        reader.start()
        while True:
            if np.isnan(result_s) and any((out / "cells").glob("[!.]*")):
                result_s = time.perf_counter() - start
            ended, status, used = os.wait4(process.pid, os.WNOHANG)
            if ended:
                break
            time.sleep(_POLL_INTERVAL_S)
        process.returncode = os.waitstatus_to_exitcode(status)
        reader.join()
    if process.returncode:
        raise HarnessError(f"The demo ended with exit code {process.returncode}: {''.join(lines[-3:]).strip()}")
    return DemoTimes(line_s, result_s, time.perf_counter() - start, used.ru_utime + used.ru_stime)


def _time_command(command: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, env=python_environment(), check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start
