"""Runs: stretches of consecutive samples for which a condition holds."""

import numpy as np

from harness.core.arrays import Bools, Ints


def find_runs(condition: Bools) -> Ints:
    """(N, 2) index of the first sample of each run of True in an array (T,), and of the first sample after it."""
    edges = np.diff(np.concatenate([[False], condition, [False]]).astype(np.int8))
    return np.stack([np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)], axis=1).astype(np.int64)
