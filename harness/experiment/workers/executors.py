"""Executors, which run tasks in this process, in a local pool of processes, or on the workers of a Dask scheduler.

All have one interface: `executor(function, tasks)` yields the index and the future of each task as it ends.
Dask's transport pickles what it carries, so everyone who reaches a scheduler can run code on it and its workers.
A local scheduler listens on loopback alone; any other is used only if it is named.
"""

import asyncio
import logging
import os
import signal
import sys
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Future
from contextlib import contextmanager, redirect_stdout
from functools import partial
from importlib.util import find_spec
from tempfile import TemporaryDirectory
from threading import Lock
from typing import Any, Protocol, TypeVar

from harness.core.interrupts import shield_children
from harness.core.workers import Pool, schedule_tasks
from harness.core.working_folder import THREAD_VARIABLES, serve_folder
from harness.errors import BadInput, MissingExtra
from harness.experiment.tasks import ClipTask
from harness.results import source_hash

R = TypeVar("R")

SCHEDULER_TIMEOUT_S = 5.0
"""Time within which a scheduler must answer [s]."""
POLL_INTERVAL_S = 1.0
"""Interval at which the scheduler is asked for its state and its number of workers [s]."""
LOCAL_CLUSTER_CONFIG = {
    "distributed.scheduler.allowed-failures": 1,  # dead workers per task; `schedule_tasks` tries it alone
    "distributed.scheduler.http.routes": [],
    "distributed.worker.http.routes": [],
    "distributed.worker.profile.enabled": False,  # it would slow the steps that are timed
    "distributed.worker.preload": ["import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)"],
}
"""Dask settings of a local cluster."""
_WORKER_ENVIRONMENT = dict.fromkeys((*THREAD_VARIABLES, "PYTHONSAFEPATH"), 1)


class TaskExecutor(Protocol):
    """Calls a function with the arguments of each task, and yields (index, future) as each task ends."""

    def __call__(
        self, function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], /
    ) -> Generator[tuple[int, Future[R]], None, None]: ...


@contextmanager
def process_executor(jobs: int) -> Iterator[TaskExecutor]:
    """An executor of `jobs` worker processes, which are started when needed; with one job, this process."""
    if jobs == 1:
        yield run_in_process
        return
    pool = Pool(jobs)
    try:
        yield partial(_run_on_pool, pool)
    finally:
        pool.close()


def _run_on_pool(
    pool: Pool, function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], /
) -> Generator[tuple[int, Future[R]], None, None]:
    groups = [next((part.group for part in task if isinstance(part, ClipTask)), None) for task in tasks]
    return pool(_run_on_worker, [(source_hash(), os.getcwd(), function, *task) for task in tasks], groups)


def run_in_process(
    function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], /
) -> Generator[tuple[int, Future[R]], None, None]:
    """Run tasks one after another in this process. A result that is an iterator is run while it is read."""
    for which, task in enumerate(tasks):
        future = Future[R]()
        try:
            future.set_result(function(*task))
        except Exception as error:
            future.set_exception(error)
        yield which, future


@contextmanager
def dask_executor(address: str, workers: int | None = None) -> Iterator[TaskExecutor]:
    """An executor on the workers of the Dask scheduler at an address such as tcp://host:8786.

    `local` starts a scheduler on this machine with `workers` workers, by default one per core; they end with this
    process. A task whose worker dies is started again elsewhere; if that fails too, its future has BrokenExecutor.
    Function and tasks travel pickled. Workers must have the same source of the harness and see the same folders.
    MissingExtra without the extra `cluster`; BadInput when no scheduler answers, or the connection is lost.
    """
    if find_spec("distributed") is None:
        raise MissingExtra("A Dask cluster", "distributed", "cluster")
    from distributed import Client
    from distributed.utils import silence_logging_cmgr

    with (
        silence_logging_cmgr(logging.CRITICAL),
        _connect_scheduler(address, workers) as found,
        Client(found, set_as_default=False) as client,
    ):
        yield partial(_run_on_dask, client, address)


@contextmanager
def _connect_scheduler(address: str, workers: int | None) -> Iterator[Any]:
    """The address, or a local cluster."""
    if address != "local":
        asyncio.run(_require_scheduler(address))
        yield address
        return
    from dask import config
    from distributed import LocalCluster

    with (
        TemporaryDirectory(prefix="harness-dask-", ignore_cleanup_errors=True) as folder,
        config.set({**LOCAL_CLUSTER_CONFIG, "temporary-directory": folder}),
        config.set({"distributed.nanny.pre-spawn-environ": {**_WORKER_ENVIRONMENT, "TMPDIR": folder}}),
    ):
        with shield_children():
            cluster = LocalCluster(
                n_workers=workers or os.cpu_count() or 1,
                threads_per_worker=1,
                host="127.0.0.1",
                scheduler_kwargs={"dashboard": False, "dashboard_address": "127.0.0.1:0"},
                memory_limit=0,  # no limit of Dask's own, which would pause and kill workers
                silence_logs=logging.CRITICAL,
            )
        with cluster:
            try:
                yield cluster
            except BaseException:  # such as Ctrl-C; Dask alone would wait some seconds for running tasks
                for nanny in cluster.workers.values():
                    nanny.auto_restart = False
                    if nanny.pid:
                        os.kill(nanny.pid, signal.SIGKILL)
                raise


async def _require_scheduler(address: str) -> None:
    """BadInput unless a scheduler answers. A Dask client would wait for a silent one for ever."""
    from distributed import Security, rpc

    advice = "Start one with `dask scheduler`, which prints its address, or take --dask local."
    try:
        keys = Security().get_connection_args("client")  # TLS keys of Dask's configuration, if any
        async with asyncio.timeout(SCHEDULER_TIMEOUT_S), rpc(address, connection_args=keys) as asked:
            kind = (await asked.identity())["type"]
    except Exception as error:  # an unknown server may answer anything
        reason = str(error).rstrip(".") or f"no answer in {SCHEDULER_TIMEOUT_S:g} s"
        raise BadInput(f"No Dask scheduler at {address}: {reason}.", advice) from error
    if kind != "Scheduler":
        raise BadInput(f"No Dask scheduler at {address}, but a {kind.lower()}.", advice)


def _run_on_dask(
    client: Any, address: str, function: Callable[..., R], tasks: Sequence[tuple[Any, ...]], /
) -> Generator[tuple[int, Future[R]], None, None]:
    source, folder = source_hash(), os.getcwd()
    room = _DaskCapacity(client)

    def submit(which: int) -> Future[R]:
        return _to_future(client.submit(_run_on_worker, source, folder, function, *tasks[which], pure=False))

    try:
        for which, future in schedule_tasks(submit, len(tasks), room.capacity, look_s=POLL_INTERVAL_S):
            if isinstance(future.exception(), CancelledError):  # nobody here cancels: the connection was lost
                raise OSError("lost")
            yield which, future
    except OSError as error:
        advice = "What was finished is kept, the same command goes on from there."
        raise BadInput(f"The Dask scheduler at {address} is gone.", advice) from error


class _DaskCapacity:
    """Number of tasks that a scheduler is given at a time.

    It is one per worker: tasks that wait in a worker that dies would be suspected as well.
    """

    def __init__(self, client: Any) -> None:
        self._client, self._asked_s, self._places = client, -POLL_INTERVAL_S, 1

    def capacity(self) -> int:
        """Number of workers; OSError when the scheduler is gone."""
        if self._client.status != "running":
            raise OSError(self._client.status)
        if time.monotonic() - self._asked_s >= POLL_INTERVAL_S:
            self._places = max(1, len(self._client.nthreads()))
            self._asked_s = time.monotonic()
        return self._places


def _to_future(submitted: Any) -> Future[Any]:
    """A future of the standard library from one of Dask."""
    from distributed.scheduler import KilledWorker

    future = Future[Any]()

    def end(submitted: Any) -> None:
        try:
            future.set_result(submitted.result())
        except KilledWorker as error:
            future.set_exception(BrokenExecutor(str(error)))
        except BaseException as error:
            future.set_exception(error)

    submitted.add_done_callback(end)
    return future


_worker_lock = Lock()
"""Held while a task runs: threads of one worker would disturb each other's times and output."""


def _run_on_worker(source: str, folder: str, function: Callable[..., R], *task: Any) -> R:
    """Run a task in a worker; BadInput when the worker's code differs from the caller's, as after an edit.

    A result that is an iterator is returned as a list.
    """
    if source_hash() != source:
        advice = "Start both anew with the same one; what was finished is kept."
        raise BadInput("A worker has another version of the harness than the program that it works for.", advice)
    with _worker_lock, redirect_stdout(sys.stderr):
        serve_folder(folder)  # a user's own method may lie in the caller's working directory
        result = function(*task)
        return list(result) if isinstance(result, Iterator) else result  # type: ignore[return-value]  # both are iterable
