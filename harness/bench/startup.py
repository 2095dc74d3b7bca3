"""How long `harness --help` and the demo take, the demo with and without machine code of an earlier run.

A first run compiles the loops of the methods (`core.compiled`). numba keeps the machine code in the folder that
NUMBA_CACHE_DIR names, which is empty for the cold run here and filled for the warm one.
"""

import os
import subprocess
import time
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Thread
from typing import NamedTuple

import numpy as np

from harness.bench.cpu_time import hold_cpu_to_limit, overbooked, process_times
from harness.bench.limits import hold_to_limit
from harness.core.working_folder import python_command, python_environment
from harness.errors import HarnessError
from harness.results.findings import BenchmarkStatement

_POLL_INTERVAL_S = 0.05
MAX_HELP_RATIO = 15.0
"""Most CPU time of the help, relative to that of an interpreter that does nothing."""
MAX_COLD_RATIO = 2.0
"""Most CPU time of the demo that compiles, relative to one that finds the machine code."""
MAX_LINE_RATIO, MAX_RESULT_SHARE = 6.0, 1.0 / 3.0
"""Most time until the first line, relative to the help, and until the first result, relative to the report."""


class DemoTimes(NamedTuple):
    """Times of one demo from its start [s]."""

    first_line_s: float
    """Until the first line of output."""
    first_result_s: float
    """Until the first cell is finished."""
    report_s: float
    """Until the command has ended; the report is written then."""
    cpu_s: float
    """CPU time of the command and its workers."""


def bench_startup(repeats: int = 7) -> list[BenchmarkStatement]:
    """The help beside a bare interpreter, in medians of interleaved runs, and one cold and one warm demo."""
    bare = python_command("-c", "pass")
    help_text = python_command("-m", "harness.cli", "--help")
    times = np.array([[_time_command(bare), _time_command(help_text)] for _ in range(repeats)])
    (bare_s, bare_cpu_s), (help_s, help_cpu_s) = np.median(times, axis=0).tolist()
    reference = f"bare interpreter {bare_s:.3f} s"
    rows = [hold_to_limit("harness --help", help_s, "s", reference=reference)]
    reference = f"{help_cpu_s:.3f} and {bare_cpu_s:.3f} s"
    name = "harness --help / bare interpreter: CPU time"
    rows.append(hold_to_limit(name, help_cpu_s / bare_cpu_s, "x", most=MAX_HELP_RATIO, reference=reference))
    with TemporaryDirectory(prefix="harness-startup-") as folder:
        cold, warm = (time_demo(Path(folder) / name, Path(folder) / "machine code") for name in ("cold", "warm"))
    return [*rows, *demo_rows(cold, warm, help_s, overbooked())]


def demo_rows(cold: DemoTimes, warm: DemoTimes, help_s: float, doubt: str = "") -> list[BenchmarkStatement]:
    """The rows of a demo that compiles and of one after it, beside the time of the help [s].

    `doubt` says why ratios of wall times have no verdict, as on an overbooked machine.
    """
    steps = {
        "first line": (cold.first_line_s, warm.first_line_s),
        "first result": (cold.first_result_s, warm.first_result_s),
        "report": (cold.report_s, warm.report_s),
    }
    wall = [hold_to_limit(f"demo, cold: {name}", a, "s", reference=f"warm {b:.1f} s") for name, (a, b) in steps.items()]
    limits = [
        ("demo, cold: first line / harness --help", cold.first_line_s, help_s, MAX_LINE_RATIO, doubt),
        ("demo, cold: first result / report", cold.first_result_s, cold.report_s, MAX_RESULT_SHARE, doubt),
        ("demo, cold / warm: CPU time of all processes", cold.cpu_s, warm.cpu_s, MAX_COLD_RATIO, ""),
    ]
    ratios = [
        hold_to_limit(name, a / b, "x", most=most, reference=f"{a:.1f} and {b:.1f} s", doubt=why)
        for name, a, b, most, why in limits
    ]
    return [*wall, *ratios, hold_cpu_to_limit("demo, warm, all processes", warm.cpu_s, None)]


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


def _time_command(command: list[str]) -> list[float]:
    """Wall time and CPU time of a command [s]."""
    start = process_times()
    subprocess.run(command, env=python_environment(), check=True, stdout=subprocess.DEVNULL)
    return list((process_times() - start).tolist())
