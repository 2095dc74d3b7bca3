"""Draw mutations, run the tests on each, and print the share that the tests catch.

The exit code is 1 when less than 90 % are caught, and 130 after Ctrl-C or SIGTERM. It is 2 when the tests fail without
a mutation, an entry of equivalent.toml matches nothing, or no mutation is drawn that a test could notice.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.commands.flags import positive_int
from harness.core.interrupts import accept_interrupts
from harness.errors import Outcome
from tests.mutants.campaign import RedReference, Result, run_campaign, share_caught
from tests.mutants.checkout_copy import TIMEOUT
from tests.mutants.drawing import PACKAGES, all_mutations, draw
from tests.mutants.equivalent import read_equivalents, reason_of, unmatched
from tests.mutants.operators import OPERATORS

ROOT = Path(__file__).parents[2]
LEAST_SHARE = 0.9


def main(arguments: Sequence[str] | None = None) -> int:
    options = _parser().parse_args(arguments)
    try:
        with accept_interrupts():
            return _test_draw(options)
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        return Outcome.INTERRUPTED.exit_code


def _test_draw(options: argparse.Namespace) -> int:
    """Exit code."""
    possible, equivalents = all_mutations(ROOT), read_equivalents()
    for entry in unmatched(equivalents, possible):
        print(f"equivalent.toml: no mutation of {entry.file} is {entry.operator}: {entry.line} -> {entry.mutant}")
        return 2
    eligible = [m for m in possible if m.file.startswith(options.under)]
    if not eligible:
        print(f"--under {options.under}: there is nothing to mutate.", file=sys.stderr)
        return 2
    drawn = draw(eligible, options.count, np.random.default_rng(options.seed))
    print(f"seed {options.seed}: {len(drawn)} of {len(eligible):,} mutations, {len(OPERATORS)} operators")
    if options.dry_run:
        print(*drawn, sep="\n")
        return 0
    if all(reason_of(mutation, equivalents) for mutation in drawn):
        print("All drawn mutations are equivalent: there is nothing to test.", file=sys.stderr)
        return 2
    if not os.environ.get("HARNESS_MOCAP"):
        print("HARNESS_MOCAP is not set: tests on real motion are skipped, and catch nothing.")
    try:
        results = run_campaign(ROOT, drawn, equivalents, jobs=options.jobs, near=options.near, report=_print_result)
    except RedReference as error:
        print(error, file=sys.stderr)
        return 2
    share, real = share_caught(results), sum(not result.equivalent for result in results)
    timeouts = sum(result.caught_by == TIMEOUT for result in results)
    print(
        f"caught: {share:.0%} of {real} ({timeouts} by timeout, {len(results) - real} equivalent); "
        f"at least {LEAST_SHARE:.0%} are needed"
    )
    return int(share < LEAST_SHARE)


def _print_result(result: Result) -> None:
    print(f"{result.mutation}\n    {result.outcome}", flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants", description=__doc__)
    parser.add_argument("--seed", type=int, default=1, help="of the draw; default 1")
    parser.add_argument("--count", type=positive_int, default=60, help="number of mutations; default 60")
    parser.add_argument("--jobs", type=positive_int, default=1, help="copies that are tested at once; default 1")
    parser.add_argument(
        "--near", action="store_true", help="run only the tests of the module's own package: a lower bound"
    )
    parser.add_argument("--under", default="harness/", metavar="PATH", help="draw from these files or folders only")
    parser.add_argument("--dry-run", action="store_true", help="print the drawn mutations and stop")
    parser.epilog = f"Mutated are harness/: {', '.join(PACKAGES)}."
    return parser


if __name__ == "__main__":
    sys.exit(main())
