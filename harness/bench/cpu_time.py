"""CPU time of a benchmark's work, the fixed workload that it is compared with, and whether the machine is overbooked.

CPU time hardly depends on what else runs, and its ratio to that of a fixed workload hardly on the machine.
"""

import os
import resource
import time
from collections.abc import Callable

import numpy as np

from harness.bench.limits import hold_to_limit
from harness.core.arrays import Floats
from harness.experiment.methods import ReferenceWorkload
from harness.results.findings import BenchmarkStatement

REFERENCE_RUNS = 1000
"""Runs of the reference workload that are one unit of CPU time; about 0.14 s on one core of a shared x86 machine."""
MAX_TIMER_P99_MS = 2.0
"""A machine whose timer is later than this (99th percentile) is overbooked [ms]: on two cores it is 4 at load 10."""
MAX_LOAD_PER_CORE = 2.0
"""As many processes that want to run, for each core, are too many, too: they delay a program more than its timer."""


def time_cpu(work: Callable[[], object]) -> float:
    """CPU time of a call in this process [s]."""
    start = time.process_time()
    work()
    return time.process_time() - start


def process_times() -> Floats:
    """(2,) wall time, and CPU time of this process and its finished children [s]; only differences mean anything."""
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return np.array([time.perf_counter(), time.process_time() + children.ru_utime + children.ru_stime])


def hold_cpu_to_limit(text: str, cpu_s: float, most: float | None, reference: str = "") -> BenchmarkStatement:
    """A statement that CPU time [s] is at most so many units of `REFERENCE_RUNS` runs, which are timed now."""
    workload = ReferenceWorkload()
    unit_s = min(sum(workload.cpu_ms() for _ in range(REFERENCE_RUNS)) / 1e3 for _ in range(3))
    measured = f"{cpu_s:.3g} s CPU; {REFERENCE_RUNS:,} reference runs {unit_s:.3f} s"
    reference = "; ".join(filter(None, (measured, reference)))
    return hold_to_limit(f"{text}, CPU time", cpu_s / unit_s, "units", most=most, reference=reference)


def overbooked(timer_p99_ms: float = 0.0) -> str:
    """Why the machine is too busy for a verdict on wall times; "" where it is not.

    `timer_p99_ms` is the 99th percentile of the delay of the operating system's timer meanwhile [ms].
    """
    load, cores = os.getloadavg()[0], os.cpu_count() or 1
    if timer_p99_ms > MAX_TIMER_P99_MS:
        return f"the machine is overbooked: its timer is {timer_p99_ms:.1f} ms late (p99), load {load:.0f}"
    return f"the machine is overbooked: load {load:.0f} on {cores} cores" if load > MAX_LOAD_PER_CORE * cores else ""
