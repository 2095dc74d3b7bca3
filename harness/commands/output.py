"""What a verb prints: status, its result, and how a command ended, with an error, an interrupt or a fault."""

import argparse
import json
import shlex
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.core.fault_report import describe_fault, save_traceback
from harness.core.interrupts import refuse_interrupts
from harness.core.progress import ProgressBar
from harness.core.standard_streams import discard_stdout
from harness.errors import HarnessError, Outcome, SystemFault, shorten, was_interrupted

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

_MAX_LINE = 1000
"""Most characters of the line that says why a command ended."""
_KEPT = "Files are written whole or not at all; those that were finished are kept."


def print_data(text: str) -> bool:
    """Print text to stdout at once; False when the reader has left, as `| head` does, which is no error.

    SystemFault when the text cannot be written.
    """
    show_progress("")  # an announcement ends
    try:
        print(text, end="", flush=True)
    except BrokenPipeError:
        discard_stdout()
        return False
    except OSError as error:
        discard_stdout()
        advice = "Send the output somewhere else, then give the same command again."
        raise SystemFault(f"The result cannot be printed ({error.strerror}).", advice) from error
    return True


def describe_ending(words: Sequence[str], error: BaseException) -> tuple[Outcome, dict[str, Any]]:
    """The outcome of a command that an exception ended, and what --json adds; it prints one line to stderr.

    `words` is the command line without the program's name. Notes of the exception say what is kept, and of an interrupt
    whether the same command resumes. A verb that runs until Ctrl-C takes the interrupt itself, once it does its work.
    """
    kept = " ".join(getattr(error, "__notes__", ()))
    if was_interrupted(error):
        print_status(f"harness: stopped. {kept or _KEPT}")
        return Outcome.INTERRUPTED, {}
    if isinstance(error, HarnessError) and error.outcome is not Outcome.FAILED:
        print_status(f"harness: {shorten(str(error), _MAX_LINE)}")
        return error.outcome, {"error": shorten(str(error), _MAX_LINE)}
    cause, advice = describe_fault(error)
    line = shorten(f"{cause} {kept or _KEPT} {advice} ({save_traceback(error)})", _MAX_LINE)
    print_status(f"harness: failed: {line}")
    return Outcome.FAILED, {"error": line}


def print_last(text: str, outcome: Outcome) -> int:
    """Print the last text of a command to stdout; returns the exit code, that of FAILED when it cannot be printed."""
    try:
        print_data(text)
    except SystemFault as fault:
        outcome, _ = describe_ending((), fault)
    return outcome.exit_code


@contextmanager
def progress_note(out: Path) -> Iterator[None]:
    """Add to a fault or an interrupt that leaves the block how much of the work in `out` is kept, for it to resume."""
    try:
        yield
    except (KeyboardInterrupt, Exception) as error:
        kept = _describe_progress(out)
        resumes = was_interrupted(error) and out.is_dir()
        error.add_note(f"{kept.removesuffix('.')}, and the same command resumes." if resumes else kept)
        raise


@contextmanager
def long_work(out: Path, unit: str) -> Iterator[ProgressBar]:
    """Work of methods in the folder `out`: `progress_note`, and a bar that counts `unit`.

    What a method prints goes to stderr; stdout is for data.
    """
    with progress_note(out), ProgressBar(unit) as bar, redirect_stdout(sys.stderr):
        yield bar


@contextmanager
def recording_note(path: Path, more: str = ".") -> Iterator[None]:
    """Add to an interrupt that leaves the block whether a recording is kept; `more` ends the sentence if it is."""
    try:
        yield
    except (KeyboardInterrupt, Exception) as error:
        if was_interrupted(error):
            kept, nothing = f"What was recorded is kept in {path}{more}", f"Nothing was recorded into {path}."
            error.add_note(kept if path.exists() else nothing)
        raise


def _describe_progress(out: Path) -> str:
    from harness.experiment import read_status

    if not out.is_dir():
        return f"Nothing is kept in {out}."
    try:
        found = read_status(out)
    except Exception:  # no work has begun, or the fault concerns the index too
        return f"The finished cells in {out} are kept."
    return f"{found.finished:,} of {found.planned:,} cells in {out} are finished and kept."


def print_status(line: str) -> None:
    """Print a line to stderr, over the line of `show_progress`; stdout is for data."""
    print(f"\r{line}\033[K" if sys.stderr.isatty() else line, file=sys.stderr, flush=True)


def announce(line: str) -> None:
    """Print to stderr what a verb does before its first result; on a terminal the next line replaces it."""
    (show_progress if sys.stderr.isatty() else print_status)(line)


def print_caveat(path: object, caveat: str) -> None:
    """Print what cannot be verified of a file, if there is anything."""
    if caveat:
        print_status(f"note: {path}: {caveat}")


def show_progress(line: str) -> None:
    """Replace the last line of stderr, if stderr is a terminal; what is too long for a line is cut."""
    if sys.stderr.isatty():
        line = line[: shutil.get_terminal_size().columns - 1]
        print(f"\r{line}\033[K", end="", file=sys.stderr, flush=True)


def print_result(
    args: argparse.Namespace,
    content: Mapping[str, Any],
    *lines: str,
    outcome: Outcome = Outcome.PASS,
    following: Sequence[object] = (),
) -> Outcome:
    """Print the lines, or with --json the content and the outcome's word; returns the outcome.

    `following` are the words of the command that a user would give next, without the program's name. It is printed to
    stderr, and with --json as "next".

    It is the last thing that a verb does: signals that come later change nothing.
    """
    refuse_interrupts()
    command = shlex.join(["harness", *map(str, following)]) if following else None
    if args.json:
        following_command = {"next": command} if command else {}
        print_data(json.dumps({**content, **following_command, "outcome": outcome.word}) + "\n")
        return outcome
    if print_data("\n".join(lines) + "\n") and command:
        print_status(f"next: {command}")
    return outcome


def record_content(record: "DataclassInstance", **more: Path | str | None) -> dict[str, Any]:
    """A record as content of the JSON output, and further entries, of which a path becomes its text."""
    from dataclasses import asdict

    from harness.core.files import to_json_types

    return {**to_json_types(asdict(record)), **{name: more[name] and str(more[name]) for name in more}}


def this_words() -> list[str]:
    """The words of the command line as typed, without the program's name."""
    return sys.argv[1:]


def this_command() -> str:
    """The command line as it was typed."""
    return shlex.join(["harness", *this_words()])
