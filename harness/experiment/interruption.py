"""Interruption by Ctrl-C: the first lets running cells finish, the second stops at once."""

import os
import signal
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from threading import current_thread, main_thread
from types import FrameType

_STOP_MESSAGE = b"\nharness: finishing what runs; again stops it at once\n"


@contextmanager
def graceful_stop(stop: Path) -> Iterator[None]:
    """Turn the first Ctrl-C or SIGTERM into the file `stop`, which workers look for; the next raises KeyboardInterrupt.

    Leaving the context removes the file, and raises KeyboardInterrupt if the file existed.
    """
    stop.unlink(missing_ok=True)

    def request_stop(number: int, frame: FrameType | None) -> None:
        if stop.exists():
            raise KeyboardInterrupt
        stop.touch()
        os.write(2, _STOP_MESSAGE)  # os.write is safe while something else is printed

    with ExitStack() as after:
        after.callback(stop.unlink, missing_ok=True)
        if current_thread() is main_thread():  # signal handlers can be set there alone
            for number in (signal.SIGINT, signal.SIGTERM):
                after.callback(signal.signal, number, signal.signal(number, request_stop))
        yield
        if stop.exists():
            raise KeyboardInterrupt
