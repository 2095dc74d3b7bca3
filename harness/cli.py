"""The command line: a verb parses, calls one library function, and prints. stdout is data, stderr is talk."""

import argparse
import json
import os
import sys
from collections.abc import Sequence

from harness import __version__
from harness.commands import calibrate, check, compare, emulate, live, mocap, paper, placement, record, run, sweep
from harness.errors import HarnessError, Outcome, was_interrupted


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb; the exit code says how it ended (see `errors.Outcome`)."""
    try:
        args = build_parser().parse_args(argv)
    except SystemExit as ended:  # argparse has said what is wrong, or helped
        if ended.code:
            word = Outcome.REFUSED.word
            print(json.dumps({"outcome": word}) if "--json" in (argv or sys.argv) else word)
        raise
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")  # before numpy is imported: times are of one core, --jobs uses the others
    sys.path.append(os.getcwd())  # a user's own method, as module:Class, may lie where they work
    try:
        outcome: Outcome = args.action(args)
        sys.stdout.flush()
    except HarnessError as error:
        print(f"harness: {error}", file=sys.stderr)
        outcome = error.outcome
        if args.json:
            print(json.dumps({"outcome": outcome.word, "error": str(error)}))
    except BrokenPipeError:  # the reader of our output went away, as `| head` does
        _print_no_more()
        return Outcome.PASS.exit_code
    except (KeyboardInterrupt, Exception) as error:
        if not was_interrupted(error):
            raise
        outcome = Outcome.PASS if args.endless else Outcome.INTERRUPTED
        kept = "" if args.endless else "; what was finished is kept, the same command goes on from there"
        print(f"harness: stopped{kept}", file=sys.stderr)
        if args.json:
            print(json.dumps({"outcome": outcome.word}))
    if not args.json:
        try:
            print(outcome.word, flush=True)
        except BrokenPipeError:
            _print_no_more()
    return outcome.exit_code


def _print_no_more() -> None:
    """Python flushes stdout once more when it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def build_parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="harness",
        description="Judges systems that turn a few body-worn 6-DOF trackers into full-body motion.",
        epilog="Exit codes: 0 pass, 1 regressed, 2 refused, 3 not comparable, 4 incomplete, 130 interrupted.",
    )
    parser.add_argument("--version", action="version", version=f"harness {__version__}")
    verbs = parser.add_subparsers(title="verbs", metavar="VERB", required=True)
    for add in (
        run.add_demo,
        run.add_run,
        check.add_list,
        mocap.add_inspect,
        mocap.add_mocap,
        run.add_export,
        run.add_report,
        check.add_check,
        check.add_bench,
        check.add_doctor,
        calibrate.add_calibrate,
        emulate.add_emulate,
        live.add_live,
        record.add_record,
        record.add_replay,
        paper.add_paper,
        sweep.add_sweep,
        sweep.add_status,
        placement.add_placement,
        compare.add_compare,
        compare.add_baseline,
    ):
        add(verbs)
    return parser


if __name__ == "__main__":
    sys.exit(main())
