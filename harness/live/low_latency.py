"""Settings of Python that keep its own pauses short: garbage collection and switching of threads."""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_SWITCH_INTERVAL_S = 2e-4
"""Longest time that a ready thread waits for a computing one [s]; Python's default is 5 ms."""


@contextmanager
def low_latency_mode() -> Iterator[None]:
    """Context in which only `collect_garbage` collects garbage, and threads switch quickly. Restores both settings."""
    switch_interval_s, gc_enabled = sys.getswitchinterval(), gc.isenabled()
    gc.collect()
    gc.freeze()  # objects of the trained method are permanent and need no further collection
    gc.disable()
    sys.setswitchinterval(_SWITCH_INTERVAL_S)
    try:
        yield
    finally:
        sys.setswitchinterval(switch_interval_s)
        if gc_enabled:
            gc.enable()
        gc.unfreeze()


def collect_garbage() -> None:
    """Collect the garbage of the session; called when no frame is waiting."""
    gc.collect(1)
