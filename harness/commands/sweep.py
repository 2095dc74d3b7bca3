"""The verb `sweep`: run many scenarios, clips, methods, seeds and values."""

import argparse
import os
import shlex
import sys
from contextlib import ExitStack
from pathlib import Path

from harness.commands.flags import (
    Verbs,
    add_isolation_flags,
    add_verb,
    folder_of,
    process_count,
    read_isolation,
    repeat_flags,
)
from harness.commands.output import long_work, print_result
from harness.core.progress import show_steps
from harness.errors import BadInput, Outcome

_DEFAULT_CLUSTER_WORKERS = 64
"""Number of workers that cells are planned for when a scheduler's workers may come and go."""


def add_sweep(verbs: Verbs) -> None:
    text = "run scenarios x clips x methods x seeds x values; the same command resumes an interrupted sweep"
    verb = add_verb(verbs, "sweep", text, run_sweep, "out", "mocap")
    verb.add_argument("sweep", help="a TOML file, or the name of a shipped one (see `harness list`)")
    verb.add_argument("--seed", type=int, help="one seed instead of the sweep's")
    verb.add_argument("--jobs", type=process_count, metavar="N", help="worker processes (default 1)")
    text = "run on the workers of the Dask scheduler at ADDRESS, or on a local cluster: `local`"
    verb.add_argument("--dask", metavar="ADDRESS", help=text)
    add_isolation_flags(verb)
    text = "run only this cell, named as `harness status` prints it, and print why it fails"
    verb.add_argument("--cell", metavar="NAME", default="", help=text)


def run_sweep(args: argparse.Namespace) -> Outcome:
    from harness.experiment import run_sweep as run
    from harness.experiment.scenarios import expand_sweep, load_sweep
    from harness.experiment.workers import dask_executor, process_executor
    from harness.report.sweep.data import read_sweep
    from harness.report.sweep.page import sweep_text, write_sweep_page
    from harness.results.files import read_summary_json

    if args.dask and args.jobs and args.dask != "local":
        raise BadInput("--jobs with --dask.", "The scheduler has workers of its own: leave --jobs out.")
    sweep, path = load_sweep(args.sweep)
    scenarios = expand_sweep(sweep, path, args.seed, args.mocap)
    out = folder_of(args, sweep.name)
    with ExitStack() as stack:
        bar = stack.enter_context(long_work(out, "cells"))
        workers = args.jobs or {None: 1, "local": os.cpu_count() or 1}.get(args.dask, _DEFAULT_CLUSTER_WORKERS)
        executor = dask_executor(args.dask, args.jobs) if args.dask else process_executor(workers)
        outcome = run(
            sweep,
            scenarios,
            out,
            folder=args.mocap,
            executor=stack.enter_context(executor),
            workers=workers,
            command=_resume_command(args, out),
            only=args.cell,
            progress=bar,
            isolation=read_isolation(args),
        )
    summary = read_summary_json(out)
    if args.cell in summary["failures"]:
        print(summary["failures"][args.cell], file=sys.stderr)
    with show_steps("parts of the report"):
        page = write_sweep_page(out)
    notes = [summary["line_loss"]] if "line_loss" in summary else []
    files = (*notes, f"table: {out / 'summary.csv'}", f"report: {page}")
    following = [] if outcome is Outcome.PASS else ["status", out]
    content = {**summary, "out": str(out), "report": str(page)}
    return print_result(args, content, sweep_text(read_sweep(out)), *files, outcome=outcome, following=following)


def _resume_command(args: argparse.Namespace, out: Path) -> str:
    """The command that resumes the sweep, also in a folder whose cells were computed elsewhere."""
    flags = repeat_flags(args, "mocap", "isolate", "time_limit", "memory_limit", "seed")
    return shlex.join(["harness", "sweep", args.sweep, "--out", str(out), *flags])
