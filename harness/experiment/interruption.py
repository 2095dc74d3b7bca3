"""How long work is stopped: the first Ctrl-C lets what runs finish, the second one does not."""

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
    """The first Ctrl-C or SIGTERM makes the file `stop`, which whoever works looks for; any further one is
    KeyboardInterrupt. Leaving raises it too when there was one, and removes the file."""
    stop.unlink(missing_ok=True)

    def ask(number: int, frame: FrameType | None) -> None:
        if stop.exists():
            raise KeyboardInterrupt
        stop.touch()
        os.write(2, _STOP_MESSAGE)  # a signal may strike while something is printed

    with ExitStack() as after:
        after.callback(stop.unlink, missing_ok=True)
        if current_thread() is main_thread():  # the only one that signals may be set in
            for number in (signal.SIGINT, signal.SIGTERM):
                after.callback(signal.signal, number, signal.signal(number, ask))
        yield
        if stop.exists():
            raise KeyboardInterrupt
