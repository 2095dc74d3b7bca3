"""The verb `compare`: tell whether one result is worse than another."""

import argparse

from harness.commands.flags import Verbs, add_verb, output_file, split_list
from harness.commands.output import print_result, record_content, this_words
from harness.core.progress import show_steps
from harness.errors import Outcome

_SIDE_HELP = "the folder of a run, sweep or baseline, or the name of a baseline"
_EVERYTHING = "everything"


def add_compare(verbs: Verbs) -> None:
    text = "tell whether result B is worse than A, or one method worse than another"
    verb = add_verb(verbs, "compare", text, run_compare)
    text = f"{_SIDE_HELP}; NAME=A names it. The first is the reference. One alone: compare its --methods"
    verb.add_argument("sides", metavar="A", nargs="+", help=text)
    verb.add_argument("--reference", metavar="NAME", help="compare the others with this side instead of the first")
    text = "compare method A of result A with method B of result B; one name: the same method of all results"
    verb.add_argument("--methods", metavar="A,B", help=text)
    verb.add_argument("--metrics", metavar="M,N", help="metrics that decide the outcome (see `harness list`)")
    text = "let these conditions, `coverage` or `cells` (without a partner) differ; without names, everything"
    verb.add_argument("--allow", metavar="NAME,NAME", nargs="?", const=_EVERYTHING, help=text)
    verb.add_argument("--html", metavar="FILE", type=output_file, help="also write a page that shows every clip")


def run_compare(args: argparse.Namespace) -> Outcome:
    from harness.compare import compare_sides, name_sides
    from harness.report.comparison.page import comparison_text, write_comparison_page
    from harness.report.comparison.set_page import set_text, write_set_page
    from harness.report.kit import check_page_place

    methods = split_list(args.methods)
    if args.html:
        check_page_place(args.html)
    found = compare_sides(
        name_sides(args.sides, shorten=len(args.sides) > 2),
        reference=args.reference,
        methods=methods,
        metrics=split_list(args.metrics) or None,
        allow=split_list(args.allow) if args.allow else None,
    )
    with show_steps("parts of the report"):
        if len(found.comparisons) == 1:
            (comparison,) = found.comparisons
            page, text = args.html and write_comparison_page(comparison, args.html), comparison_text(comparison)
            content = record_content(comparison, page=page)
        else:
            page, text = args.html and write_set_page(found, args.html), set_text(found)
            each = [{**record_content(one), "outcome": one.outcome.word} for one in found.comparisons]
            content = {**record_content(found, page=page), "comparisons": each}
    lines = [text, *([f"page: {page}"] if page else [])]
    following = () if page else (*this_words(), "--html", "comparison.html")
    return print_result(args, content, *lines, outcome=found.outcome, following=following)
