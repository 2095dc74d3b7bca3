"""The verb `report`: write the page and plots of finished work again."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from harness.commands.flags import Verbs, add_verb, output_file, split_list
from harness.commands.output import print_result
from harness.core.progress import show_steps
from harness.errors import BadInput, Outcome


def add_report(verbs: Verbs) -> None:
    verb = add_verb(
        verbs, "report", "write the report page of a finished run, sweep, placement study or paper again", run_report
    )
    verb.add_argument("run", type=Path, help="folder written by `harness run`, `sweep`, `placement` or `paper`")
    text = "also replace the table of this run, or the tables of this paper, in a page such as README.md"
    verb.add_argument("--readme", type=output_file, metavar="FILE", help=text)
    verb.add_argument("--methods", metavar="A,B", help="methods in the table of a run that --readme writes")


def run_report(args: argparse.Namespace) -> Outcome:
    from harness.report.kit import read_page
    from harness.results.files import require_kind

    kind = require_kind(args.run, "run", "sweep", "placement", "paper")
    if args.readme:
        require_kind(args.run, "run", "paper")
    if args.methods and not args.readme:
        raise BadInput("--methods without --readme.", "The page has all methods; name the file of the table.")
    if args.methods:
        require_kind(args.run, "run")
    if args.readme:
        read_page(args.readme)  # before a page that takes long
    if kind != "run":
        return {"sweep": _report_sweep, "placement": _report_placement, "paper": _report_paper}[kind](args)
    from harness.report.run.losses import loss_sentence
    from harness.report.run.page import write_run_page

    with show_steps("parts of the report"):
        page, why = write_run_page(args.run), loss_sentence(args.run)
    if args.readme:
        from harness.report.figures.performer_table import update_readme

        update_readme(args.readme, args.run, split_list(args.methods))
    return _print_page(args, page, why, following=["plot", args.run, "--kind", "ranking"])


def _report_sweep(args: argparse.Namespace) -> Outcome:
    from harness.report.sweep.page import write_sweep_page
    from harness.results.files import check_cells

    check_cells(args.run)
    with show_steps("parts of the report"):
        page = write_sweep_page(args.run)
    return print_result(args, {"report": str(page)}, f"report: {page}")


def _report_placement(args: argparse.Namespace) -> Outcome:
    from harness.report.placement.page import write_placement_page

    with show_steps("parts of the report"):
        page = write_placement_page(args.run)
    return print_result(args, {"report": str(page)}, f"report: {page}", following=["plot", args.run])


def _report_paper(args: argparse.Namespace) -> Outcome:
    from harness.report.paper.page import update_readme, write_paper_page
    from harness.results.files import FINDINGS
    from harness.results.findings import read_findings

    with show_steps("parts of the report"):
        page = write_paper_page(args.run)
    if args.readme:
        update_readme(args.readme, read_findings(args.run / FINDINGS))
    return _print_page(args, page)


def _print_page(args: argparse.Namespace, page: Path, why: str = "", following: Sequence[object] = ()) -> Outcome:
    """Print the page that was written, why a method loses, and the page with tables that was updated."""
    lines = [*filter(None, [why]), f"report: {page}", *([f"tables: {args.readme}"] if args.readme else [])]
    content = {"report": str(page), "readme": args.readme and str(args.readme)}
    return print_result(args, content, *lines, following=following)
