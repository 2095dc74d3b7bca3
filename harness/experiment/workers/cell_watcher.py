"""Progress while workers compute, and the end of a run that is interrupted.

A worker reports the cells of a whole task at once, which may be minutes after the first of them was written. Cells are
folders that appear whole, so a thread counts them there, on this computer or on a disk that workers share.
"""

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import Event, Lock, Thread

from harness.core.files import TEMPORARY
from harness.core.interrupts import answer_first_interrupt, raise_interrupt
from harness.errors import HarnessError
from harness.results import PRIMARY_METRIC, cell_folder, read_row

_POLL_INTERVAL_S = 0.5
_MOST_SHARE = 0.05
"""Most of a core's time that the polls of a large folder take."""
_STOP_MESSAGE = b"\nharness: finishing what runs; again stops it at once\n"


class ProgressCount:
    """The number of cells that ended in this run, from the outcomes of tasks and from the folder, each counted once."""

    def __init__(self, out: Path, report: Callable[[str, int], None]) -> None:
        """`report` is called with a text on the last cell and the number of cells, which never falls."""
        self._out, self._report, self._lock = out, report, Lock()
        self._before, self._ended = set(_finished(out)), set[str]()

    def add(self, cell: str, key: str) -> None:
        """Count a cell whose outcome is known; `key` is "" for one that failed."""
        with self._lock:
            self._ended.add(key or cell)
            self._report(cell, len(self._ended))

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Count the cells that appear in the folder meanwhile, from a thread."""
        ended = Event()
        thread = Thread(target=self._watch, args=(ended,), daemon=True)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def _watch(self, ended: Event) -> None:
        pause_s = _POLL_INTERVAL_S
        while not ended.wait(pause_s):
            start = time.perf_counter()
            with suppress(OSError):  # the folder was removed: the run itself reports it
                self.look()
            pause_s = max(_POLL_INTERVAL_S, (time.perf_counter() - start) / _MOST_SHARE)

    def look(self) -> None:
        """Count the cells that are in the folder and were not when this run began."""
        with self._lock:
            new = set(_finished(self._out)) - self._before - self._ended
            if new:
                self._ended |= new
                self._report(_describe_cell(self._out, max(new)), len(self._ended))


def _finished(out: Path) -> list[str]:
    """Keys of the finished cells in the folder of a run."""
    return [name for name in os.listdir(out / "cells") if not name.startswith(TEMPORARY)]


def _describe_cell(out: Path, key: str) -> str:
    """A cell with its error, such as "ik on boxing_p1_01: 2.76°"; "" for one that cannot be read."""
    with suppress(HarnessError, OSError):
        row = read_row(cell_folder(out, key))
        error = row[PRIMARY_METRIC]
        return f"{row['method']} on {row['clip']}" + ("" if error is None else f": {error:.2f}°")
    return ""


@contextmanager
def graceful_stop(stop: Path) -> Iterator[None]:
    """Turn the first signal into the file `stop`, which workers look for; the next raises KeyboardInterrupt.

    Leaving the context removes the file, and raises KeyboardInterrupt if the file existed.
    """
    stop.unlink(missing_ok=True)

    def request_stop() -> None:
        try:
            stop.touch()
        except OSError:  # the folder vanished or its disk is full: stop at once
            raise_interrupt()
        os.write(2, _STOP_MESSAGE)  # os.write is safe while something else is printed

    try:
        with answer_first_interrupt(request_stop):
            yield
            if stop.exists():
                raise_interrupt()
    finally:
        stop.unlink(missing_ok=True)
