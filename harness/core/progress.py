"""Progress of long work on a terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

ProgressCallback = Callable[[str, int, int], None]
"""Called with the name of the last step, or of the present one, the number of finished steps and of planned ones."""

_observer: ContextVar[Callable[[str], None]] = ContextVar("observer", default=lambda step: None)


def report_step(step: str) -> None:
    """Tell the bar of `show_steps`, if there is one, what is done next."""
    _observer.get()(step)


@contextmanager
def show_steps(unit: str) -> Iterator[None]:
    """Show a bar that counts the steps which code in the block reports, however deep it is called."""
    with ProgressBar(unit) as bar:
        token = _observer.set(bar.count)
        try:
            yield
        finally:
            _observer.reset(token)


class ProgressBar:
    """A progress bar on stderr if stderr is a terminal, else nothing; a context manager.

    A call with the name of the last step, the number of finished steps and the number of planned ones updates it. It
    shows the time that is left at the pace so far.
    """

    def __init__(self, unit: str) -> None:
        self.unit = unit
        self.bar: Any = None

    def __enter__(self) -> "ProgressBar":
        return self

    def __call__(self, last: str, done: int, planned: int) -> None:
        if self.bar is None:
            from tqdm import tqdm

            self.bar = tqdm(total=planned or None, unit=f" {self.unit}", disable=None, leave=False, file=sys.stderr)
        self.bar.set_postfix_str(last, refresh=False)
        self.bar.update(done - self.bar.n)

    def count(self, last: str) -> None:
        """Count one more step of a number that is not known."""
        self(last, 1 + (self.bar.n if self.bar is not None else 0), 0)

    def __exit__(self, *_: object) -> None:
        if self.bar is not None:
            self.bar.close()
