"""The verb `bench`: measure speed."""

import argparse

from harness.commands.common import Verbs, add_verb, print_result
from harness.core.progress import ProgressBar
from harness.errors import Outcome


def add_bench(verbs: Verbs) -> None:
    verb = add_verb(verbs, "bench", "measure speed on this machine: medians and ratios", run_bench, "seed")
    text = "methods, ik, index, wire, stream, load, gate, sweep, startup (default: all)"
    verb.add_argument("what", nargs="*", help=text)
    text = "methods: also a database of a million frames; wire: ten minutes per line"
    verb.add_argument("--large", action="store_true", help=text)


def run_bench(args: argparse.Namespace) -> Outcome:
    from harness.bench.benchmarks import run_benchmarks
    from harness.bench.rows import format_rows

    with ProgressBar("benchmarks") as progress:
        seed = args.seed if args.seed is not None else 1
        rows, left_out = run_benchmarks(tuple(args.what), seed=seed, large=args.large, progress=progress)
    content = {"rows": [row.as_dict() for row in rows], "left_out": left_out}
    return print_result(
        args, content, format_rows(rows), *left_out, outcome=Outcome.INCOMPLETE if left_out else Outcome.PASS
    )
