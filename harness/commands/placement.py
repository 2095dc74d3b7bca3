"""The verb `placement`: find out how many stations to wear, and where."""

import argparse
import sys
from contextlib import redirect_stdout
from pathlib import Path

from harness.commands.common import Verbs, add_verb, positive_int, print_result, progress_note, this_command
from harness.core.progress import ProgressBar
from harness.errors import Outcome


def add_placement(verbs: Verbs) -> None:
    text = "rank sets of stations: how many to wear, and where; the same command resumes"
    verb = add_verb(verbs, "placement", text, run_placement, "out", "mocap")
    verb.add_argument("study", help="a TOML file, or the name of a shipped one, such as walking")
    text = "clips computed at the same time (default 2)"
    verb.add_argument("--jobs", type=positive_int, default=2, metavar="N", help=text)


def run_placement(args: argparse.Namespace) -> Outcome:
    from dataclasses import asdict

    from harness.core.files import to_json_types
    from harness.experiment.executors import process_executor
    from harness.report.placement.text import text
    from harness.report.placement.writer import write_placement_page
    from harness.study.placement.placement_study import FINDINGS, run_placement

    out = args.out or Path("results") / f"placement_{Path(args.study).stem.removeprefix('placement_')}"
    with (
        progress_note(out),
        ProgressBar("cells") as bar,
        redirect_stdout(sys.stderr),  # a method may print; stdout is for data
        process_executor(args.jobs) as each,
    ):
        findings, outcome = run_placement(
            args.study, out, folder=args.mocap, executor=each, command=this_command(), progress=bar
        )
    page = write_placement_page(out)
    content = {**to_json_types(asdict(findings)), "out": str(out), "report": str(page)}
    lines = (text(findings), "", f"findings: {out / FINDINGS}", f"report: {page}")
    return print_result(args, content, *lines, outcome=outcome)
