"""The verb `timeline`: show results of one scenario over commits or dates, and where they changed."""

import argparse

from harness.commands.flags import Verbs, add_verb, output_file, split_list
from harness.commands.output import print_result, record_content
from harness.core.progress import show_steps
from harness.errors import Outcome


def add_timeline(verbs: Verbs) -> None:
    text = "show results over commits or dates, and find where a method became better or worse"
    verb = add_verb(verbs, "timeline", text, run_timeline)
    text = "folder of a run or baseline, a folder that holds them, or name of a baseline; NAME=RUN names it"
    verb.add_argument("runs", metavar="RUN", nargs="+", help=text)
    verb.add_argument("--methods", metavar="A,B", help="methods to show (default: all)")
    verb.add_argument("--metrics", metavar="M,N", help="metrics to show (default: those that `harness compare` gates)")
    text = "commit, date (of the run) or given (default: commit, else date, where all results have different ones)"
    verb.add_argument("--order", metavar="ORDER", help=text)
    text = "page to write, with its comparisons in a folder beside it (default timeline.html)"
    verb.add_argument("--html", metavar="FILE", type=output_file, default="timeline.html", help=text)


def run_timeline(args: argparse.Namespace) -> Outcome:
    from harness.compare.timeline import build_timeline
    from harness.report.kit import check_page_place
    from harness.report.timeline.page import timeline_text, write_timeline_page

    check_page_place(args.html)
    metrics = split_list(args.metrics) or None
    with show_steps("results and parts of the page"):
        timeline = build_timeline(args.runs, order=args.order, methods=split_list(args.methods), metrics=metrics)
        page = write_timeline_page(timeline, args.html)
    lines = [timeline_text(timeline), f"page: {page}"]
    outcome = Outcome.PASS if timeline.series else Outcome.NOT_COMPARABLE
    return print_result(args, record_content(timeline, page=page), *lines, outcome=outcome)
