"""Time until each verb prints something: `python -m tests.first_output [VERB ...]`; 1 where one needs too long.

A verb is started in a folder with the files that it needs, and ended at its first byte on stdout or stderr. The limit
is on CPU time, which other programs hardly change.
"""

import os
import select
import shlex
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from harness.core.text_table import Table
from harness.core.working_folder import python_command, python_environment
from tests.verb_examples import EXAMPLES, NEEDS_NONE, unpack_files, verb_parsers

MOST_CPU_S = 1.0
"""Most CPU time until the first byte [s]."""
_REFUSAL = "harness: "


@dataclass(frozen=True)
class FirstOutput:
    """What a command printed first, and when."""

    line: str
    """Its beginning; "" where the command ended without a word."""
    cpu_s: float
    """CPU time of the process until then [s]."""
    wall_s: float
    """Time until then [s]."""

    @property
    def fault(self) -> str:
        """Why this is no good beginning; "" where it is."""
        if not self.line:
            return "it prints nothing"
        if self.line.startswith(_REFUSAL):
            return "it was refused"
        return f"more than {MOST_CPU_S:g} s of CPU time" if self.cpu_s > MOST_CPU_S else ""


def measure_first_output(command: Sequence[str], folder: Path) -> FirstOutput:
    """Run a command in a folder until its first byte of output, and kill it."""
    start_s = time.perf_counter()
    process = subprocess.Popen(
        command,
        cwd=folder,
        env=python_environment(),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    assert process.stdout
    assert process.stderr
    with process.stdout, process.stderr:
        waiting, data = [process.stdout.fileno(), process.stderr.fileno()], b""
        while waiting and not data:
            ready, _, _ = select.select(waiting, [], [])
            data = os.read(ready[0], 4096)
            waiting.remove(ready[0])
        wall_s = time.perf_counter() - start_s
        if data:
            os.killpg(process.pid, signal.SIGKILL)
        _, _, used = os.wait4(process.pid, 0)
        process.returncode = 0
    return FirstOutput(data.decode(errors="replace").split("\n")[0], used.ru_utime + used.ru_stime, wall_s)


def table_lines(found: dict[str, FirstOutput]) -> list[str]:
    """The table of verbs, and how many need too long."""
    rows = [
        [verb, f"{first.cpu_s:.2f}", f"{first.wall_s:.2f}", first.fault or "ok", first.line[:60]]
        for verb, first in found.items()
    ]
    late = sum(bool(first.fault) for first in found.values())
    table = Table(["verb", "CPU [s]", "wall [s]", "verdict", "first output"], rows)
    return [*table.lines(), f"{late} of {len(found)} verbs without output in {MOST_CPU_S:g} s of CPU time"]


def main(words: Sequence[str]) -> int:
    verbs, found = words or [*verb_parsers()], dict[str, FirstOutput]()
    for verb in verbs:
        words_of = "" if verb in NEEDS_NONE else EXAMPLES[verb]
        with TemporaryDirectory(prefix="harness-first-") as folder:
            unpack_files(Path(folder))
            command = python_command("-m", "harness", *shlex.split(f"{verb} {words_of}"))
            found[verb] = measure_first_output(command, Path(folder))
    print("\n".join(table_lines(found)))
    return int(any(first.fault for first in found.values()))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
