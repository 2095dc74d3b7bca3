"""Verbs about runs: make one, write its report again, hand its motion to other programs."""

import argparse
import json
import shlex
import sys
from contextlib import redirect_stdout
from pathlib import Path

from harness.commands.common import Verbs, add_verb, print_result
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome


def add_demo(verbs: Verbs) -> None:
    text = "run the main job on built-in motion and write its report"
    verb = add_verb(verbs, "demo", text, run_scenario, "seed", "out", "jobs")
    verb.set_defaults(scenario="demo", mocap=None, methods=None, movie=False, report=True, jobs=2)


def add_run(verbs: Verbs) -> None:
    text = "run a scenario: every test clip, every method; resumes what was interrupted"
    verb = add_verb(verbs, "run", text, run_scenario, "seed", "out", "jobs", "mocap")
    verb.add_argument("scenario", help="a TOML file, or the name of a shipped one (see `harness list`)")
    text = "replaces the scenario's methods, such as ik,best_match+ik,my_module:MyMethod[option=3]"
    verb.add_argument("--methods", metavar="A,B", help=text)
    verb.add_argument("--movie", action="store_true", help="also write an mp4 of the worst cell of each method")
    verb.add_argument("--no-report", dest="report", action="store_false", help="leave out report.html and plots")


def run_scenario(args: argparse.Namespace) -> Outcome:
    from dataclasses import replace

    from harness.core.options import expand_alternatives, split_outside_brackets
    from harness.experiment import engine
    from harness.experiment.scenario import check_scenario, load_scenario
    from harness.report.run.text import run_table

    scenario = load_scenario(args.scenario)
    if args.seed is not None:
        scenario = replace(scenario, seed=args.seed)
    if args.methods is not None:
        named = (name for text in split_outside_brackets(args.methods, ",") for name in expand_alternatives(text))
        scenario = replace(scenario, methods=tuple(named))
        check_scenario(args.scenario, scenario)
    out = args.out or Path("results") / scenario.name
    with ProgressBar("cells") as bar, redirect_stdout(sys.stderr):  # what a method prints is talk
        outcome = engine.run(scenario, out, folder=args.mocap, jobs=args.jobs, command=this_command(), progress=bar)
    page = None
    if args.report:
        from harness.report.run.writer import write_run_page

        print("writing the report", file=sys.stderr)
        with ProgressBar("movies") as bar:
            page = write_run_page(out, movie=args.movie, progress=bar)
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    content = {**summary, "out": str(out), "report": page and str(page)}
    return print_result(
        args, content, run_table(summary), f"report: {page}" if page else f"results: {out}", outcome=outcome
    )


def this_command() -> str:
    """The command as typed, to print where it can be copied."""
    return shlex.join(["harness", *sys.argv[1:]])


def add_report(verbs: Verbs) -> None:
    verb = add_verb(
        verbs, "report", "write the page and plots of a finished run, sweep, study or paper again", run_report
    )
    verb.add_argument("run", type=Path, help="folder written by `harness run`, `sweep`, `placement` or `paper`")
    verb.add_argument(
        "--movie", action="store_true", help="also write an mp4 of the worst cell of each method of a run"
    )
    text = "also put the tables of a paper into this page, such as results/README.md, for those that stand there"
    verb.add_argument("--readme", type=Path, metavar="FILE", help=text)


def run_report(args: argparse.Namespace) -> Outcome:
    from harness.report.paper.writer import FINDINGS
    from harness.results.storage import read_kind

    if (args.run / FINDINGS).is_file():
        return _report_findings(args)
    if args.readme:
        raise BadInput(
            f"--readme with {args.run}, where no {FINDINGS} is.", "Name the folder that `harness paper` wrote."
        )
    if read_kind(args.run) == "sweep":
        return _report_sweep(args)
    from harness.report.run.writer import write_run_page

    with ProgressBar("movies") as bar:
        page = write_run_page(args.run, movie=args.movie, progress=bar)
    return print_result(args, {"report": str(page)}, f"report: {page}")


def _report_sweep(args: argparse.Namespace) -> Outcome:
    from harness.report.sweep.page import write_sweep_page

    if args.movie:
        raise BadInput(f"--movie with {args.run}, a sweep.", "Movies are made of the runs of `harness run`.")
    page = write_sweep_page(args.run)
    return print_result(args, {"report": str(page)}, f"report: {page}")


def _report_findings(args: argparse.Namespace) -> Outcome:
    from harness.report.paper.writer import FINDINGS
    from harness.report.placement.writer import write_placement_page
    from harness.results.placement_findings import is_placement_findings

    if not is_placement_findings(args.run / FINDINGS):
        return _report_paper(args)
    if args.movie or args.readme:
        raise BadInput(f"--movie or --readme with {args.run}, a placement study.", "They are of runs and of papers.")
    page = write_placement_page(args.run)
    return print_result(args, {"report": str(page)}, f"report: {page}")


def _report_paper(args: argparse.Namespace) -> Outcome:
    from harness.report.paper.readme import update_readme
    from harness.report.paper.writer import FINDINGS, write_paper_page
    from harness.results.findings import read_findings

    if args.movie:
        raise BadInput("--movie with a paper's folder.", "Movies are made of its runs: name the folder of one.")
    page = write_paper_page(args.run)
    if args.readme:
        update_readme(args.readme, read_findings(args.run / FINDINGS))
    lines = [f"report: {page}", *([f"tables: {args.readme}"] if args.readme else [])]
    return print_result(args, {"report": str(page), "readme": args.readme and str(args.readme)}, *lines)


def add_export(verbs: Verbs) -> None:
    verb = add_verb(verbs, "export", "write truth and estimates of a run for other programs", run_export, "out")
    verb.add_argument("run", type=Path, help="folder written by `harness run`")
    verb.add_argument("--format", required=True, choices=["bvh", "trc", "csv", "tum"])
    verb.add_argument("--force", action="store_true", help="write over files that exist")


def run_export(args: argparse.Namespace) -> Outcome:
    from harness.mocap.write.export import export
    from harness.results.storage import read_cells

    folder = args.out or args.run / "export" / args.format
    files = export(read_cells(args.run), args.format, folder, force=args.force)
    return print_result(args, {"files": [str(f) for f in files]}, f"{len(files)} files in {folder}")
