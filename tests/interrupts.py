"""Children that are to be interrupted."""

import signal
import subprocess
import sys
from typing import Any


def heeding_interrupts() -> None:
    """For `preexec_fn`: as from a terminal. What a shell starts in the background ignores interrupts, and so would
    its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def start_harness(*words: object, **options: Any) -> "subprocess.Popen[str]":
    """A command in a process of its own that heeds interrupts, with pipes for what it prints."""
    command = [sys.executable, "-m", "harness.cli", *map(str, words)]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    return subprocess.Popen(command, preexec_fn=heeding_interrupts, **pipes, **options)


def interrupt(program: "subprocess.Popen[str]", stop: signal.Signals = signal.SIGINT) -> tuple[int, str, str]:
    """Send a signal: the exit code, stdout and stderr of the command."""
    program.send_signal(stop)
    out, err = program.communicate(timeout=120.0)
    return program.returncode, out, err
