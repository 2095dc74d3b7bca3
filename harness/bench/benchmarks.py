"""The benchmarks of `harness bench`, by name."""

from collections.abc import Callable, Sequence
from importlib.util import find_spec

from harness.bench.lab.speed import bench_lab
from harness.bench.leak_check import bench_leak_check
from harness.bench.live_viewer import bench_live_viewer
from harness.bench.load import bench_load
from harness.bench.neighbour_search import bench_index
from harness.bench.performers import NoLibrary, bench_performers
from harness.bench.physics.speed import bench_physics
from harness.bench.regression_gate import bench_regression_gate
from harness.bench.rejected_readings import bench_rejected_readings
from harness.bench.rows import BenchmarkRow
from harness.bench.serve import bench_serve
from harness.bench.simulated_stream import bench_stream
from harness.bench.startup import bench_startup
from harness.bench.sweep import bench_sweep
from harness.bench.wire import bench_wire
from harness.errors import MissingExtra, UnknownName


def _index(seed: int, large: bool, runs: int) -> list[BenchmarkRow]:
    if find_spec("faiss") is None:
        raise MissingExtra("The reference for the search of neighbours", "faiss-cpu", "bench")
    return bench_index(seed)


def _ik(seed: int, large: bool, runs: int) -> list[BenchmarkRow]:
    _require_mink()
    from harness.bench.ik import bench_ik

    return bench_ik(seed)


def _methods(seed: int, large: bool, runs: int) -> list[BenchmarkRow]:
    _require_mink()
    from harness.bench.methods import bench_methods

    return bench_methods(seed, large=large)


def _require_mink() -> None:
    if find_spec("mink") is None:
        raise MissingExtra("The reference for inverse kinematics", "mink", "bench")


BENCHMARKS: dict[str, Callable[[int, bool, int], list[BenchmarkRow]]] = {
    "startup": lambda seed, large, runs: bench_startup(),
    "load": lambda seed, large, runs: bench_load(seed),
    "stream": lambda seed, large, runs: bench_stream(seed),
    "physics": lambda seed, large, runs: bench_physics(seed),
    "lab": lambda seed, large, runs: bench_lab(seed),
    "wire": lambda seed, large, runs: bench_wire(seed, large=large, runs=runs),
    "serve": lambda seed, large, runs: bench_serve(seed, runs=runs),
    "view": lambda seed, large, runs: bench_live_viewer(seed, runs=runs),
    "ik": _ik,
    "index": _index,
    "methods": _methods,
    "outliers": lambda seed, large, runs: bench_rejected_readings(seed),
    "leak": lambda seed, large, runs: bench_leak_check(seed),
    "gate": lambda seed, large, runs: bench_regression_gate(seed),
    "sweep": lambda seed, large, runs: bench_sweep(seed),
    "performers": lambda seed, large, runs: bench_performers(seed),
}


def run_benchmarks(
    names: Sequence[str],
    *,
    seed: int,
    large: bool = False,
    runs: int = 1,
    progress: Callable[[str, int, int], None],
) -> tuple[list[BenchmarkRow], list[str]]:
    """Run the named benchmarks, or all; returns their rows, and the reasons why some of all could not run.

    With `large`, `methods` also uses a database of a million frames, and `wire` runs each line for ten minutes.
    `wire` runs each line `runs` times, and so do `serve` and `view` their sessions.
    UnknownName for an unknown benchmark, MissingExtra for a named one whose package is not installed, and NoLibrary
    for a named one that needs real motion.
    """
    for name in names:
        if name not in BENCHMARKS:
            raise UnknownName("benchmark", name, BENCHMARKS)
    chosen = [name for name in BENCHMARKS if name in names or not names]
    rows: list[BenchmarkRow] = []
    skipped: list[str] = []
    for done, name in enumerate(chosen):
        progress(name, done, len(chosen))
        try:
            rows += BENCHMARKS[name](seed, large, runs)
        except (MissingExtra, NoLibrary) as missing:
            if names:
                raise
            skipped.append(f"{name} was not run. {missing}")
    progress("", len(chosen), len(chosen))
    return rows, skipped
