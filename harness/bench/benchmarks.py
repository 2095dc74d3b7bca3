"""The benchmarks of `harness bench`, by name."""

from collections.abc import Callable, Sequence
from importlib.util import find_spec

from harness.bench.foreign.benchmark import bench_foreign
from harness.bench.foreign.streams import NoRealStreams
from harness.bench.lab.speed import bench_lab
from harness.bench.methods import bench_methods
from harness.bench.neighbour_search import bench_index
from harness.bench.performers import NoLibrary, bench_performers
from harness.bench.physics.speed import bench_physics
from harness.bench.regression_gate import bench_regression_gate
from harness.bench.rejected_readings import bench_rejected_readings
from harness.bench.simulated_stream import bench_stream
from harness.bench.startup import bench_startup
from harness.bench.sweep import bench_sweep
from harness.bench.wire import bench_wire
from harness.errors import BadInput, MissingExtra, UnknownName
from harness.results.findings import BenchmarkStatement


def _ik(seed: int, large: bool, runs: int) -> list[BenchmarkStatement]:
    from harness.bench.ik import bench_ik  # it imports mink

    return bench_ik(seed)


BENCHMARKS: dict[str, Callable[[int, bool, int], list[BenchmarkStatement]]] = {
    "startup": lambda seed, large, runs: bench_startup(),
    "stream": lambda seed, large, runs: bench_stream(seed),
    "physics": lambda seed, large, runs: bench_physics(seed),
    "lab": lambda seed, large, runs: bench_lab(seed),
    "wire": lambda seed, large, runs: bench_wire(seed, large=large, runs=runs),
    "ik": _ik,
    "index": lambda seed, large, runs: bench_index(seed),
    "methods": lambda seed, large, runs: bench_methods(seed, large=large),
    "outliers": lambda seed, large, runs: bench_rejected_readings(seed),
    "gate": lambda seed, large, runs: bench_regression_gate(seed),
    "sweep": lambda seed, large, runs: bench_sweep(seed),
    "performers": lambda seed, large, runs: bench_performers(seed),
    "foreign": lambda seed, large, runs: bench_foreign(),
}
_REFERENCES = {
    "index": (("faiss", "The reference for the search of neighbours", "faiss-cpu"),),
    **dict.fromkeys(("ik", "methods"), (("mink", "The reference for inverse kinematics", "mink"),)),
    "foreign": (
        ("cv2", "The reference for mounts", "opencv-python-headless"),
        ("evo", "The reference for spreads", "evo"),
        ("allantools", "The reference for Allan deviations", "allantools"),
    ),
}
"""Benchmark -> the modules of its references, what each is, and its package."""

ALONE = ("accuracy", "ranking")
"""Benchmarks that run alone, with options of their own."""
CHECKOUT_ONLY = ("leak", "load", "serve", "view")
"""Benchmarks of earlier versions, now scripts of the tests."""


def run_benchmarks(
    names: Sequence[str],
    *,
    seed: int,
    large: bool = False,
    runs: int = 1,
    progress: Callable[[str, int, int], None],
) -> tuple[list[BenchmarkStatement], list[str]]:
    """Run the named benchmarks, or all; returns their rows, and the reasons why some of all could not run.

    With `large`, `methods` also uses a database of a million frames, and `wire` runs each line for ten minutes.
    `wire` runs each line `runs` times. UnknownName for an unknown benchmark, BadInput for one of `CHECKOUT_ONLY`,
    MissingExtra for a named one whose package is not installed, NoLibrary for a named one that needs real motion, and
    NoRealStreams for one that needs real streams.
    """
    for name in names:
        if name in CHECKOUT_ONLY:
            advice = f"In a checkout of the source, run: python -m tests.benchmarks {name}."
            raise BadInput(f"The benchmark {name} is no longer a part of the package.", advice)
        if name not in BENCHMARKS:
            raise UnknownName("benchmark", name, (*BENCHMARKS, *ALONE))
    chosen = [name for name in BENCHMARKS if name in names or not names]
    rows: list[BenchmarkStatement] = []
    skipped: list[str] = []
    for done, name in enumerate(chosen):
        progress(name, done, len(chosen))
        try:
            for module, what, package in _REFERENCES.get(name, ()):
                if find_spec(module) is None:
                    raise MissingExtra(what, package, "bench")
            rows += BENCHMARKS[name](seed, large, runs)
        except (MissingExtra, NoLibrary, NoRealStreams) as missing:
            if names:
                raise
            skipped.append(f"{name} was not run. {missing}")
    progress("", len(chosen), len(chosen))
    return rows, skipped
