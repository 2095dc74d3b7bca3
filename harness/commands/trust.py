"""The verb `trust`: tell whether the simulation ranks methods as a device does."""

import argparse
from pathlib import Path

from harness.commands.flags import Verbs, add_verb, folder_of, process_count
from harness.commands.output import long_work, print_result, record_content, this_command
from harness.core.progress import show_steps
from harness.errors import Outcome


def add_trust(verbs: Verbs) -> None:
    text = "tell whether the fitted simulation ranks methods as a device does; the same command resumes"
    verb = add_verb(verbs, "trust", text, run_trust, "out", "mocap")
    verb.add_argument("plan", type=Path, help="plan in TOML: methods, sets of stations, metrics with margins")
    text = "recordings of the device or of its poses that `harness record --plan` made, one for each clip or more"
    verb.add_argument("captures", type=Path, nargs="+", metavar="CAPTURE", help=text)
    text = "clip of each capture, in their order (default: the clip that the capture names)"
    verb.add_argument("--truth", nargs="+", default=(), metavar="CLIP", help=text)
    text = "also use captures of another plan, or of none; the result then confirms nothing"
    verb.add_argument("--exploratory", action="store_true", help=text)
    text = "captures computed at the same time (default 1)"
    verb.add_argument("--jobs", type=process_count, default=1, metavar="N", help=text)


def run_trust(args: argparse.Namespace) -> Outcome:
    from harness.experiment.workers import process_executor
    from harness.report.kit import render_text, write_page
    from harness.report.lab.trust_page import trust_page
    from harness.study.trust.trust_study import run_trust_study

    out = folder_of(args, f"trust_{args.plan.stem}")
    with long_work(out, "captures") as bar, process_executor(args.jobs) as executor:
        study = run_trust_study(
            args.plan,
            args.captures,
            out,
            clips=args.truth,
            folder=args.mocap,
            exploratory=args.exploratory,
            executor=executor,
            progress=bar,
        )
    page = trust_page(study.findings, this_command())
    with show_steps("parts of the report"):
        report = write_page(page, out / "report.html")
    content = record_content(study.findings, out=out, report=report)
    return print_result(args, content, render_text(page), "", f"report: {report}", outcome=study.findings.outcome)
