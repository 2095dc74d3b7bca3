"""Prints a table of the kinds: files, refused, accepted, findings; and each finding once."""

import argparse
from collections import Counter
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.fuzz.campaign import run_campaign
from tests.fuzz.kinds import KINDS


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", action="append", choices=sorted(KINDS))
    args = parser.parse_args()
    counts: Counter[tuple[str, str]] = Counter()
    findings: dict[str, list[int]] = {}
    names = tuple(args.kind or KINDS)
    with TemporaryDirectory() as folder:
        for name, cases in groupby(run_campaign(args.files, args.seed, Path(folder), names), lambda case: case.kind):
            for case in cases:
                counts[name, case.outcome] += 1
                if case.outcome == "finding":
                    findings.setdefault(f"{name}: {case.text}", []).append(case.number)
            each = [counts[name, outcome] for outcome in ("refused", "accepted", "finding")]
            line = f"{name:22} {sum(each):6} files {each[0]:6} refused {each[1]:6} accepted {each[2]:6} findings"
            print(line, flush=True)
    for text, numbers in findings.items():
        print(f"{len(numbers)} x (case {numbers[0]}) {text}")
    return 1 if findings else 0


if __name__ == "__main__":
    raise SystemExit(main())
