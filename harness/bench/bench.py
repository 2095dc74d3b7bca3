"""What `harness bench` runs."""

from collections.abc import Callable, Sequence

from harness.bench.ik import bench_ik
from harness.bench.load import bench_load
from harness.bench.rows import Row
from harness.bench.startup import bench_startup
from harness.bench.stream import bench_stream
from harness.errors import UnknownName

BENCHMARKS: dict[str, Callable[[int], list[Row]]] = {
    "startup": lambda seed: bench_startup(),
    "load": lambda seed: bench_load(seed),
    "stream": lambda seed: bench_stream(seed),
    "ik": lambda seed: bench_ik(seed),
}


def bench(what: Sequence[str], *, seed: int, progress: Callable[[str, int, int], None]) -> list[Row]:
    """The rows of the named benchmarks, or of all; UnknownName."""
    for name in what:
        if name not in BENCHMARKS:
            raise UnknownName("benchmark", name, BENCHMARKS)
    chosen = [name for name in BENCHMARKS if name in what or not what]
    rows: list[Row] = []
    for done, name in enumerate(chosen):
        progress(name, done, len(chosen))
        rows += BENCHMARKS[name](seed)
    progress("", len(chosen), len(chosen))
    return rows
