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
from contextlib import suppress
from dataclasses import dataclass
from typing import BinaryIO, Protocol, cast

from harness.core.package_data import PACKAGE_FOLDER

_START = (
    "import sys; sys.path.insert(0, sys.argv[1]); from importlib import import_module; "
    "import_module(sys.argv[2]).main(*sys.argv[3:])"
)
_POLL_INTERVAL_S = 0.01


class WorkerProcess(Protocol):
    """A process that runs `main` of a module."""

    requests: BinaryIO
    answers: BinaryIO

    def poll(self) -> int | None:
        """The exit code, negative for a signal; None while the process runs."""
        ...

    def kill(self) -> None:
        """Kill the process and those that it started."""
        ...


def start_worker(module: str) -> WorkerProcess:
    """Start a process that calls `main` of a module with the descriptors of its requests and answers."""
    if sys.platform != "linux":
        return _SpawnedWorker(module)
    for _ in range(2):
        with suppress(OSError):
            return _fork_server().fork(module)
        close_fork_server()  # somebody has ended it
    raise OSError("no worker process can be started")


def wait_for(process: WorkerProcess, timeout_s: float) -> int | None:
    """The exit code of a process that ends within a time, else None."""
    until_s = time.monotonic() + timeout_s
    while (code := process.poll()) is None and time.monotonic() < until_s:
        time.sleep(_POLL_INTERVAL_S)
    return code


def close_worker(process: WorkerProcess) -> None:
    """Kill a process and those that it started, and release its streams."""
    process.kill()
    wait_for(process, 5.0)
    for stream in (process.requests, process.answers):
        with suppress(OSError):
            stream.close()


def _command(module: str, *arguments: str) -> list[str]:
    return [sys.executable, "-B", "-P", "-u", "-c", _START, str(PACKAGE_FOLDER.parent), module, *arguments]


class _SpawnedWorker:
    """A worker in a new interpreter."""

    def __init__(self, module: str) -> None:
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(_command(module), stdin=pipe, stdout=pipe, start_new_session=True)
        self.requests, self.answers = cast(BinaryIO, self._process.stdin), cast(BinaryIO, self._process.stdout)

    def poll(self) -> int | None:
        return self._process.poll()

    def kill(self) -> None:
        if self._process.poll() is None:
            self._process.kill()


@dataclass(eq=False)
class _ForkedWorker:
    """A worker that the server has forked."""

    server: "_ForkServer"
    pid: int
    requests: BinaryIO
    answers: BinaryIO
    _code: int | None = None

    def poll(self) -> int | None:
        if self._code is None:
            try:
                answer = self.server.ask(f"poll {self.pid}")
            except OSError:  # the server is gone, and its workers with it
                answer = str(-signal.SIGKILL)
            self._code = None if answer == "running" else int(answer)
        return self._code

    def kill(self) -> None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(self.pid, signal.SIGKILL)


class _ForkServer:
    """The server, seen from the program that uses it."""

    def __init__(self) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            number = theirs.fileno()
            self._process = subprocess.Popen(
                _command("harness.experiment.fork_server", str(number)),
                stdin=subprocess.DEVNULL,
                stdout=2,
                pass_fds=[number],
                start_new_session=True,
            )

    def fork(self, module: str) -> _ForkedWorker:
        """Fork a worker; OSError when the server is gone."""
        their_requests, requests = os.pipe()
        answers, their_answers = os.pipe()
        worker = _ForkedWorker(self, 0, os.fdopen(requests, "wb"), os.fdopen(answers, "rb"))
        try:
            request = os.fsencode(f"fork {module} {os.getcwd()}")
            socket.send_fds(self._socket, [request], [their_requests, their_answers])
            worker.pid = int(self._receive())
        finally:
            os.close(their_requests)
            os.close(their_answers)
        return worker

    def ask(self, text: str) -> str:
        """The answer of the server; OSError when it is gone."""
        self._socket.send(text.encode())
        return self._receive()

    def _receive(self) -> str:
        answer = self._socket.recv(64)
        if not answer:
            raise OSError("the fork server is gone")
        return answer.decode()

    def close(self) -> None:
        self._socket.close()
        self._process.kill()
        self._process.wait()


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
