"""Worker processes: every task once, failures where they belong, an early end for all."""

import os
import time
from concurrent.futures import BrokenExecutor

import pytest

from harness.core.workers import call_each


def test_every_task_is_called_once_in_another_process() -> None:
    found = {which: future.result() for which, future in call_each(divmod, [(7, 2), (9, 4), (5, 5)], 2)}
    assert found == {0: (3, 1), 1: (2, 1), 2: (1, 0)}
    ((_, future),) = call_each(os.getpid, [()], 1)
    assert future.result() != os.getpid()


def test_an_error_is_the_tasks_own() -> None:
    failed = {which: future.exception() for which, future in call_each(divmod, [(7, 2), (1, 0)], 2)}
    assert failed[0] is None
    assert isinstance(failed[1], ZeroDivisionError)


def test_a_worker_that_dies_is_told() -> None:
    ((_, future),) = call_each(os._exit, [(3,)], 1)
    assert isinstance(future.exception(), BrokenExecutor)


def test_stopping_early_stops_what_runs() -> None:
    calls = call_each(time.sleep, [(0.0,), (600.0,), (600.0,)], 2)
    assert next(calls)[0] == 0
    begin = time.monotonic()
    calls.close()
    assert time.monotonic() - begin < 20.0


@pytest.mark.parametrize("workers", [1, 2])
def test_the_order_of_tasks_does_not_matter_to_their_number(workers: int) -> None:
    assert sorted(which for which, _ in call_each(abs, [(-n,) for n in range(5)], workers)) == [0, 1, 2, 3, 4]
