"""Worker processes that end with the one that started them, however it ended; Ctrl-C reaches that one alone."""

import os
import signal
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread, current_thread, main_thread
from typing import Any, TypeVar

R = TypeVar("R")


def call_each(
    function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], workers: int
) -> Generator[tuple[int, Future[R]], None, None]:
    """`function(*task)` of every task, in fresh processes: which task, and what came of it, as each ends.

    A caller that stops early, as Ctrl-C makes it, stops what runs at once. What workers print goes to stderr.
    """
    context = get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    with ProcessPoolExecutor(workers, context, _start, (theirs,)) as pool:
        try:
            with ctrl_c_ignored():  # which processes inherit, so that they never see it, not even while they import
                running = {pool.submit(function, *task): which for which, task in enumerate(tasks)}
            for future in as_completed(running):
                yield running.pop(future), future  # kept no longer than the caller keeps it
            pool.shutdown()
        finally:
            ours.close()
            pool.shutdown(cancel_futures=True)
            theirs.close()


def _start(alive: Connection) -> None:
    sys.stdout = sys.stderr
    Thread(target=_end_with, args=(alive,), daemon=True).start()


def _end_with(alive: Connection) -> None:
    alive.poll(None)  # nothing is ever sent: this returns when the other end closes
    os._exit(1)


@contextmanager
def ctrl_c_ignored() -> Iterator[None]:
    """Processes that are started meanwhile never see Ctrl-C."""
    if current_thread() is not main_thread():  # Ctrl-C is the main thread's affair, and signals may be set there alone
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
