"""The verb `report`: write the page and plots of finished work again."""

import argparse
from pathlib import Path

from harness.commands.common import Verbs, add_verb, print_result
from harness.core.progress import ProgressBar, show_steps
from harness.errors import BadInput, Outcome


def add_report(verbs: Verbs) -> None:
    verb = add_verb(
        verbs, "report", "write the report page of a finished run, sweep, placement study or paper again", run_report
    )
    verb.add_argument("run", type=Path, help="folder written by `harness run`, `sweep`, `placement` or `paper`")
    verb.add_argument(
        "--movie", action="store_true", help="also write an mp4 of the worst cell of each method of a run"
    )
    text = "also replace the tables of a paper that this page shows, such as results/README.md"
    verb.add_argument("--readme", type=Path, metavar="FILE", help=text)


def run_report(args: argparse.Namespace) -> Outcome:
    from harness.report.paper.writer import FINDINGS
    from harness.results.storage import read_kind

    if (args.run / FINDINGS).exists():
        return _report_findings(args)
    if args.readme:
        raise BadInput(
            f"--readme with {args.run}, where no {FINDINGS} is.", "Name the folder that `harness paper` wrote."
        )
    if read_kind(args.run) == "sweep":
        return _report_sweep(args)
    from harness.report.run.writer import write_run_page

    with show_steps("parts of the report"), ProgressBar("movies") as bar:
        page = write_run_page(args.run, movie=args.movie, progress=bar)
    return print_result(
        args, {"report": str(page)}, f"report: {page}", following=["plot", args.run, "--kind", "ranking"]
    )


def _report_sweep(args: argparse.Namespace) -> Outcome:
    from harness.report.sweep.page import write_sweep_page
    from harness.results.integrity import check_cells

    if args.movie:
        raise BadInput(
            f"--movie with {args.run}, a sweep.", "Movies show cells of a run: name the folder of `harness run`."
        )
    check_cells(args.run)
    with show_steps("parts of the report"):
        page = write_sweep_page(args.run)
    return print_result(args, {"report": str(page)}, f"report: {page}")


def _report_findings(args: argparse.Namespace) -> Outcome:
    from harness.report.paper.writer import FINDINGS
    from harness.report.placement.writer import write_placement_page
    from harness.results.placement_findings import is_placement_findings

    if not is_placement_findings(args.run / FINDINGS):
        return _report_paper(args)
    if args.movie or args.readme:
        raise BadInput(
            f"--movie or --readme with {args.run}, a placement study.",
            "--movie is for runs, --readme for papers: leave it out.",
        )
    with show_steps("parts of the report"):
        page = write_placement_page(args.run)
    return print_result(args, {"report": str(page)}, f"report: {page}", following=["plot", args.run])


def _report_paper(args: argparse.Namespace) -> Outcome:
    from harness.report.paper.readme import update_readme
    from harness.report.paper.writer import FINDINGS, write_paper_page
    from harness.results.findings import read_findings

    if args.movie:
        raise BadInput(
            "--movie with a paper's folder.", "Movies show cells of a run: name the folder of one of its runs."
        )
    with show_steps("parts of the report"):
        page = write_paper_page(args.run)
    if args.readme:
        update_readme(args.readme, read_findings(args.run / FINDINGS))
    lines = [f"report: {page}", *([f"tables: {args.readme}"] if args.readme else [])]
    return print_result(args, {"report": str(page), "readme": args.readme and str(args.readme)}, *lines)
