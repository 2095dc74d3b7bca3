"""The verb `table`: print the results of a run as a table for a paper."""

import argparse

from harness.commands.flags import Verbs, add_verb, output_file, repeat_flags, split_list
from harness.commands.output import print_result
from harness.errors import Outcome


def add_table(verbs: Verbs) -> None:
    text = "print the results of one run or several as a table for a paper: means with intervals"
    verb = add_verb(verbs, "table", text, run_table_verb)
    verb.set_defaults(prints_file=True)
    text = "folder of a run or baseline, or name of a baseline; of several each has a column, and NAME=RUN names it"
    verb.add_argument("runs", metavar="RUN", nargs="+", help=text)
    text = "latex (with booktabs), markdown or csv (default markdown)"
    verb.add_argument("--format", default="markdown", metavar="FORMAT", help=text)
    text = "metrics of the columns (default joint_angle_mean_deg,mpjpe_mm; see `harness list`)"
    verb.add_argument("--metrics", metavar="M,N", help=text)
    verb.add_argument("--methods", metavar="A,B", help="methods to show (default: all); only these are ranked")
    verb.add_argument("--condition", default="", metavar="NAME", help="condition to show, such as noise=clean")
    verb.add_argument("--by-behaviour", action="store_true", help="a row for each behaviour instead of all together")
    verb.add_argument("--out", type=output_file, metavar="FILE", help="file to write instead of printing")
    verb.add_argument("--force", action="store_true", help="replace a file that exists")


def run_table_verb(args: argparse.Namespace) -> Outcome:
    from dataclasses import asdict

    from harness.compare import name_sides
    from harness.report.figures.table import DEFAULT_METRICS
    from harness.report.figures.writer import write_results_table
    from harness.results.files import CELLS_FILE, find_results

    several, folder = len(args.runs) > 1, find_results(args.runs[0])
    written = write_results_table(
        name_sides(args.runs) if several else folder,
        args.format,
        metrics=split_list(args.metrics) or DEFAULT_METRICS,
        methods=split_list(args.methods),
        condition=args.condition,
        by_behaviour=args.by_behaviour,
        out=args.out,
        force=args.force,
    )
    content = {**asdict(written.table), "file": args.out and str(args.out)}
    line = written.text.removesuffix("\n") if args.out is None else f"table: {args.out}"
    metric = ["--metric", args.metrics.split(",")[0]] if args.metrics else []
    following = ["plot", args.runs[0], "--kind", "ranking", *metric, *repeat_flags(args, "methods", "condition")]
    if several:
        following = ["compare", *args.runs]
    elif (folder / CELLS_FILE).exists():  # no figure shows a baseline
        following = []
    return print_result(args, content, line, following=following)
