"""Verbs about sweeps: make one, and say how far the work in a folder is."""

import argparse
import os
import shlex
import sys
from contextlib import ExitStack, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.common import Verbs, add_verb, positive_int, print_result, sigterm_as_interrupt
from harness.core.progress import ProgressBar
from harness.errors import BadInput, Outcome

if TYPE_CHECKING:
    from harness.experiment.status import RunStatus

_MAX_FAILURES = 10
_DEFAULT_CLUSTER_WORKERS = 64
"""Workers for whom the cells are shared out when those of a scheduler may come and go."""


def add_sweep(verbs: Verbs) -> None:
    text = "run scenario x clip x method x seed x any value; resumes what was interrupted"
    verb = add_verb(verbs, "sweep", text, run_sweep, "out", "mocap")
    verb.add_argument("study", help="a TOML file, or the name of a shipped one (see `harness list`)")
    verb.add_argument("--seed", type=int, help="replaces all seeds of the sweep")
    verb.add_argument("--jobs", type=positive_int, metavar="N", help="worker processes (default 1)")
    text = "workers of the Dask scheduler at this address, or `local` for some of its own, instead of --jobs"
    verb.add_argument("--dask", metavar="ADDRESS", help=text)
    text = "make only the cell of this name, as `harness status` prints it, and print why it fails"
    verb.add_argument("--cell", metavar="NAME", default="", help=text)


def run_sweep(args: argparse.Namespace) -> Outcome:
    from harness.core.files import read_json
    from harness.experiment.engine import run_sweep as run
    from harness.experiment.executors import dask_executor, process_executor
    from harness.experiment.sweep_config import expand_sweep, load_sweep
    from harness.report.sweep.page import write_sweep_page
    from harness.report.sweep.reader import read_sweep
    from harness.report.sweep.text import text

    if args.dask and args.jobs and args.dask != "local":
        raise BadInput("--jobs with --dask.", "A scheduler's workers are started by whoever starts it: leave it out.")
    sweep, path = load_sweep(args.study)
    scenarios = expand_sweep(sweep, path, args.seed)
    out = args.out or Path("results") / sweep.name
    with ExitStack() as stack:
        stack.enter_context(sigterm_as_interrupt())
        bar = stack.enter_context(ProgressBar("cells"))
        stack.enter_context(redirect_stdout(sys.stderr))  # what a method prints is talk
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
        )
    summary = read_json(out / "summary.json", "the summary of a sweep")
    if args.cell in summary["failures"]:
        print(summary["failures"][args.cell], file=sys.stderr)
    page = write_sweep_page(out)
    files = (f"table: {out / 'summary.csv'}", f"report: {page}")
    content = {**summary, "out": str(out), "report": str(page)}
    return print_result(args, content, text(read_sweep(out)), *files, outcome=outcome)


def _resume_command(args: argparse.Namespace, out: Path) -> str:
    """The command that goes on with the sweep, wherever else its cells were made."""
    parts = ["harness", "sweep", args.study, "--out", str(out)]
    parts += [] if args.mocap is None else ["--mocap", str(args.mocap)]
    return shlex.join(parts if args.seed is None else [*parts, "--seed", str(args.seed)])


def add_status(verbs: Verbs) -> None:
    text = "say how far a sweep, a placement or a run is, also while it goes on"
    verb = add_verb(verbs, "status", text, run_status)
    verb.add_argument("folder", type=Path, metavar="DIR", help="folder that it writes")


def run_status(args: argparse.Namespace) -> Outcome:
    from harness.experiment.status import read_status

    found = read_status(args.folder)
    content = {
        "kind": found.kind,
        "name": found.name,
        "cells_planned": found.planned,
        "cells_finished": found.finished,
        "cells_failed": len(found.failures),
        "running": found.running,
        "left_s": found.left_s,
        "failures": found.failures,
        "command": found.command,
    }
    outcome = Outcome.PASS if found.finished == found.planned else Outcome.INCOMPLETE
    return print_result(args, content, *_status_lines(found), outcome=outcome)


def _status_lines(found: "RunStatus") -> list[str]:
    counted = f"{found.finished:,} of {found.planned:,} cells finished, {len(found.failures):,} failed"
    state = "running" if found.running else "finished" if not found.remaining else "not running"
    left = f", about {_format_duration(found.left_s)} left" if found.left_s is not None else ""
    lines = [f"{found.kind} {found.name}: {state}, {counted}{left}"]
    lines += [f"FAILED {cell}: {text.strip().splitlines()[-1]}" for cell, text in found.failures.items()][
        :_MAX_FAILURES
    ]
    if len(found.failures) > _MAX_FAILURES:
        lines.append(f"and {len(found.failures) - _MAX_FAILURES:,} more")
    if found.failures and found.kind == "sweep":
        lines.append(f"one of them again: {found.command} --cell {shlex.quote(next(iter(found.failures)))}")
    return lines


def _format_duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
