"""Child processes: every Python process of the harness is started here.

Only Dask starts its own, and `harness bench startup` times commands as a shell starts them.

A child has a session and a temporary folder of its own, and it imports nothing from the working folder. It ends with
the program that started it, however that ends, and its process group ends with it. Nobody waits for the end of a pipe
to learn that a process has ended: another process may hold the pipe.
"""

import atexit
import os
import runpy
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing import get_context
from multiprocessing.connection import wait
from threading import Lock, Thread
from typing import Any

from harness.core.interrupts import SIGNALS, defer_interrupts, shield_children
from harness.core.working_folder import python_command, python_environment
from harness.errors import SystemFault

SPAWN = get_context("spawn")
"""What shared memory for a `FunctionProcess` is made with."""
_START = "from harness.core.child_process import run_module; run_module()"
_START_UNWATCHED = "-Buc", "import sys, importlib; importlib.import_module(sys.argv[1]).main(*sys.argv[2:])"
_PREFIX = "harness-child-"
_POLL_INTERVAL_S = 0.5
_TOO_MANY = "The system allows no further process: end some programs, or use fewer --jobs."
_END_S = 2.0
"""Time within which a process whose pipe has ended does so too [s]."""


@contextmanager
def _named_fault() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise SystemFault(f"A process cannot be started ({error.strerror or error}).", _TOO_MANY) from error


class PythonProcess(subprocess.Popen[str]):
    """This Python, running a module as a program. A context manager, which ends the process and its group."""

    def __init__(self, module: str, *words: str, watched: bool = True, shielded: bool = True, **options: Any) -> None:
        """Start the process with words of its command line; SystemFault when the system refuses.

        `options` are those of Popen: by default stderr is a pipe, and the other streams are closed; `env` has variables
        to add. The process watches this one from a thread. One that forks has to do so itself: not `watched`, it calls
        `main` of the module with the words. `shielded`, it sees no signal: one ends this process, which ends the child.
        """
        with shield_children() if shielded else defer_interrupts():
            self._temporary = tempfile.TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True)
            options = {"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, **options}
            options["env"] = {**python_environment(), "TMPDIR": self._temporary.name, **options.get("env", {})}
            start = ("-c", _START, str(os.getpid()), self._temporary.name) if watched else _START_UNWATCHED
            with _named_fault():
                super().__init__(python_command(*start, module, *words), text=True, start_new_session=True, **options)

    def finish(self, limit_s: float, look: Callable[[], object] = lambda: None) -> tuple[str, str] | None:
        """What the process has written to stdout and stderr when it has ended, "" for a stream that is no pipe.

        None after `limit_s`; the process is killed then. `look` is called every 0.5 s meanwhile.
        """
        until_s, ended = time.monotonic() + limit_s, False
        while True:
            left_s = _POLL_INTERVAL_S if ended else min(_POLL_INTERVAL_S, max(until_s - time.monotonic(), 0.0))
            try:
                out, err = self.communicate(timeout=left_s)
                return out or "", err or ""
            except subprocess.TimeoutExpired as late:
                if ended:  # a process of another group holds the streams
                    return _decode(late.stdout), _decode(late.stderr)
                look()
                ended = self.poll() is not None
                if ended:
                    kill_group(self.pid)
                elif time.monotonic() > until_s:
                    self.close()
                    return None

    def kill(self) -> None:
        """Kill the process and its group."""
        if self.poll() is None:
            kill_group(self.pid)
            super().kill()

    def close(self) -> None:
        """End the process and its group, if it still runs, and release what belongs to it."""
        self.kill()
        self.wait()
        for stream in (self.stdin, self.stdout, self.stderr):
            if stream is not None:
                with suppress(OSError):
                    stream.close()
        self._temporary.cleanup()

    def __exit__(self, *raised: object) -> None:
        self.close()


def run_python(module: str, *words: str) -> str:
    """What a module, run as a program, has written to stdout; RuntimeError with the end of its stderr if it fails."""
    with PythonProcess(module, *words, stdout=subprocess.PIPE) as process:
        out, err = process.finish(float("inf")) or ("", "")
    if process.returncode:
        raise RuntimeError(f"{' '.join([module, *words])}: {err.strip()[-2000:]}")
    return out


def _decode(data: str | bytes | None) -> str:
    return data.decode(errors="replace") if isinstance(data, bytes) else data or ""


class FunctionProcess:
    """A new Python that calls `function(pipe, *arguments)`: all of it is pickled on its way, and it sees no signal."""

    def __init__(self, function: Callable[..., None], *arguments: Any) -> None:
        """Start the process; SystemFault when the system refuses."""
        with shield_children():
            self._temporary = tempfile.TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True)
            self.pipe, other_end = SPAWN.Pipe()
            self._owner, self._closing = os.getpid(), Lock()
            given = self._owner, self._temporary.name, function, other_end, arguments
            self._process = SPAWN.Process(target=_call_function, args=given)
            with other_end, _named_fault():
                self._process.start()
            self._descriptors = process_descriptors(self.pid)
            self._ended = (self._descriptors or [self._process.sentinel])[0]
            atexit.register(self.close)  # earlier than multiprocessing, which would wait for the process

    @property
    def pid(self) -> int:
        return self._process.pid or 0

    @property
    def exit_code(self) -> int | None:
        """The exit code, negative for a signal; None while the process runs."""
        return self._process.exitcode

    def receive(self, limit_s: float | None = None) -> Any:
        """The next message; EOFError when the process has ended without one, TimeoutError after `limit_s`."""
        try:
            ready = wait([self.pipe, self._ended], limit_s)
            if self._ended in ready:
                kill_group(self.pid)  # what it has started may hold the pipe
            if ready and self.pipe.poll():
                return self.pipe.recv()
        except (EOFError, OSError) as error:  # the pipe was closed
            with suppress(OSError):
                wait([self._ended], _END_S)
            raise EOFError from error
        raise EOFError if ready else TimeoutError

    def kill(self) -> None:
        """Kill the process and its group, and wait until it has ended."""
        kill_group(self.pid)
        self._process.kill()
        self._process.join()

    def leave(self) -> None:
        """End the pipe on both ends, also for a thread that reads it here: closing alone would not."""
        if os.name == "posix":
            with suppress(OSError), socket.socket(fileno=os.dup(self.pipe.fileno())) as end:
                end.shutdown(socket.SHUT_RDWR)
        self.pipe.close()

    def close(self, patience_s: float = 0.0) -> None:
        """End the pipe, and kill the process and its group unless it ends within a time."""
        if self._owner != os.getpid():  # a copy of this program, which `os.fork` has made
            return
        with self._closing:
            atexit.unregister(self.close)
            if not self.pipe.closed:
                self.leave()
            if self.exit_code is None:
                if not wait([self._ended], patience_s):
                    self.kill()
                self._process.join()
            while self._descriptors:
                os.close(self._descriptors.pop())
            self._temporary.cleanup()


def _call_function(parent: int, temporary: str, function: Callable[..., None], pipe: Any, arguments: Any) -> None:
    for number in SIGNALS:  # they are blocked already, but not on Windows
        signal.signal(number, signal.SIG_IGN)
    if hasattr(os, "setsid"):
        os.setsid()
    tempfile.tempdir = os.environ["TMPDIR"] = temporary
    sys.stdout = sys.stderr
    Thread(target=_end_with, args=(parent, temporary), daemon=True).start()
    function(pipe, *arguments)


def run_module() -> None:
    """Entry point of a `PythonProcess`: run the module of the command line, and end with the process named there."""
    parent, temporary, module, *arguments = sys.argv[1:]
    Thread(target=_end_with, args=(int(parent), temporary), daemon=True).start()
    sys.argv[:] = [module, *arguments]
    runpy.run_module(module, run_name="__main__", alter_sys=True)


def _end_with(parent: int, temporary: str) -> None:
    """Wait for the end of the process that started this one, then remove the temporary folder and kill the group."""
    wait(process_descriptors(parent))  # returns at once without a descriptor
    while os.getppid() == parent:
        time.sleep(_POLL_INTERVAL_S)
    shutil.rmtree(temporary, ignore_errors=True)
    kill_group(0)
    os._exit(1)


def process_descriptors(pid: int) -> list[int]:
    """A descriptor that is readable once a process has ended; none where the system has no such thing."""
    if sys.platform == "linux":
        with suppress(OSError):  # an old kernel, or the process is gone
            return [os.pidfd_open(pid)]
    return []


def kill_group(leader: int) -> None:
    """Kill the process group of a leader; 0 for that of this process."""
    if hasattr(os, "killpg"):
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(leader, signal.SIGKILL)
