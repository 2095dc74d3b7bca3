"""What `harness bench` runs."""

from collections.abc import Callable, Sequence
from importlib.util import find_spec

from harness.bench.load import bench_load
from harness.bench.neighbour_search import bench_index
from harness.bench.regression_gate import bench_regression_gate
from harness.bench.rows import BenchmarkRow
from harness.bench.simulated_stream import bench_stream
from harness.bench.startup import bench_startup
from harness.bench.sweep import bench_sweep
from harness.bench.wire import bench_wire
from harness.errors import MissingExtra, UnknownName


def _ik(seed: int, large: bool) -> list[BenchmarkRow]:
    _require_mink()
    from harness.bench.ik import bench_ik

    return bench_ik(seed)


def _methods(seed: int, large: bool) -> list[BenchmarkRow]:
    _require_mink()
    from harness.bench.methods import bench_methods

    return bench_methods(seed, large=large)


def _require_mink() -> None:
    if find_spec("mink") is None:
        raise MissingExtra("The reference of inverse kinematics", "mink", "bench")


BENCHMARKS: dict[str, Callable[[int, bool], list[BenchmarkRow]]] = {
    "startup": lambda seed, large: bench_startup(),
    "load": lambda seed, large: bench_load(seed),
    "stream": lambda seed, large: bench_stream(seed),
    "wire": lambda seed, large: bench_wire(seed, large=large),
    "ik": _ik,
    "index": lambda seed, large: bench_index(seed),
    "methods": _methods,
    "gate": lambda seed, large: bench_regression_gate(seed),
    "sweep": lambda seed, large: bench_sweep(seed),
}


def run_benchmarks(
    what: Sequence[str], *, seed: int, large: bool = False, progress: Callable[[str, int, int], None]
) -> tuple[list[BenchmarkRow], list[str]]:
    """The rows of the named benchmarks, or of all, and why some of all could not be run; UnknownName, MissingExtra.

    `large` has `methods` learn from a million frames as well, and `wire` keep each line busy for ten minutes.
    """
    for name in what:
        if name not in BENCHMARKS:
            raise UnknownName("benchmark", name, BENCHMARKS)
    chosen = [name for name in BENCHMARKS if name in what or not what]
    rows: list[BenchmarkRow] = []
    left_out: list[str] = []
    for done, name in enumerate(chosen):
        progress(name, done, len(chosen))
        try:
            rows += BENCHMARKS[name](seed, large)
        except MissingExtra as missing:
            if what:
                raise
            left_out.append(f"{name} was not run. {missing}")
    progress("", len(chosen), len(chosen))
    return rows, left_out
