"""The loop over tasks: it hands them to an executor and yields the outcome of each cell.

A cell that kills its worker costs its task, whose cells are then tried one by one.
"""

import os
import time
import traceback
from collections.abc import Generator, Sequence
from concurrent.futures import BrokenExecutor
from contextlib import closing
from functools import cache
from pathlib import Path

from harness.errors import HarnessError
from harness.experiment.cells import CellOutcome, run_task
from harness.experiment.tasks import ClipTask, split_task
from harness.experiment.workers.executors import TaskExecutor


def evaluate_tasks(
    tasks: Sequence[ClipTask], out: Path, stop: Path, executor: TaskExecutor
) -> Generator[CellOutcome, None, None]:
    """Evaluate the cells of tasks in the folder `out`; it ends early once the file `stop` exists."""
    broken = yield from _attempt(tasks, out, stop, executor)
    # One cell of a task may be to blame for the worker's death: the cells are tried one by one.
    for task in (
        yield from _attempt([single for whole in broken for single in split_task(whole)], out, stop, executor)
    ):
        yield CellOutcome(str(task.cells()[0]), failure="a worker process died")


def _attempt(
    tasks: Sequence[ClipTask], out: Path, stop: Path, executor: TaskExecutor
) -> Generator[CellOutcome, None, list[ClipTask]]:
    """Evaluate tasks; returns those whose worker died."""
    if not tasks or stop.exists():
        return []
    broken = []
    arguments = [(_session_id(), task, out.absolute(), stop.absolute()) for task in tasks]
    with closing(executor(run_task, arguments)) as ended:  # an interrupt stops its workers at once
        for which, future in ended:
            done = set[str]()
            try:
                for outcome in future.result():
                    done.add(outcome.cell)
                    yield outcome
            except BrokenExecutor:
                broken.append(tasks[which])
            except HarnessError as error:
                if not out.is_dir():  # a worker calls it a folder that it does not see
                    raise FileNotFoundError(str(error)) from error
                raise
            except Exception:  # the task could not be sent or answered: its cells fail, the others go on
                failure = traceback.format_exc()
                for planned in tasks[which].cells():
                    if str(planned) not in done:
                        yield CellOutcome(str(planned), failure=failure)
    return broken


@cache
def _session_id() -> str:
    """Name of this process for workers, which clear their caches when it changes."""
    return f"{os.getpid()} {time.time_ns()}"
