"""The command line: a verb parses, calls one library function, and prints. Data goes to stdout, talk to stderr."""

import argparse
import json
import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from harness.commands.baseline import add_baseline
from harness.commands.bench import add_bench
from harness.commands.calibrate import add_calibrate
from harness.commands.check import add_check
from harness.commands.compare import add_compare
from harness.commands.demo import add_demo
from harness.commands.doctor import add_doctor
from harness.commands.emulate import add_emulate
from harness.commands.export import add_export
from harness.commands.inspect import add_inspect
from harness.commands.list import add_list
from harness.commands.live import add_live
from harness.commands.mocap import add_mocap
from harness.commands.paper import add_paper
from harness.commands.placement import add_placement
from harness.commands.record import add_record
from harness.commands.replay import add_replay
from harness.commands.report import add_report
from harness.commands.run import add_run
from harness.commands.status import add_status
from harness.commands.sweep import add_sweep
from harness.core.names import check_command_line, check_words, excerpt
from harness.core.package_data import VERSION
from harness.errors import HarnessError, Outcome, was_interrupted

_VERB_GROUPS: dict[str, tuple[Callable[[Any], None], ...]] = {
    "first steps": (add_demo, add_list, add_doctor, add_mocap, add_inspect),
    "if you change an algorithm": (
        add_check,
        add_run,
        add_report,
        add_export,
        add_baseline,
        add_compare,
        add_sweep,
        add_status,
        add_bench,
        add_paper,
    ),
    "if you place sensors": (add_placement,),
    "if you have a device": (add_emulate, add_record, add_replay, add_calibrate, add_live),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return its exit code (see `harness.errors.Outcome`)."""
    try:
        args = build_parser().parse_args(argv)
    except SystemExit as ended:  # argparse has printed the help or its complaint
        if ended.code:
            word = Outcome.REFUSED.word
            print(json.dumps({"outcome": word}) if "--json" in (argv or sys.argv) else word)
        raise
    for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")  # before numpy is imported: times are of one core, --jobs uses the others
    sys.path.append(os.getcwd())  # a user's own method, as module:Class, may lie in the working directory
    os.environ["PYTHONSAFEPATH"] = "1"  # children import nothing from the working folder; MuJoCo starts one too
    try:
        check_command_line(sys.argv[1:] if argv is None else argv)
        check_words(list(vars(args).values()))
        outcome: Outcome = args.action(args)
        sys.stdout.flush()
    except HarnessError as error:
        print(f"harness: {excerpt(error)}", file=sys.stderr)
        outcome = error.outcome
        if args.json:
            print(json.dumps({"outcome": outcome.word, "error": excerpt(error)}))
    except BrokenPipeError:  # the reader of stdout went away, as `| head` does
        _discard_stdout()
        return Outcome.PASS.exit_code
    except (KeyboardInterrupt, Exception) as error:
        if not was_interrupted(error):
            raise
        outcome = Outcome.PASS if args.endless else Outcome.INTERRUPTED
        advice = "" if args.endless else "; finished work is kept, and the same command resumes"
        print(f"harness: stopped{advice}", file=sys.stderr)
        if args.json:
            print(json.dumps({"outcome": outcome.word}))
    if not args.json:
        try:
            print(outcome.word, flush=True)
        except BrokenPipeError:
            _discard_stdout()
    return outcome.exit_code


def _discard_stdout() -> None:
    """Send later output to the null device: Python flushes stdout once more when it exits."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@dataclass
class _VerbGroup:
    """Verbs that the help lists under one title; stands in for argparse's subparsers, which know no groups."""

    subparsers: Any
    summaries: dict[str, str] = field(default_factory=dict)
    """Verb -> its line in the help."""

    def add_parser(self, name: str, *, help: str, **options: Any) -> argparse.ArgumentParser:  # argparse's word
        """Add a verb, as `add_parser` of argparse's subparsers does."""
        self.summaries[name] = help
        parser: argparse.ArgumentParser = self.subparsers.add_parser(name, **options)
        return parser


def build_parser() -> argparse.ArgumentParser:
    """The parser of the command line, with every verb."""
    parser = argparse.ArgumentParser(
        prog="harness",
        usage="harness VERB ... (harness VERB --help explains a verb)",
        description="Measure how well body-worn 6-DOF trackers are turned into full-body motion.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"harness {VERSION}")
    subparsers = parser.add_subparsers(prog="harness", metavar="VERB", required=True, help=argparse.SUPPRESS)
    paragraphs = []
    for title, adders in _VERB_GROUPS.items():
        group = _VerbGroup(subparsers)
        for add in adders:
            add(group)
        paragraphs.append(_format_group(title, group.summaries))
    codes = ", ".join(f"{outcome.exit_code} {outcome.word}" for outcome in Outcome)
    parser.epilog = "\n\n".join([*paragraphs, f"Exit codes: {codes}."])
    return parser


def _format_group(title: str, summaries: dict[str, str]) -> str:
    """The title of a group and a line for each verb, wrapped to the terminal as argparse does it."""
    lines = [f"{title}:"]
    for verb, text in summaries.items():
        width = max(shutil.get_terminal_size().columns - 2, 40)
        lines += textwrap.wrap(
            text, width, initial_indent=f"  {verb:<11} ", subsequent_indent=" " * 14, break_on_hyphens=False
        )
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
