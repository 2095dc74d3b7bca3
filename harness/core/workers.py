"""Worker processes that end with the process that started them, and never see Ctrl-C themselves."""

import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread, current_thread, main_thread
from typing import Any, TypeVar

from harness.core.python_process import safe_import_path

R = TypeVar("R")


def run_in_workers(
    function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], workers: int
) -> Generator[tuple[int, Future[R]], None, None]:
    """Call `function(*task)` for every task in new processes; yields (index, future) as each task ends (see `Pool`)."""
    pool = Pool(workers)
    try:
        yield from pool(function, tasks)
    finally:
        pool.close()


class Pool:
    """A pool of worker processes, started when first needed and kept for later calls.

    They end with the pool, or with this process. A worker that dies loses only its task (see `schedule_tasks`). Workers
    print to stderr.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._begin()

    def __call__(
        self, function: Callable[..., R], tasks: Sequence[tuple[Any, ...]]
    ) -> Generator[tuple[int, Future[R]], None, None]:
        """Like `run_in_workers`. If the caller stops early, as after Ctrl-C, running tasks are stopped at once."""

        def submit(index: int) -> Future[R]:
            return next(process for process in self._processes if process.idle).submit(function, *tasks[index])

        complete = False
        try:
            yield from schedule_tasks(submit, len(tasks), lambda: self._workers)
            complete = True
        finally:
            if not complete:
                self._stop()
                self._begin()

    def close(self) -> None:
        for process in self._processes:
            process.pool.shutdown(wait=False)
        for process in self._processes:
            process.pool.shutdown()
        self._stop()

    def _begin(self) -> None:
        self._worker_end, self._own_end = get_context("spawn").Pipe(duplex=False)
        self._processes = [_WorkerProcess(self._worker_end) for _ in range(self._workers)]

    def _stop(self) -> None:
        self._own_end.close()
        for process in self._processes:
            process.pool.shutdown(cancel_futures=True)
        self._worker_end.close()


def schedule_tasks(
    submit: Callable[[int], Future[R]], count: int, room: Callable[[], int], *, look_s: float | None = None
) -> Generator[tuple[int, Future[R]], None, None]:
    """Submit tasks 0 to `count` - 1, at most `room()` at a time; yields (index, future) as each task ends.

    A task whose worker died (BrokenExecutor) is submitted once more, alone, after all others: the worker may have died
    for lack of memory. The second result counts. `room` is called whenever a task ends, and every `look_s` seconds.
    """
    first, again, alone = deque(range(count)), deque[int](), set[int]()
    running: dict[Future[R], int] = {}
    ended: deque[tuple[int, Future[R]]] = deque()
    while first or again or running or ended:
        places = room()
        while first and len(running) < places:
            index = first.popleft()
            running[submit(index)] = index
        if again and not (first or running):
            index = again.popleft()
            alone.add(index)
            running[submit(index)] = index
        while ended:  # after the workers have new tasks; no reference to a result is kept
            yield ended.popleft()
        for future in wait(running, look_s, FIRST_COMPLETED).done:
            index = running.pop(future)
            if index not in alone and isinstance(future.exception(), BrokenExecutor):
                again.append(index)
            else:
                ended.append((index, future))


class _WorkerProcess:
    """A worker process, started when needed and again after it died: a pool of one, so that no other breaks with it."""

    def __init__(self, alive: Connection) -> None:
        self._alive = alive
        self._last: Future[Any] | None = None
        self.pool = self._fresh()

    @property
    def idle(self) -> bool:
        return self._last is None or self._last.done()

    def submit(self, function: Callable[..., R], *task: Any) -> Future[R]:
        try:
            future = self._submit(function, *task)
        except BrokenExecutor:  # the worker died in its last task or while idle
            self.pool.shutdown()
            self.pool, self._last = self._fresh(), None
            future = self._submit(function, *task)
        self._last = future
        return future

    def _submit(self, function: Callable[..., R], *task: Any) -> Future[R]:
        if self._last is not None:
            return self.pool.submit(function, *task)
        with safe_import_path(), ignore_sigint():  # inherited, so that the process ignores Ctrl-C even while it imports
            return self.pool.submit(function, *task)

    def _fresh(self) -> ProcessPoolExecutor:
        with safe_import_path():  # its locks start a process too
            return ProcessPoolExecutor(1, get_context("spawn"), _initialise_worker, (self._alive,))


def _initialise_worker(alive: Connection) -> None:
    sys.stdout = sys.stderr
    Thread(target=_exit_with_parent, args=(alive,), daemon=True).start()


def _exit_with_parent(alive: Connection) -> None:
    alive.poll(None)  # nothing is ever sent; this returns when the other end closes
    os._exit(1)


@contextmanager
def ignore_sigint() -> Iterator[None]:
    """Processes started in the block ignore Ctrl-C."""
    if current_thread() is not main_thread():  # only the main thread may set signal handlers
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
