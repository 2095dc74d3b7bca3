"""How long frames take from the line to the pose: exact in the extremes, to a hundredth of a millisecond else."""

from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Ints

_BIN_S, _BINS = 1e-5, 200_000
"""Hundredths of a millisecond up to two seconds: as much memory for a day as for a minute."""
_HALF_BIN_S = 0.5 * _BIN_S


class DurationHistogram:
    """Many times, of which quantiles are asked."""

    def __init__(self) -> None:
        self.count = 0
        self.longest_s = 0.0
        self._bins: Ints = np.zeros(_BINS + 1, dtype=np.int64)

    def add(self, duration_s: float) -> None:
        self.count += 1
        self.longest_s = max(self.longest_s, duration_s)
        self._bins[min(max(int(duration_s / _BIN_S), 0), _BINS)] += 1

    def quantile_s(self, share: float) -> float:
        """The time that this share of all is not longer than [s]; NaN of none, the longest beyond two seconds."""
        if self.count == 0:
            return float("nan")
        place = int(np.searchsorted(np.cumsum(self._bins), max(share * self.count, 1.0)))
        return self.longest_s if place >= _BINS else min(place * _BIN_S + _HALF_BIN_S, self.longest_s)

    def as_dict(self) -> dict[str, float | None]:
        """Milliseconds; None where there is nothing to tell."""
        if self.count == 0:
            return {"p50_ms": None, "p99_ms": None, "max_ms": None}
        quantiles_s = (self.quantile_s(0.5), self.quantile_s(0.99), self.longest_s)
        return {name: 1e3 * s for name, s in zip(("p50_ms", "p99_ms", "max_ms"), quantiles_s, strict=True)}


@dataclass
class StageLatencies:
    """Of every frame: when its last byte was there, it was taken up, its pose was ready, the outputs had it."""

    deadline_s: float
    """From the last byte to the pose."""
    missed: int = 0
    """Poses that were ready after it."""
    waiting: DurationHistogram = field(default_factory=DurationHistogram)
    """Last byte to taken from the queue."""
    solving: DurationHistogram = field(default_factory=DurationHistogram)
    """Taken to pose ready."""
    sending: DurationHistogram = field(default_factory=DurationHistogram)
    """Pose ready to outputs sent."""
    to_pose: DurationHistogram = field(default_factory=DurationHistogram)
    """Last byte to pose ready: what the deadline is for."""

    def add(self, received_s: float, taken_s: float, ready_s: float, sent_s: float) -> None:
        """One frame, by one clock [s]."""
        self.waiting.add(taken_s - received_s)
        self.solving.add(ready_s - taken_s)
        self.sending.add(sent_s - ready_s)
        self.to_pose.add(ready_s - received_s)
        self.missed += ready_s - received_s > self.deadline_s

    def by_name(self) -> dict[str, DurationHistogram]:
        """In the order of the way."""
        return {
            "last byte to taken": self.waiting,
            "taken to pose": self.solving,
            "pose to outputs": self.sending,
            "last byte to pose": self.to_pose,
        }
