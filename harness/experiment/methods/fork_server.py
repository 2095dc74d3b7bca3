"""The process that forks the workers of methods. It imports what they need, once, and nothing of a user's.

`worker_process` starts it and sends it requests: a module, a folder and three descriptors. Each worker has a keeper, a
process that inherits whatever the worker starts and leaves behind (Linux calls it a subreaper). When the worker ends,
or the program does, or the program asks for it, the keeper kills all of it, and reports the worker's exit code.

The standard library's fork server does not serve here: it runs the program's main module in each child, takes its
requests as pickles, and leaves alone what a child has started.
"""

import ctypes
import gc
import os
import signal
import socket
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from multiprocessing.connection import wait
from pathlib import Path
from threading import Thread

from harness.core.child_process import process_descriptors
from harness.experiment.methods import method_worker  # noqa: F401  # what all workers need

_PR_SET_PDEATHSIG, _PR_SET_CHILD_SUBREAPER = 1, 36
_RETRY_S = 0.002


def main(number: str) -> None:
    """Answer requests on the socket of this number until it is closed, or until the program ends."""
    gc.collect()
    gc.freeze()  # workers share these objects instead of copying them
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the system forgets keepers that have ended
    server, program = socket.socket(fileno=int(number)), process_descriptors(os.getppid())
    with suppress(OSError):  # the program is gone
        while server in wait([server, *program]) and _answer(server, program):
            pass


def _answer(server: socket.socket, program: list[int]) -> bool:
    """Answer one request; False when there are no more."""
    text, descriptors, _, _ = socket.recv_fds(server, 8192, 3)
    if text:
        module, _, folder = os.fsdecode(text).partition(" ")
        control, *streams = descriptors

        def serve() -> None:
            os.close(control)
            os.chdir(folder)
            import_module(module).main(*map(str, streams))

        def keep() -> None:
            server.close()
            _keep(socket.socket(fileno=control), program, streams, serve)

        _fork(keep)
        for descriptor in descriptors:
            os.close(descriptor)
        server.send(b"forked")
    return bool(text)


def _fork(function: Callable[[], None]) -> int:
    """Call a function in a forked process, and end that process; its number."""
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            function()
            code = 0
        except BaseException:
            sys.excepthook(*sys.exc_info())
        finally:
            os._exit(code)
    return pid


def _keep(control: socket.socket, program: list[int], streams: list[int], serve: Callable[[], None]) -> None:
    """Fork a worker, wait for its end, kill what it leaves behind, and send its exit code."""
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    os.setsid()
    system = ctypes.CDLL(None)
    system.prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)

    def work() -> None:
        system.prctl(_PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
        os.setpgid(0, 0)
        serve()

    def kill_when_released() -> None:
        wait([control, *program])  # nothing is ever sent
        _kill(worker)

    worker = _fork(work)
    for descriptor in streams:
        os.close(descriptor)
    Thread(target=kill_when_released, daemon=True).start()
    ended = os.waitid(os.P_PID, worker, os.WEXITED | os.WNOWAIT)  # its number stays taken
    with suppress(ChildProcessError):
        while True:
            if not os.waitpid(-1, os.WNOHANG)[0]:
                for pid in _children():
                    _kill(pid)
                time.sleep(_RETRY_S)
    code = 0 if ended is None else ended.si_status if ended.si_code == os.CLD_EXITED else -ended.si_status
    with suppress(OSError):  # nobody listens
        control.sendall(str(code).encode())


def _kill(pid: int) -> None:
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def _children() -> list[int]:
    """Numbers of the children of this process."""
    found = []
    for place in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended meanwhile
            if int(place.read_bytes().rpartition(b")")[2].split()[1]) == os.getpid():
                found.append(int(place.parent.name))
    return found
