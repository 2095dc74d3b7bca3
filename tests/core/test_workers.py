"""Worker processes: every task once, failures where they belong, an early end for all."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future
from pathlib import Path
from pickle import PicklingError
from typing import Any

import pytest

from harness.core.interrupts import SIGNALS
from harness.core.workers import Pool, run_in_workers, schedule_tasks
from harness.errors import SystemFault
from tests.processes import is_running, wait_until


def test_every_task_is_called_once_in_another_process() -> None:
    found = {which: future.result() for which, future in run_in_workers(divmod, [(7, 2), (9, 4), (5, 5)], 2)}
    assert found == {0: (3, 1), 1: (2, 1), 2: (1, 0)}
    ((_, future),) = run_in_workers(os.getpid, [()], 1)
    assert future.result() != os.getpid()


def test_an_error_is_the_tasks_own() -> None:
    failed = {which: future.exception() for which, future in run_in_workers(divmod, [(7, 2), (1, 0)], 2)}
    assert failed[0] is None
    assert isinstance(failed[1], ZeroDivisionError)


def test_a_worker_that_dies_is_told() -> None:
    ((_, future),) = run_in_workers(os._exit, [(3,)], 1)
    assert isinstance(future.exception(), BrokenExecutor)


def dies(times: int, there: Path) -> str:
    """Kill the worker that many times, then say which tasks were under way beside this one."""
    begun = sum(1 for name in there.iterdir() if name.suffix == ".begun")
    if begun < times:
        (there / f"{begun}.begun").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return " ".join(sorted(path.name for path in there.iterdir() if path.suffix == ".running"))


def takes_long(there: Path) -> str:
    mark = there / f"{os.getpid()}.running"
    mark.touch()
    time.sleep(0.3)
    mark.unlink()
    return "done"


def test_a_worker_that_dies_takes_nothing_with_it_but_its_task_which_is_begun_once_more_alone(tmp_path: Path) -> None:
    (once := tmp_path / "once").mkdir()
    (always := tmp_path / "always").mkdir()
    tasks: list[tuple[Any, ...]] = [(dies, 1, once), (dies, 2, always), (takes_long, once), (takes_long, always)]
    ended = list(run_in_workers(_call, tasks, 2))
    assert sorted(which for which, _ in ended[:2]) == [2, 3]
    came = dict(ended)
    assert came[2].result() == came[3].result() == "done"
    assert came[0].result() == ""  # nothing ran beside it
    assert isinstance(came[1].exception(), BrokenExecutor)


def _call(function: Callable[..., Any], *task: Any) -> Any:
    return function(*task)


def test_a_pool_keeps_its_workers_for_the_next_call_and_starts_no_more_than_it_needs() -> None:
    pool = Pool(3)
    ((_, first),) = pool(os.getpid, [()])
    ((_, again),) = pool(os.getpid, [()])
    assert first.result() == again.result()
    calls = pool(time.sleep, [(0.0,), (600.0,)])
    assert next(calls)[0] == 0
    calls.close()  # stops all that runs, and is no end of the pool
    ((_, anew),) = pool(os.getpid, [()])
    assert anew.result() != first.result()
    pool.close()


def starts_a_child(mark: Path) -> None:
    """Write a temporary file, start a process, and wait."""
    descriptor, path = tempfile.mkstemp()
    os.close(descriptor)
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
    mark.with_suffix(".new").write_text(f"{child.pid} {path}")
    mark.with_suffix(".new").rename(mark)
    time.sleep(600)


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="Windows has no process groups")
def test_a_worker_that_is_stopped_leaves_no_process_and_no_file(tmp_path: Path) -> None:
    mark = tmp_path / "mark"
    calls = run_in_workers(_call, [(time.sleep, 0.0), (starts_a_child, mark)], 2)
    assert next(calls)[0] == 0
    while not mark.exists():
        time.sleep(0.01)
    child, temporary = mark.read_text().split()
    assert Path(temporary).exists()
    calls.close()
    assert not Path(temporary).parent.exists()
    wait_until(lambda: not is_running(int(child)))


class Unreadable:
    """An answer that its process can send and this one cannot read."""

    def __reduce__(self) -> tuple[Callable[[str], object], tuple[str]]:
        return int, ("no number",)


def test_an_answer_that_cannot_be_read_breaks_its_own_task_alone() -> None:
    begin_s = time.monotonic()
    ended = dict(run_in_workers(_call, [(Unreadable,), (abs, -1)], 1))
    assert isinstance(ended[0].exception(), BrokenExecutor)
    assert ended[1].result() == 1
    assert time.monotonic() - begin_s < 60.0


def signals_of_this_process() -> set[int]:
    """Signals that are blocked or ignored here."""
    blocked = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    return {number for number in SIGNALS if number in blocked or signal.getsignal(number) is signal.SIG_IGN}


def test_a_worker_sees_no_signal() -> None:
    ((_, future),) = run_in_workers(signals_of_this_process, [()], 1)
    assert future.result() == set(SIGNALS)


def test_stopping_early_stops_what_runs() -> None:
    calls = run_in_workers(time.sleep, [(0.0,), (600.0,), (600.0,)], 2)
    assert next(calls)[0] == 0
    begin = time.monotonic()
    calls.close()
    assert time.monotonic() - begin < 20.0


@pytest.mark.parametrize("workers", [1, 2])
def test_the_order_of_tasks_does_not_matter_to_their_number(workers: int) -> None:
    assert sorted(which for which, _ in run_in_workers(abs, [(-n,) for n in range(5)], workers)) == [0, 1, 2, 3, 4]


def _sleep_and_name_process() -> int:
    time.sleep(0.3)
    return os.getpid()


def test_a_worker_stays_with_the_tasks_of_its_group() -> None:
    pool = Pool(2)
    try:
        list(pool(_sleep_and_name_process, [()] * 2))  # both processes run from here on
        ended = pool(_sleep_and_name_process, [()] * 6, ["a", "a", "a", "b", "b", "b"])
        pids = [pid for _, pid in sorted((index, future.result()) for index, future in ended)]
    finally:
        pool.close()
    assert pids == [pids[0]] * 3 + [pids[3]] * 3
    assert pids[0] != pids[3]


def test_the_next_task_can_be_chosen() -> None:
    begun: list[int] = []

    def submit(index: int) -> Future[int]:
        begun.append(index)
        future = Future[int]()
        future.set_result(index)
        return future

    ended = list(schedule_tasks(submit, 4, lambda: 1, choose=lambda waiting: waiting[-1]))
    assert begun == [which for which, _ in ended] == [3, 2, 1, 0]


def test_a_worker_that_cannot_begin_is_a_fault_of_the_system(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python runs `sitecustomize` first; this one breaks a module in every process that is started."""
    (tmp_path / "sitecustomize.py").write_text("import sys\nsys.modules['harness.core.workers'] = None\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    ((_, future),) = run_in_workers(os.getpid, [()], 1)
    assert isinstance(future.exception(), SystemFault)


def raises(error: BaseException) -> None:
    raise error


@pytest.mark.parametrize(
    "error", [EOFError("mine"), OSError(28, "mine"), SystemExit("mine"), KeyboardInterrupt("mine")]
)
def test_whatever_a_task_raises_is_its_own_and_has_the_place(error: BaseException) -> None:
    ended = dict(run_in_workers(_call, [(raises, error), (abs, -1)], 1))
    raised = ended[0].exception()
    assert type(raised) is type(error)
    assert raised is not None
    assert "in raises" in str(raised.__cause__)
    assert ended[1].result() == 1


def test_a_call_that_cannot_be_sent_fails_alone() -> None:
    ended = dict(run_in_workers(_call, [(lambda: None,), (abs, -1)], 1))
    assert isinstance(ended[0].exception(), AttributeError | PicklingError)
    assert ended[1].result() == 1


def test_a_result_that_cannot_be_sent_fails_alone() -> None:
    ended = dict(run_in_workers(_call, [(_call, iter, "ab"), (make_function,), (abs, -1)], 1))
    assert list(ended[0].result()) == ["a", "b"]
    assert isinstance(ended[1].exception(), AttributeError | PicklingError)
    assert ended[2].result() == 1


def make_function() -> Callable[[], None]:
    return lambda: None
