"""The verb `baseline`: keep the results of a finished run, to compare with later."""

import argparse
from pathlib import Path

from harness.commands.flags import Verbs, add_verb
from harness.commands.output import print_result
from harness.errors import Outcome


def add_baseline(verbs: Verbs) -> None:
    text = "save the results of a finished run as a baseline"
    verb = add_verb(verbs, "baseline", text, run_baseline)
    verb.add_argument("what", metavar="ACTION", choices=["save"], help="save, the only action")
    verb.add_argument("name", metavar="NAME", help="name of the baseline, written to results/baselines/NAME")
    verb.add_argument("run", metavar="RUN", type=Path, help="folder written by `harness run` or `harness sweep`")
    verb.add_argument("--force", action="store_true", help="replace an existing baseline")


def run_baseline(args: argparse.Namespace) -> Outcome:
    from harness.compare import write_baseline

    folder = write_baseline(args.run, args.name, force=args.force)
    return print_result(
        args, {"baseline": str(folder)}, f"baseline: {folder}", following=["compare", args.name, args.run]
    )
