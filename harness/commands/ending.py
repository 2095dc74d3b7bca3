"""How a command ends: what it prints of an error, an interrupt or a fault, and the word of its outcome."""

import sys
from collections.abc import Sequence
from typing import Any

from harness.core.fault_report import describe_fault, save_traceback
from harness.core.standard_streams import discard_stdout
from harness.errors import HarnessError, Outcome, SystemFault, shorten, was_interrupted

_MAX_LINE = 1000
"""Most characters of the line that says why a command ended."""
_KEPT = "Files are written whole or not at all; those that were finished are kept."


def print_data(text: str) -> bool:
    """Print text to stdout at once; False when the reader has left, as `| head` does, which is no error.

    SystemFault when the text cannot be written.
    """
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
        print(f"harness: stopped. {kept or _KEPT}", file=sys.stderr)
        return Outcome.INTERRUPTED, {}
    if isinstance(error, HarnessError) and error.outcome is not Outcome.FAILED:
        print(f"harness: {shorten(str(error), _MAX_LINE)}", file=sys.stderr)
        return error.outcome, {"error": shorten(str(error), _MAX_LINE)}
    cause, advice = describe_fault(error)
    line = shorten(f"{cause} {kept or _KEPT} {advice} ({save_traceback(error)})", _MAX_LINE)
    print(f"harness: failed: {line}", file=sys.stderr)
    return Outcome.FAILED, {"error": line}


def print_last(text: str, outcome: Outcome) -> int:
    """Print the last text of a command to stdout; returns the exit code, that of FAILED when it cannot be printed."""
    try:
        print_data(text)
    except SystemFault as fault:
        outcome, _ = describe_ending((), fault)
    return outcome.exit_code
