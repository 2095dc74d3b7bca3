"""Worker processes that end with the process that started them, and never see a signal themselves."""

import traceback
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import suppress
from pickle import PicklingError
from threading import Thread
from typing import Any, TypeVar

from harness.core.child_process import FunctionProcess
from harness.core.working_folder import serve_folder, served_folders
from harness.errors import SystemFault

R = TypeVar("R")

_END_S = 5.0
"""Time that an idle worker has to end [s]; then it is killed."""


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
        self._stop(_END_S)

    def _begin(self) -> None:
        self._processes = [_WorkerProcess() for _ in range(self._workers)]

    def _stop(self, patience_s: float = 0.0) -> None:
        for process in self._processes:
            process.leave()
        for process in self._processes:
            process.end(patience_s)


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
    """A worker process, started when needed and again after it died."""

    def __init__(self) -> None:
        self._process: FunctionProcess | None = None
        self._last: Future[Any] | None = None
        self.group: Hashable = None
        """Group of the last task."""

    @property
    def idle(self) -> bool:
        return self._last is None or self._last.done()

    def submit(self, function: Callable[..., R], *task: Any) -> Future[R]:
        """Start a task; SystemFault when no process can be started for it, here or in its future."""
        if self._process is not None and self._process.exit_code is not None:  # it died in its last task or while idle
            self.end()
        new, self._process = self._process is None, self._process or FunctionProcess(_work, served_folders())
        self._last = future = Future[R]()
        Thread(target=_carry_out, args=(future, self._process, new, (function, task)), daemon=True).start()
        return future

    def leave(self) -> None:
        """Let the process end: it watches the pipe that is closed here."""
        if self._process is not None:
            self._process.leave()

    def end(self, patience_s: float = 0.0) -> None:
        """Wait until the process has ended; it is killed after a time, or at once while a task runs."""
        if self._process is not None:
            self._process.close(patience_s if self.idle else 0.0)
            self._process = None


def _carry_out(future: Future[Any], process: FunctionProcess, new: bool, call: tuple[Any, ...]) -> None:
    """Send a call to a worker, and put its result or its exception into the future."""
    began = not new
    try:
        began = began or process.receive()
        process.pipe.send(call)
    except (EOFError, OSError):
        pass  # it has ended, as `receive` says too
    except Exception as problem:  # the call cannot be pickled
        future.set_exception(problem)
        return
    try:
        result, error, place = process.receive()
    except EOFError:
        process.close()
        advice = "Its own message is above. Does `harness doctor` pass?"
        fault = SystemFault("A worker process ended before its first task.", advice)
        future.set_exception(BrokenExecutor("a worker process died") if began else fault)
    except Exception as problem:
        future.set_exception(BrokenExecutor(f"its answer cannot be read ({type(problem).__name__}: {problem})"))
    else:
        if error is None:
            future.set_result(result)
        else:
            error.__cause__ = RuntimeError(f"in a worker process:\n{place}")
            future.set_exception(error)


def _work(pipe: Any, folders: Mapping[str, Iterable[str]]) -> None:
    """Carry out calls until the pipe ends; `folders` are those of the program's user modules."""
    for folder, names in folders.items():
        serve_folder(folder, names)
    pipe.send(True)
    with suppress(EOFError, OSError):
        while True:
            answer = _call(*pipe.recv())
            try:
                pipe.send(answer)
            except (TypeError, AttributeError, PicklingError) as error:  # it cannot be pickled
                pipe.send((None, error, ""))


def _call(function: Callable[..., R], task: tuple[Any, ...]) -> tuple[R | None, BaseException | None, str]:
    """The result of a call, or the exception that it raises and its traceback."""
    try:
        return function(*task), None, ""
    except BaseException as error:
        return None, error, traceback.format_exc()
