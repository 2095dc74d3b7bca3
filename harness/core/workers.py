"""Worker processes that end with the process that started them, and never see a signal themselves."""

import os
import signal
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from multiprocessing import get_context
from multiprocessing.connection import Connection
from threading import Thread
from typing import Any, TypeVar

from harness.core.interrupts import SIGNALS, shield_children
from harness.core.working_folder import serve_folder, served_folders

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
        self, function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], groups: Sequence[Hashable] = ()
    ) -> Generator[tuple[int, Future[R]], None, None]:
        """Like `run_in_workers`. If the caller stops early, as after Ctrl-C, running tasks are stopped at once.

        Tasks of one group, if given, share preparation: a worker prefers those of its last group, then those of a group
        that no other worker has.
        """

        def next_process() -> _WorkerProcess:
            return next(process for process in self._processes if process.idle)

        def submit(index: int) -> Future[R]:
            process = next_process()
            process.group = groups[index] if groups else None
            return process.submit(function, *tasks[index])

        def choose(waiting: Sequence[int]) -> int:
            own = next_process()
            taken = {process.group for process in self._processes if process is not own}
            return min(waiting, key=lambda index: (groups[index] != own.group, groups[index] in taken))

        complete = False
        try:
            yield from schedule_tasks(submit, len(tasks), lambda: self._workers, choose=choose if groups else None)
            complete = True
        finally:
            if not complete:
                self._stop()
                self._begin()

    def close(self) -> None:
        for process in self._processes:
            process.pool.shutdown(wait=False)
        for process in self._processes:
            if not process.broken:
                process.pool.shutdown()
        self._stop()

    def _begin(self) -> None:
        self._processes = [_WorkerProcess() for _ in range(self._workers)]

    def _stop(self) -> None:
        for process in self._processes:
            process.leave()
        for process in self._processes:
            process.end()


def schedule_tasks(
    submit: Callable[[int], Future[R]],
    count: int,
    room: Callable[[], int],
    *,
    look_s: float | None = None,
    choose: Callable[[Sequence[int]], int] | None = None,
) -> Generator[tuple[int, Future[R]], None, None]:
    """Submit tasks 0 to `count` - 1, at most `room()` at a time; yields (index, future) as each task ends.

    A task whose worker died (BrokenExecutor) is submitted once more, alone, after all others: the worker may have died
    for lack of memory. The second result counts. `room` is called whenever a task ends, and every `look_s` seconds.
    `choose` names the next of the waiting tasks, by default the first.
    """
    first, again, alone = deque(range(count)), deque[int](), set[int]()
    running: dict[Future[R], int] = {}
    ended: deque[tuple[int, Future[R]]] = deque()
    while first or again or running or ended:
        places = room()
        while first and len(running) < places:
            index = choose(first) if choose else first[0]
            first.remove(index)
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

    def __init__(self) -> None:
        self._last: Future[Any] | None = None
        self.group: Hashable = None
        """Group of the last task."""
        self._renew()

    @property
    def idle(self) -> bool:
        return self._last is None or self._last.done()

    @property
    def broken(self) -> bool:
        """Whether the last task broke the pool: its process died, or its answer could not be read."""
        return self._last is not None and self._last.done() and isinstance(self._last.exception(), BrokenExecutor)

    def submit(self, function: Callable[..., R], *task: Any) -> Future[R]:
        try:
            future = self._submit(function, *task)
        except BrokenExecutor:  # the worker died in its last task or while idle
            self.end()
            self._last = None
            self._renew()
            future = self._submit(function, *task)
        self._last = future
        return future

    def leave(self) -> None:
        """Let the process end at once: it watches the pipe that is closed here."""
        self._own_end.close()

    def end(self) -> None:
        """End the process at once, and wait until it has ended."""
        self.leave()
        self.pool.shutdown(cancel_futures=True)
        self._worker_end.close()
        self._temporary.cleanup()

    def _submit(self, function: Callable[..., R], *task: Any) -> Future[R]:
        if self._last is not None:
            return self.pool.submit(function, *task)
        with shield_children():
            return self.pool.submit(function, *task)

    def _renew(self) -> None:
        with shield_children():  # the pool may start the process that tracks its semaphores
            self._temporary = tempfile.TemporaryDirectory(prefix="harness-worker-", ignore_cleanup_errors=True)
            self._worker_end, self._own_end = get_context("spawn").Pipe(duplex=False)
            given = (self._worker_end, self._temporary.name, served_folders())
            self.pool = ProcessPoolExecutor(1, get_context("spawn"), _initialise_worker, given)


def _initialise_worker(alive: Connection, temporary: str, folders: Mapping[str, Iterable[str]]) -> None:
    for number in SIGNALS:  # they are blocked already, but not on Windows
        signal.signal(number, signal.SIG_IGN)
    if hasattr(os, "setpgid"):
        os.setpgid(0, 0)  # a group of its own, which ends with it: processes that the task starts
    tempfile.tempdir = os.environ["TMPDIR"] = temporary  # a process that is stopped at once leaves files behind
    sys.stdout = sys.stderr
    for folder, names in folders.items():
        serve_folder(folder, names)
    Thread(target=_exit_with_parent, args=(alive,), daemon=True).start()


def _exit_with_parent(alive: Connection) -> None:
    alive.poll(None)  # nothing is ever sent; this returns when the other end closes
    if hasattr(os, "killpg"):
        os.killpg(0, signal.SIGKILL)
    os._exit(1)
