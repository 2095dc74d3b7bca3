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
from harness.commands.characterize import add_characterize
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
from harness.commands.output import announce, describe_ending, print_last
from harness.commands.paper import add_paper
from harness.commands.placement import add_placement
from harness.commands.plot import add_plot
from harness.commands.record import add_record
from harness.commands.replay import add_replay
from harness.commands.report import add_report
from harness.commands.run import add_run
from harness.commands.status import add_status
from harness.commands.sweep import add_sweep
from harness.commands.table import add_table
from harness.commands.timeline import add_timeline
from harness.commands.trust import add_trust
from harness.commands.validate import add_validate
from harness.commands.verb_parser import VerbParser
from harness.commands.view import add_view
from harness.core.cache_folder import MACHINE_CODE, cache_folder
from harness.core.interrupts import accept_interrupts, hold_interrupts
from harness.core.package_data import VERSION
from harness.core.ranges import check_command_line, check_words
from harness.core.working_folder import THREAD_VARIABLES, safe_import_path, serve_folder
from harness.errors import Outcome, SystemFault

_VERB_GROUPS: dict[str, tuple[Callable[[Any], None], ...]] = {
    "first steps": (add_demo, add_list, add_doctor, add_mocap, add_inspect, add_view),
    "if you change an algorithm": (
        add_check,
        add_run,
        add_report,
        add_plot,
        add_table,
        add_export,
        add_baseline,
        add_compare,
        add_timeline,
        add_sweep,
        add_status,
        add_bench,
        add_paper,
    ),
    "if you place sensors": (add_placement,),
    "if you have a device": (
        add_emulate,
        add_record,
        add_replay,
        add_calibrate,
        add_live,
        add_characterize,
        add_validate,
        add_trust,
    ),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one verb and return its exit code (see `harness.errors.Outcome`)."""
    words, content = list(sys.argv[1:] if argv is None else argv), None
    as_json, prints_file = "--json" in words, False
    with hold_interrupts():
        try:
            with accept_interrupts():
                args = build_parser().parse_args(words)
                as_json, prints_file = args.json, getattr(args, "prints_file", False)
                outcome = _run_verb(words, args)
        except SystemExit:  # argparse has printed the help
            sys.exit(print_last("", Outcome.PASS))
        except (KeyboardInterrupt, Exception) as error:
            outcome, content = describe_ending(words, error)
        if prints_file and not as_json:  # stdout is the content of a file
            print(outcome.word, file=sys.stderr)
            return outcome.exit_code
        if not as_json:
            return print_last(f"{outcome.word}\n", outcome)
        ended_early = content is not None  # else the verb has printed its JSON
        return print_last(
            json.dumps({"outcome": outcome.word, **(content or {})}) + "\n" if ended_early else "", outcome
        )


def _run_verb(words: Sequence[str], args: argparse.Namespace) -> Outcome:
    for variable in THREAD_VARIABLES:
        os.environ.setdefault(variable, "1")  # before numpy is imported
    try:
        serve_folder(os.getcwd())  # a user's own method, as module:Class, may lie in the working directory
    except OSError as error:
        raise SystemFault("The working directory no longer exists.", "Change to a folder that exists.") from error
    try:
        check_command_line(words)
        check_words(list(vars(args).values()))
        with safe_import_path():  # MuJoCo starts a process too
            compiled = (folder := cache_folder()) is not None and (folder / MACHINE_CODE).is_dir()
            announce(f"{words[0]}: loading" + ("" if compiled else " and compiling, which takes a minute once"))
            outcome: Outcome = args.action(args)
    except SystemExit as ended:  # of a method or a library: its code is none of ours
        raise RuntimeError(f"a part of the program asked to exit with {ended.code!r}") from ended
    return outcome


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
    parser = VerbParser(
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
