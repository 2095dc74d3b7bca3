"""Benchmarks of parts that no user measures: prints a table, and ends with 1 where a target is missed."""

import argparse
import sys
from collections.abc import Callable, Sequence

from harness.bench.limits import count_missed, outcome_of
from harness.report.kit import format_statements
from harness.results.findings import BenchmarkStatement
from tests.benchmarks.leak_check import bench_leak_check
from tests.benchmarks.live_viewer import bench_live_viewer
from tests.benchmarks.load import bench_load
from tests.benchmarks.pose_files import bench_pose_files
from tests.benchmarks.serve import bench_serve

BENCHMARKS: dict[str, Callable[[int, int], list[BenchmarkStatement]]] = {
    "leak": lambda seed, runs: bench_leak_check(seed),
    "load": lambda seed, runs: bench_load(seed),
    "poses": lambda seed, runs: bench_pose_files(seed),
    "serve": lambda seed, runs: bench_serve(seed, runs=runs),
    "view": lambda seed, runs: bench_live_viewer(seed, runs=runs),
}


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("what", nargs="+", choices=sorted(BENCHMARKS))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--runs", type=int, default=1, help="serve, view: number of runs")
    args = parser.parse_args(words)
    rows = [row for name in args.what for row in BENCHMARKS[name](args.seed, args.runs)]
    print("\n".join([*format_statements(rows), count_missed(rows), outcome_of(rows).word]))
    return outcome_of(rows).exit_code


if __name__ == "__main__":
    sys.exit(main())
