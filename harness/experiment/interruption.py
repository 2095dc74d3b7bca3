"""Interruption of a run: the first signal lets running cells finish, the next one stops at once."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from harness.core.interrupts import answer_first_interrupt, raise_interrupt

_STOP_MESSAGE = b"\nharness: finishing what runs; again stops it at once\n"


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
