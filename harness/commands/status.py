"""The verb `status`: tell how much of a sweep, study or run is finished."""

import argparse
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.flags import Verbs, add_verb
from harness.commands.output import print_result
from harness.errors import Outcome

if TYPE_CHECKING:
    from harness.experiment import RunStatus

_MAX_FAILURES = 10


def add_status(verbs: Verbs) -> None:
    text = "tell how much of a run, sweep or placement study is finished, also while it runs"
    verb = add_verb(verbs, "status", text, run_status)
    verb.add_argument("folder", type=Path, metavar="DIR", help="the folder that it writes")


def run_status(args: argparse.Namespace) -> Outcome:
    from harness.experiment import read_status

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
    following = ["report", args.folder] if not found.remaining else shlex.split(found.command)[1:]
    if found.running:
        following = ["status", args.folder]
    outcome = Outcome.PASS if found.finished == found.planned else Outcome.INCOMPLETE
    return print_result(args, content, *_status_lines(found), outcome=outcome, following=following)


def _status_lines(found: "RunStatus") -> list[str]:
    from harness.report.kit import last_line

    counted = f"{found.finished:,} of {found.planned:,} cells finished, {len(found.failures):,} failed"
    state = "running" if found.running else "finished" if not found.remaining else "not running"
    left = f", about {_format_duration(found.left_s)} left" if found.left_s is not None else ""
    lines = [f"{found.kind} {found.name}: {state}, {counted}{left}"]
    lines += [f"FAILED {cell}: {last_line(text)}" for cell, text in found.failures.items()][:_MAX_FAILURES]
    if len(found.failures) > _MAX_FAILURES:
        lines.append(f"and {len(found.failures) - _MAX_FAILURES:,} more")
    if found.failures and found.kind == "sweep":
        lines.append(f"one of them again: {found.command} --cell {shlex.quote(next(iter(found.failures)))}")
    return lines


def _format_duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
