"""Tests drawn mutations one by one, against an unmutated run of the same tests."""

import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from threading import Lock

from tests.mutants.checkout_copy import CheckoutCopy, PytestRun
from tests.mutants.equivalent import Equivalent, reason_of
from tests.mutants.operators import Mutation
from tests.mutants.process_groups import ProcessGroups
from tests.mutants.relevance import Batch, Suite

_LIMIT_RATIO, _LIMIT_S = 4.0, 60.0
"""Time limit of a run: this many times that of the unmutated one, plus so many seconds."""
_REFERENCE_LIMIT_S = 3600.0


class RedReference(Exception):
    """The tests fail without a mutation, so nothing can be said."""


@dataclass(frozen=True)
class Result:
    """What became of one mutation."""

    mutation: Mutation
    caught_by: str = ""
    """The test that failed, "timeout", or an exit code; "" for a mutation that no test noticed."""
    equivalent: str = ""
    """The reason why no test can notice it."""

    @property
    def outcome(self) -> str:
        if self.equivalent:
            return f"equivalent: {self.equivalent}"
        return f"caught by {self.caught_by}" if self.caught_by else "SURVIVED"


def share_caught(results: Sequence[Result]) -> float:
    """Share of the mutations that are not equivalent; 1 if there is none."""
    real = [result for result in results if not result.equivalent]
    return sum(bool(result.caught_by) for result in real) / len(real) if real else 1.0


class _Reference:
    """Unmutated runs, one for each batch of tests, when they are first needed."""

    def __init__(self) -> None:
        self._runs: dict[Batch, PytestRun] = {}
        self._locks: dict[Batch, Lock] = {}
        self._lock = Lock()

    def limit_s(self, batch: Batch, copy: CheckoutCopy) -> float:
        """Time limit of a mutated run [s]; RedReference. `copy` must not be mutated."""
        with self._lock:
            lock = self._locks.setdefault(batch, Lock())
        with lock:
            if batch not in self._runs:
                run = copy.run_tests(batch, _REFERENCE_LIMIT_S)
                if not run.passed:
                    raise RedReference(f"The tests fail without a mutation: {run.reason}")
                self._runs[batch] = run
            return _LIMIT_RATIO * self._runs[batch].seconds + _LIMIT_S


def run_campaign(
    checkout: Path,
    drawn: Sequence[Mutation],
    equivalents: Sequence[Equivalent],
    *,
    jobs: int,
    near: bool,
    report: Callable[[Result], None],
) -> list[Result]:
    """Results in the order of `drawn`; `report` is called with each as it comes. RedReference.

    Every job has its own copy of the checkout. An exception such as KeyboardInterrupt kills the tests of all jobs and
    removes the copies. `near` tries the tests of the module's own package alone.
    """
    reference, suite, processes = _Reference(), Suite(checkout), ProcessGroups()

    def test_one(mutation: Mutation) -> Result:
        if reason := reason_of(mutation, equivalents):
            result = Result(mutation, equivalent=reason)
        else:
            copy = copies.get()
            try:
                result = Result(mutation, _catch(copy, mutation))
            finally:
                copies.put(copy)
        report(result)
        return result

    def _catch(copy: CheckoutCopy, mutation: Mutation) -> str:
        for batch in suite.batches(mutation.file, near=near):
            limit_s = reference.limit_s(batch, copy)
            with copy.mutated(mutation):
                run = copy.run_tests(batch, limit_s)
            if not run.passed:
                return run.reason
        return ""

    with tempfile.TemporaryDirectory(prefix="mutants") as scratch, ThreadPoolExecutor(jobs) as pool:
        copies: SimpleQueue[CheckoutCopy] = SimpleQueue()
        for job in range(jobs):
            folder = Path(scratch) / str(job)
            folder.mkdir()
            copies.put(CheckoutCopy.make(checkout, folder, processes))
        try:
            pending = [pool.submit(test_one, mutation) for mutation in drawn]
            for future in wait(pending, return_when=FIRST_EXCEPTION).done:
                future.result()
            return [future.result() for future in pending]
        finally:
            processes.stop()
            pool.shutdown(wait=False, cancel_futures=True)
