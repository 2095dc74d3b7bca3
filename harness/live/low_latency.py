"""Python kept from getting in the way of a session: no pauses for garbage, no thread that keeps others waiting."""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_SWITCH_INTERVAL_S = 2e-4
"""A thread that has something to do waits no longer than this for one that computes; Python's own is 5 ms [s]."""


@contextmanager
def low_latency_mode() -> Iterator[None]:
    """Garbage is collected by `collect_garbage` alone, and threads take turns quickly; afterwards all is as before."""
    switch_s, collecting = sys.getswitchinterval(), gc.isenabled()
    gc.collect()
    gc.freeze()  # what was learnt stays: no collection need look at it again
    gc.disable()
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    try:
        yield
    finally:
        sys.setswitchinterval(switch_s)
        if collecting:
            gc.enable()
        gc.unfreeze()


def collect_garbage() -> None:
    """Collect what was left since the session began, at a moment when nothing waits."""
    gc.collect(1)
