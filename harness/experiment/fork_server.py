"""The process that forks the workers of methods. It imports what they need, once, and nothing of a user's.

`worker_process` starts it and asks it: `fork MODULE FOLDER` with two descriptors, or `poll PID`. It ends with the
program that started it.
"""

import gc
import os
import signal
import socket
import sys
from contextlib import suppress
from importlib import import_module

from harness.experiment import method_worker  # noqa: F401  # what all workers need


def main(number: str) -> None:
    """Answer requests on the socket of this number until it is closed."""
    gc.collect()
    gc.freeze()  # workers share these objects instead of copying them
    server = socket.socket(fileno=int(number))
    with suppress(OSError):  # the program is gone
        while _answer(server):
            pass


def _answer(server: socket.socket) -> bool:
    """Answer one request; False when there are no more."""
    text, descriptors, _, _ = socket.recv_fds(server, 8192, 2)
    word, _, argument = os.fsdecode(text).partition(" ")
    if word == "fork":
        module, _, folder = argument.partition(" ")
        server.send(str(_fork(server, module, folder, descriptors)).encode())
    elif word == "poll":
        server.send(_poll(int(argument)).encode())
    return bool(text)


def _poll(pid: int) -> str:
    """The exit code of a worker, or `running`."""
    try:
        ended, status = os.waitpid(pid, os.WNOHANG)
    except ChildProcessError:  # it was asked before
        return str(-signal.SIGKILL)
    return str(os.waitstatus_to_exitcode(status)) if ended else "running"


def _fork(server: socket.socket, module: str, folder: str, descriptors: list[int]) -> int:
    """Fork a worker, which works in a folder and is the leader of a process group of its own; its number."""
    pid = os.fork()
    if pid == 0:
        code = 1
        try:
            server.close()
            os.setpgid(0, 0)
            os.chdir(folder)
            import_module(module).main(*map(str, descriptors))
            code = 0
        except BaseException:
            sys.excepthook(*sys.exc_info())
        finally:
            os._exit(code)
    with suppress(OSError):
        os.setpgid(pid, pid)
    for descriptor in descriptors:
        os.close(descriptor)
    return pid
