"""Reference workload: a fixed computation that the speed of methods is measured against.

A step takes longer on a slower or busier computer. So does this workload, which is timed between the steps of the same
cell; the ratio of the two is a method's cost. Half of it is a dense solve (the normal equations of 72 residuals and
54 unknowns), half is the overhead of small-array calls. It must not change: results in units of another reference are
not comparable. A change raises the version of the metric `step_relative`.
"""

import time

import numpy as np

from harness.core.arrays import Floats
from harness.core.seeds import generator

FRAMES_PER_TIMING = 8
"""Number of frames from one timing to the next. A cell of 8 s at 40 Hz has 40 timings, which take 3 % of the time of a
cell of the fastest method."""


class ReferenceWorkload:
    """Work of 0.15 ms in numpy on one core of a shared 2-core x86 machine."""

    def __init__(self) -> None:
        rng = generator(0, "reference")
        self._slope, self._off = rng.normal(size=(72, 54)), rng.normal(size=72)
        self._damping = 0.1 * np.eye(54)
        self._turns, self._points = rng.normal(size=(24, 4)), rng.normal(size=(24, 3))
        self.work()  # excludes one-time initialisation from the timings

    def work(self) -> Floats:
        """Do the work; its result (54,) is always the same."""
        turns = self._turns / np.sqrt(np.sum(self._turns**2, axis=1, keepdims=True))
        apart = np.sqrt(np.sum((self._points[:, None] - self._points) ** 2, axis=2))
        weights = np.where(apart.mean(axis=1) > 2.0, 0.5, 1.0) * np.abs(turns[:, 0])
        weighed = self._slope * np.repeat(weights, 3)[:, None]
        step: Floats = np.linalg.solve(weighed.T @ self._slope + self._damping, weighed.T @ self._off)
        return step

    def cpu_ms(self) -> float:
        """CPU time of doing the work once [ms]."""
        start = time.process_time()
        self.work()
        return 1e3 * (time.process_time() - start)
