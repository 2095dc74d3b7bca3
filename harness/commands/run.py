"""The verb `run`: run a scenario and write its report."""

import argparse

from harness.commands.flags import Verbs, add_isolation_flags, add_verb, folder_of, parse_methods, read_isolation
from harness.commands.output import long_work, print_result, print_status, this_command
from harness.core.progress import show_steps
from harness.errors import Outcome

EVERY_METHOD = "all"
"""In `--methods`: the scenario's methods, and all others that are installed."""


def add_run(verbs: Verbs) -> None:
    text = "run a scenario: every test clip with every method; the same command resumes an interrupted run"
    verb = add_verb(verbs, "run", text, run_scenario, "seed", "out", "jobs", "mocap")
    verb.add_argument("scenario", help="a TOML file, or the name of a shipped one (see `harness list`)")
    add_methods_flag(verb)
    add_isolation_flags(verb)
    add_all_flag(verb)
    verb.add_argument("--no-report", dest="report", action="store_false", help="write no report.html and no plots")


def add_methods_flag(verb: argparse.ArgumentParser) -> None:
    """Add `--methods`, for other methods than the scenario's."""
    text = "methods instead of the scenario's, such as ik,best_match+ik,my_module:MyMethod[option=3]; all adds the rest"
    verb.add_argument("--methods", metavar="A,B", help=text)


def add_all_flag(verb: argparse.ArgumentParser) -> None:
    """Add `--all`, for the whole table of a run."""
    text = "print a row for each behaviour and method; without it, at most 12 rows"
    verb.add_argument("--all", action="store_true", help=text)


def run_scenario(args: argparse.Namespace) -> Outcome:
    from dataclasses import replace

    from harness.experiment import run
    from harness.experiment.scenarios import check_scenario, load_scenario
    from harness.report.run.losses import loss_sentence
    from harness.report.run.text import run_table
    from harness.results import read_summary

    scenario = load_scenario(args.scenario)
    if args.seed is not None:
        scenario = replace(scenario, seed=args.seed)
    if args.methods is not None:
        scenario = replace(scenario, methods=_named_methods(args.methods, scenario.methods))
        check_scenario(args.scenario, scenario)
    out = folder_of(args, scenario.name)
    with long_work(out, "cells") as bar:
        outcome = run(
            scenario,
            out,
            folder=args.mocap,
            jobs=args.jobs,
            command=this_command(),
            progress=bar,
            isolation=read_isolation(args),
        )
    page = None
    if args.report:
        from harness.report.run.page import write_run_page

        print_status("writing the report")
        with show_steps("parts of the report"):
            page = write_run_page(out)
    summary = read_summary(out)
    content = {**summary, "out": str(out), "report": page and str(page)}
    return print_result(
        args,
        content,
        run_table(summary, short=not args.all),
        *filter(None, [loss_sentence(out)]),
        f"report: {page}" if page else f"results: {out}",
        outcome=outcome,
        following=["view", out] if outcome is Outcome.PASS else ["status", out],
    )


def _named_methods(text: str, own: tuple[str, ...]) -> tuple[str, ...]:
    """The methods that `--methods` names; `all` stands for the scenario's `own` and the others that are installed."""
    from harness.reconstruct import list_methods

    named = parse_methods(text)
    if EVERY_METHOD not in named:
        return named
    every = (*own, *list_methods())
    return tuple(dict.fromkeys(each for name in named for each in (every if name == EVERY_METHOD else (name,))))
