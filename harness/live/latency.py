"""Latencies of a live session: quantiles to 0.01 ms, exact maxima; and settings of Python that keep pauses short."""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Ints

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


_BIN_S, _BINS = 1e-5, 200_000
"""Bins of 0.01 ms up to 2 s, so that memory does not grow with time."""
_HALF_BIN_S = 0.5 * _BIN_S


class DurationHistogram:
    """A histogram of durations, which gives their quantiles."""

    def __init__(self) -> None:
        self.count = 0
        self.longest_s = 0.0
        self._bins: Ints = np.zeros(_BINS + 1, dtype=np.int64)

    def add(self, duration_s: float) -> None:
        self.count += 1
        self.longest_s = max(self.longest_s, duration_s)
        self._bins[min(max(int(duration_s / _BIN_S), 0), _BINS)] += 1

    def quantile_s(self, share: float) -> float:
        """Quantile of the durations [s]; NaN without any, and the longest duration for quantiles beyond 2 s."""
        if self.count == 0:
            return float("nan")
        index = int(np.searchsorted(np.cumsum(self._bins), max(share * self.count, 1.0)))
        return self.longest_s if index >= _BINS else min(index * _BIN_S + _HALF_BIN_S, self.longest_s)

    def as_dict(self) -> dict[str, float | None]:
        """Median, 99th percentile and maximum [ms]; None without durations."""
        if self.count == 0:
            return {"p50_ms": None, "p99_ms": None, "max_ms": None}
        quantiles_s = (self.quantile_s(0.5), self.quantile_s(0.99), self.longest_s)
        return {name: 1e3 * s for name, s in zip(("p50_ms", "p99_ms", "max_ms"), quantiles_s, strict=True)}


@dataclass
class StageLatencies:
    """Durations of the stages of each frame: last byte received, taken from the queue, pose ready, outputs sent."""

    deadline_s: float
    """Longest allowed time from the last byte to the pose [s]."""
    missed: int = 0
    """Number of poses after their deadline."""
    waiting: DurationHistogram = field(default_factory=DurationHistogram)
    """From the last byte until the frame is taken from the queue."""
    solving: DurationHistogram = field(default_factory=DurationHistogram)
    """From taking the frame until the pose is ready."""
    sending: DurationHistogram = field(default_factory=DurationHistogram)
    """From the pose until all outputs have sent it."""
    to_pose: DurationHistogram = field(default_factory=DurationHistogram)
    """From the last byte until the pose is ready; the deadline applies to this."""

    def add(self, received_s: float, taken_s: float, ready_s: float, sent_s: float) -> None:
        """Add a frame by its times on one clock [s]."""
        self.waiting.add(taken_s - received_s)
        self.solving.add(ready_s - taken_s)
        self.sending.add(sent_s - ready_s)
        self.to_pose.add(ready_s - received_s)
        self.missed += ready_s - received_s > self.deadline_s

    def by_name(self) -> dict[str, DurationHistogram]:
        """The histograms by the name of the stage, in order of time."""
        return {
            "last byte to taken": self.waiting,
            "taken to pose": self.solving,
            "pose to outputs": self.sending,
            "last byte to pose": self.to_pose,
        }
