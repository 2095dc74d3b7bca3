"""Worker processes that end with the one that started them, however it ended; Ctrl-C reaches that one alone."""

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

R = TypeVar("R")


def run_in_workers(
    function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], workers: int
) -> Generator[tuple[int, Future[R]], None, None]:
    """`function(*task)` of every task, in fresh processes: which, and what came of it, as each ends; see `Pool`."""
    pool = Pool(workers)
    try:
        yield from pool(function, tasks)
    finally:
        pool.close()


class Pool:
    """So many worker processes, which are started when first needed and then stay for the next call.

    They end with this pool, or with this process. A worker that dies takes nothing with it but its task, see
    `schedule_tasks`. What workers print goes to stderr.
    """

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._begin()

    def __call__(
        self, function: Callable[..., R], tasks: Sequence[tuple[Any, ...]]
    ) -> Generator[tuple[int, Future[R]], None, None]:
        """As `run_in_workers`. A caller that stops early, as Ctrl-C makes it, stops what runs at once."""

        def submit(which: int) -> Future[R]:
            return next(process for process in self._processes if process.idle).submit(function, *tasks[which])

        whole = False
        try:
            yield from schedule_tasks(submit, len(tasks), lambda: self._workers)
            whole = True
        finally:
            if not whole:
                self._stop()
                self._begin()

    def close(self) -> None:
        for process in self._processes:
            process.pool.shutdown(wait=False)
        for process in self._processes:
            process.pool.shutdown()
        self._stop()

    def _begin(self) -> None:
        self._theirs, self._ours = get_context("spawn").Pipe(duplex=False)
        self._processes = [_WorkerProcess(self._theirs) for _ in range(self._workers)]

    def _stop(self) -> None:
        self._ours.close()
        for process in self._processes:
            process.pool.shutdown(cancel_futures=True)
        self._theirs.close()


def schedule_tasks(
    submit: Callable[[int], Future[R]], count: int, room: Callable[[], int], *, look_s: float | None = None
) -> Generator[tuple[int, Future[R]], None, None]:
    """Tasks 0 to `count` - 1, as many under way as there is room for: which, and what came of it, as each ends.

    One that ends in BrokenExecutor, because its worker died, is begun once more when all others are done and with
    nothing beside it: what a worker dies of may be too much at a time. What comes then is what came of it.
    `room` is asked whenever a task ends, and every `look_s`.
    """
    first, again, alone = deque(range(count)), deque[int](), set[int]()
    running: dict[Future[R], int] = {}
    ended: deque[tuple[int, Future[R]]] = deque()
    while first or again or running or ended:
        places = room()
        while first and len(running) < places:
            which = first.popleft()
            running[submit(which)] = which
        if again and not (first or running):
            which = again.popleft()
            alone.add(which)
            running[submit(which)] = which
        while ended:  # when its worker has something to do; kept no longer than the caller keeps it
            yield ended.popleft()
        for future in wait(running, look_s, FIRST_COMPLETED).done:
            which = running.pop(future)
            if which not in alone and isinstance(future.exception(), BrokenExecutor):
                again.append(which)
            else:
                ended.append((which, future))


class _WorkerProcess:
    """A worker process, started when it is needed and anew when it died; a pool of one, which breaks alone."""

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
        except BrokenExecutor:  # of its last task, or while it had none
            self.pool.shutdown()
            self.pool, self._last = self._fresh(), None
            future = self._submit(function, *task)
        self._last = future
        return future

    def _submit(self, function: Callable[..., R], *task: Any) -> Future[R]:
        if self._last is not None:
            return self.pool.submit(function, *task)
        with ignore_sigint():  # which the process inherits, so that it never sees it, not even while it imports
            return self.pool.submit(function, *task)

    def _fresh(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(1, get_context("spawn"), _initialise_worker, (self._alive,))


def _initialise_worker(alive: Connection) -> None:
    sys.stdout = sys.stderr
    Thread(target=_exit_with_parent, args=(alive,), daemon=True).start()


def _exit_with_parent(alive: Connection) -> None:
    alive.poll(None)  # nothing is ever sent: this returns when the other end closes
    os._exit(1)


@contextmanager
def ignore_sigint() -> Iterator[None]:
    """Processes that are started meanwhile never see Ctrl-C."""
    if current_thread() is not main_thread():  # Ctrl-C is the main thread's affair, and signals may be set there alone
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
