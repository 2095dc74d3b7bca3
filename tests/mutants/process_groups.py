"""Processes that run in sessions of their own, and that one call ends from any thread."""

import os
import signal
import subprocess
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Lock


class Stopped(Exception):
    """The process was killed, or was not started, because of `ProcessGroups.stop`."""


class ProcessGroups:
    """Running processes, each with the processes that it starts."""

    def __init__(self) -> None:
        self._running: set[int] = set()
        self._stopped = False
        self._lock = Lock()

    def run(self, command: Sequence[str], *, cwd: Path, env: Mapping[str, str], limit_s: float) -> tuple[int, str]:
        """Exit code and output of a command. Stopped, or TimeoutExpired after the limit [s]; its group is killed."""
        with self._started(command, cwd, env) as process:
            output, _ = process.communicate(timeout=limit_s)
        if self._stopped:
            raise Stopped
        return process.returncode, output

    def stop(self) -> None:
        """Kill all groups, and let no other process start."""
        with self._lock:
            self._stopped = True
            for group in self._running:
                _kill(group)

    @contextmanager
    def _started(self, command: Sequence[str], cwd: Path, env: Mapping[str, str]) -> Iterator[subprocess.Popen[str]]:
        with self._lock:  # `stop` sees every process, or prevents it
            if self._stopped:
                raise Stopped
            process = subprocess.Popen(
                command,
                cwd=cwd,
                env=env,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                start_new_session=True,
            )
            self._running.add(process.pid)
        with process:
            try:
                yield process
            finally:
                with self._lock:
                    self._running.remove(process.pid)
                _kill(process.pid)


def _kill(group: int) -> None:
    with suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)
