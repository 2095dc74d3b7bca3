"""Worker processes for methods: forked by a server that has imported everything, so that each starts in milliseconds.

The server never imports a method, and it holds no motion and no truth. Where processes cannot be forked, each worker is
a new interpreter.
"""

import atexit
import os
import signal
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any, BinaryIO, cast

from harness.core.child_process import PythonProcess
from harness.errors import SystemFault

_POLL_INTERVAL_S = 0.01
_END_S = 5.0


class _SpawnedWorker:
    """A worker in a new interpreter, see `_ForkedWorker`."""

    def __init__(self, module: str) -> None:
        pipe = subprocess.PIPE
        self._process = PythonProcess(module, stdin=pipe, stdout=pipe, stderr=None, watched=False)
        self.requests, self.answers = (cast(Any, s).buffer for s in (self._process.stdin, self._process.stdout))

    def wait(self, timeout_s: float) -> int | None:
        until_s = time.monotonic() + timeout_s
        while (code := self._process.poll()) is None and time.monotonic() < until_s:
            time.sleep(_POLL_INTERVAL_S)
        return code

    def kill(self) -> None:
        self._process.kill()

    def close(self) -> None:
        self._process.close()


@dataclass(eq=False)
class _ForkedWorker:
    """A worker that the server has forked, seen through the socket of its keeper."""

    control: socket.socket
    stream: socket.socket
    """Carries requests and answers. Its end here can be shut, whoever else holds the other one."""
    requests: BinaryIO
    answers: BinaryIO
    _code: int | None = None

    def wait(self, timeout_s: float) -> int | None:
        """The exit code, negative for a signal, of a process that ends within a time, else None."""
        if self._code is None and wait([self.control], timeout_s):
            self._code = int(self.control.recv(16) or -signal.SIGKILL)  # a keeper that was killed sends nothing
        return self._code

    def kill(self) -> None:
        """Kill the process and those that it started, and end its streams."""
        for end, how in ((self.control, socket.SHUT_WR), (self.stream, socket.SHUT_RDWR)):
            with suppress(OSError):
                end.shutdown(how)

    def close(self) -> None:
        """Kill the process and those that it started, and release its streams."""
        self.kill()
        self.wait(_END_S)
        for end in (self.requests, self.answers, self.stream, self.control):
            with suppress(OSError):  # a request that was not sent
                end.close()


class _ForkServer:
    """The server, seen from the program that uses it."""

    def __init__(self) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            number = theirs.fileno()
            self._process = PythonProcess(
                "harness.experiment.methods.fork_server",
                str(number),
                stdout=2,
                stderr=None,
                pass_fds=(number,),
                watched=False,
            )

    def fork(self, module: str) -> _ForkedWorker:
        """Fork a worker; OSError when the server is gone."""
        with ExitStack() as made:
            (control, their_control), (stream, their_stream) = socket.socketpair(), socket.socketpair()
            for end in (control, stream):
                made.callback(end.close)
            with their_control, their_stream, their_stream.dup() as second:
                theirs = [end.fileno() for end in (their_control, their_stream, second)]
                socket.send_fds(self._socket, [os.fsencode(f"{module} {os.getcwd()}")], theirs)
                if not self._socket.recv(64):
                    raise OSError("the fork server is gone")
            made.pop_all()
        return _ForkedWorker(control, stream, stream.makefile("wb"), stream.makefile("rb"))

    def close(self) -> None:
        self._socket.close()
        self._process.close()


WorkerProcess = _ForkedWorker | _SpawnedWorker


def start_worker(module: str) -> WorkerProcess:
    """Start a process that calls `main` of a module with the descriptors of its requests and answers; SystemFault."""
    if sys.platform != "linux":
        return _SpawnedWorker(module)
    for _ in range(2):
        with suppress(OSError):
            return _fork_server().fork(module)
        close_fork_server()  # somebody has ended it
    raise SystemFault("No process can be started for a method.", "Is the machine out of memory or of processes?")


_servers: list[_ForkServer] = []
"""The server of this process, if one was started."""


def _fork_server() -> _ForkServer:
    if not _servers:
        atexit.unregister(close_fork_server)
        atexit.register(close_fork_server)
        _servers.append(_ForkServer())
    return _servers[0]


def close_fork_server() -> None:
    """End the server, once its workers have ended."""
    while _servers:
        _servers.pop().close()
