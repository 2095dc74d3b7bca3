"""The verb `compare`: tell whether one result is worse than another."""

import argparse
from pathlib import Path

from harness.commands.flags import Verbs, add_verb, split_list
from harness.commands.output import print_result, record_content, this_words
from harness.core.progress import show_steps
from harness.errors import BadInput, Outcome

_SIDE_HELP = "the folder of a run, sweep or baseline, or the name of a baseline"
_EVERYTHING = "everything"


def add_compare(verbs: Verbs) -> None:
    text = "tell whether result B is worse than A, or one method worse than another"
    verb = add_verb(verbs, "compare", text, run_compare)
    verb.add_argument("a", metavar="A", help=f"reference: {_SIDE_HELP}")
    verb.add_argument("b", metavar="B", nargs="?", help="result to compare with A (default: A itself, with --methods)")
    text = "compare method A of result A with method B of result B; one name: the same method of both"
    verb.add_argument("--methods", metavar="A,B", help=text)
    verb.add_argument("--metrics", metavar="M,N", help="metrics that decide the outcome (see `harness list`)")
    text = "let these conditions, `coverage` or `cells` (without a partner) differ; without names, everything"
    verb.add_argument("--allow", metavar="NAME,NAME", nargs="?", const=_EVERYTHING, help=text)
    verb.add_argument("--html", metavar="FILE", type=Path, help="also write a page that shows every clip")


def run_compare(args: argparse.Namespace) -> Outcome:
    from harness.compare import compare_runs
    from harness.report.comparison.page import comparison_text, write_comparison_page

    if args.b is None and not args.methods:
        raise BadInput(f"{args.a} alone.", "Name two results, or two methods of one with --methods a,b.")
    methods = split_list(args.methods)
    if len(methods) > 2:
        raise BadInput(f"--methods {args.methods} names {len(methods)} methods.", "Name one or two.")
    comparison = compare_runs(
        args.a,
        args.b,
        methods=(methods[0], methods[-1]) if methods else None,
        metrics=split_list(args.metrics) or None,
        allow=split_list(args.allow) if args.allow else None,
    )
    with show_steps("parts of the report"):
        page = write_comparison_page(comparison, args.html) if args.html else None
    lines = [comparison_text(comparison), *([f"page: {page}"] if page else [])]
    following = () if page else (*this_words(), "--html", "comparison.html")
    return print_result(
        args, record_content(comparison, page=page), *lines, outcome=comparison.outcome, following=following
    )
