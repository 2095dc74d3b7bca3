"""The verb `paper`: rerun the experiments of a paper."""

import argparse

from harness.commands.flags import Verbs, add_mocap_flag, add_verb, folder_of, process_count
from harness.commands.output import long_work, print_result, record_content, this_command, this_words
from harness.core.progress import show_steps
from harness.errors import Outcome


def add_paper(verbs: Verbs) -> None:
    text = "rerun every experiment of a paper and compare it with the published figures; resumes"
    verb = add_verb(verbs, "paper", text, run_paper, "out")
    verb.add_argument("paper", choices=["liu2011", "kim2012"], help="Liu et al. 2011; Kim, Seol and Lee 2012")
    text = "use the real motion in this folder; may be repeated (default: synthetic motion)"
    add_mocap_flag(verb, text)
    text = "two short clips of each kind: shows in minutes that everything works; too few to compare methods"
    verb.add_argument("--quick", action="store_true", help=text)
    text = "run this experiment alone; may be repeated (docs/papers.md lists them)"
    verb.add_argument("--only", action="append", metavar="EXPERIMENT", help=text)
    verb.add_argument("--seed", type=int, default=1, help="seed of all runs (default 1)")
    text = "clips computed at the same time (default 2)"
    verb.add_argument("--jobs", type=process_count, default=2, metavar="N", help=text)


def run_paper(args: argparse.Namespace) -> Outcome:
    from harness.report.paper.page import paper_text, write_paper_page
    from harness.study.papers.paper import load_paper, reproduce

    paper = load_paper(args.paper)
    paper = paper.only(args.only) if args.only else paper
    form = ("_cmu" if args.mocap else "") + ("_quick" if args.quick else "")
    out = folder_of(args, args.paper + form)
    with long_work(out, "steps") as bar:
        findings, outcome = reproduce(
            paper,
            out,
            library=args.mocap,
            seed=args.seed,
            jobs=args.jobs,
            quick=args.quick,
            command=this_command(),
            progress=bar,
        )
    with show_steps("parts of the report"):
        page = write_paper_page(out)
    content = record_content(findings, out=out, report=page)
    following = [] if outcome is Outcome.PASS else [*this_words()]
    lines = (paper_text(findings), "", f"findings: {out / 'findings.json'}", f"report: {page}")
    return print_result(args, content, *lines, outcome=outcome, following=following)
