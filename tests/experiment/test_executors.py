"""Who runs the jobs of a study: the same answers from all, failures where they belong, and plain words from Dask's."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any, TypeVar

import pytest

from harness.errors import BadInput, MissingExtra
from harness.experiment.workers import executors
from harness.experiment.workers.executors import dask_executor, process_executor
from harness.results import source_hash
from tests.interrupts import heeding_interrupts

R = TypeVar("R")

needs_dask = pytest.mark.skipif(find_spec("distributed") is None, reason="no Dask: extra `cluster` is not installed")


def says_who_it_is(beside: Path) -> int:
    """And is killed the first time."""
    if not beside.exists():
        beside.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    print("this is talk")
    return os.getpid()


def fails() -> None:
    raise ZeroDivisionError("on purpose")


def dies() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_a_single_job_is_done_here() -> None:
    with process_executor(1) as executor:
        ended = executor(divmod, [(7, 2), (9, 4)])
        assert {which: future.result() for which, future in ended} == {0: (3, 1), 1: (2, 1)}
        ((_, process),) = executor(os.getpid, [()])
        assert process.result() == os.getpid()
        ((_, failed),) = executor(fails, [()])
        assert isinstance(failed.exception(), ZeroDivisionError)


def test_a_worker_that_was_started_after_an_edit_refuses() -> None:
    assert executors._run_on_worker(source_hash(), os.getcwd(), divmod, 7, 2) == (3, 1)
    with pytest.raises(BadInput, match="another version"):
        executors._run_on_worker("before the edit", os.getcwd(), divmod, 7, 2)


def test_without_the_extra_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"tracker-harness\[cluster\]"), dask_executor("local"):
        pass


@needs_dask
@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "bar://127.0.0.1:1", "mute"])
def test_an_address_where_no_scheduler_answers_is_refused(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "SCHEDULER_TIMEOUT_S", 0.3)
    with ExitStack() as stack:
        if address == "mute":
            port = stack.enter_context(socket.create_server(("127.0.0.1", 0))).getsockname()[1]
            address = f"tcp://127.0.0.1:{port}"
        with pytest.raises(BadInput, match=f"No Dask scheduler at {address}"), dask_executor(address):
            pass


@needs_dask
def test_a_local_cluster_outlives_its_workers_and_listens_to_this_machine_alone(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    import psutil

    with dask_executor("local", workers=1) as each:
        ((_, future),) = each(says_who_it_is, [(tmp_path / "killed",)])
        assert future.result() != os.getpid()
        family = [psutil.Process(), *psutil.Process().children(recursive=True)]
        listening = {c.laddr.ip for p in family for c in p.net_connections("inet") if c.status == psutil.CONN_LISTEN}
    assert listening == {"127.0.0.1"}
    said = capfd.readouterr()
    assert said.out == ""
    assert said.err == "this is talk\n"
    assert not psutil.pid_exists(future.result())


@needs_dask
@pytest.mark.slow
def test_a_local_cluster_reports_what_its_workers_die_of_and_goes_on(tmp_path: Path) -> None:
    with dask_executor("local", workers=2) as each:
        tasks = [(dies, ()), (fails, ()), (says_who_it_is, (tmp_path / "killed",)), *[(os.getpid, ())] * 20]
        ended = dict(each(_call, tasks))
    assert isinstance(ended[0].exception(), BrokenExecutor)
    assert isinstance(ended[1].exception(), ZeroDivisionError)
    assert all(ended[which].result() for which in range(2, len(tasks)))


def _call(function: Callable[..., R], task: tuple[Any, ...]) -> R:
    return function(*task)


@contextmanager
def scheduler_and_worker(*, workers: int = 1) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """Of Dask's own commands, as on a cluster: the address and the scheduler."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    start = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", address, "--no-dashboard"]
    work = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-dashboard"]
    none = subprocess.DEVNULL
    with (
        subprocess.Popen([*start, "--dashboard-address", "127.0.0.1:0"], stdout=none, stderr=none) as scheduler,
        subprocess.Popen([*work, "--nworkers", str(workers)], stdout=none, stderr=none) as others,
    ):
        try:
            yield address, scheduler
        finally:
            scheduler.kill()
            others.terminate()


@needs_dask
@pytest.mark.slow
def test_a_scheduler_that_dies_ends_the_wait_with_one_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(executors, "SCHEDULER_TIMEOUT_S", 30.0)
    with scheduler_and_worker() as (address, scheduler), dask_executor(address) as each:
        calls = each(time.sleep, [(0.0,), (600.0,), (600.0,)])
        assert next(calls)[0] == 0
        scheduler.kill()
        with pytest.raises(BadInput, match="is gone"):
            next(calls)


@needs_dask
@pytest.mark.slow
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
def test_a_local_cluster_ends_with_the_program(end: signal.Signals, tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import time\n"
        "from harness.experiment.workers.executors import dask_executor\n"
        "if __name__ == '__main__':\n"
        "    with dask_executor('local', workers=2) as each:\n"
        "        for which, _ in each(time.sleep, [(0.0,), (600.0,), (600.0,)]):\n"
        "            print(which, flush=True)\n"
    )
    with subprocess.Popen(
        [sys.executable, program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=heeding_interrupts,
    ) as running:
        assert running.stdout
        assert running.stdout.readline() == "0\n"
        if end is signal.SIGINT:
            os.killpg(running.pid, end)  # as a terminal does
        else:
            running.kill()
        _, complained = running.communicate(timeout=120)  # returns when no process holds our pipes any more
    assert running.returncode == -end
    assert complained.count("Traceback") == (1 if end is signal.SIGINT else 0)  # the program's own
