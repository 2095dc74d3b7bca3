"""Episodes of a signal: excursions of an error beyond a limit, and gaps during which a station is lost."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, find_runs, freeze
from harness.errors import BadInput

_SLACK_S = 1e-9
"""Rounding error of times that are compared [s]."""


@dataclass(frozen=True, eq=False)
class Episodes:
    """N stretches of time in which a condition holds, in their order."""

    begin_s: Floats
    """(N,) time of the first sample of each episode [s]."""
    end_s: Floats
    """(N,) time of the first sample after each episode [s]; an episode of one sample lasts one period."""
    peak: Floats
    """(N,) largest value of the signal in each episode, in its unit."""
    truncated: Bools
    """(N,) whether an episode has the first or the last sample of the recording; its true duration may be longer."""

    def __post_init__(self) -> None:
        freeze(self, begin_s=("N",), end_s=("N",), peak=("N",))
        freeze(self, np.bool_, truncated=(len(self.begin_s),))

    @property
    def duration_s(self) -> Floats:
        """(N,) duration of each episode [s]."""
        out: Floats = self.end_s - self.begin_s
        return out


def find_episodes(time_s: Floats, signal: Floats, condition: Bools, *, merge_s: float = 0.0) -> Episodes:
    """Find the runs of samples (T,) at which `condition` holds; runs less than `merge_s` apart are one episode.

    `time_s` are the sampling times, which must rise [s]. NaN in `signal` counts for no peak. BadInput if the arrays
    differ in length, times do not rise or `merge_s` is negative.
    """
    if not (time_s.shape == signal.shape == condition.shape == (len(time_s),)):
        raise BadInput("Times, signal and condition differ in length.", "Give one value of each for every sample.")
    if not np.all(np.diff(time_s) > 0.0) or not np.isfinite(time_s).all() or not merge_s >= 0.0:
        raise BadInput("Sampling times do not rise, or merge_s is negative.", "Sort the samples by time.")
    period_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    edges_s = np.append(time_s, time_s[-1:] + period_s)
    runs = _merge(find_runs(condition), edges_s, merge_s)
    starts, ends = runs[:, 0], runs[:, 1]
    peaks = [np.fmax.reduce(signal[start:end]) for start, end in runs]
    return Episodes(edges_s[starts], edges_s[ends], np.array(peaks), (starts == 0) | (ends == len(time_s)))


def find_excursions(time_s: Floats, error_m: Floats, limit_m: float, *, merge_s: float = 0.5) -> Episodes:
    """Find the episodes in which the size (T,) of an error exceeds `limit_m` [m].

    Excursions less than `merge_s` apart are one [s], so that noise at the limit does not split them. NaN, where the
    error is not known, exceeds no limit. BadInput as for `find_episodes`.
    """
    return find_episodes(time_s, error_m, error_m > limit_m, merge_s=merge_s)


def find_gaps(time_s: Floats, quality: Floats) -> Episodes:
    """Find the episodes in which a station is lost: its quality (T,) is 0. BadInput as for `find_episodes`."""
    return find_episodes(time_s, quality, quality == 0.0)


def _merge(runs: Ints, edges_s: Floats, merge_s: float) -> Ints:
    """The runs (N, 2), those less than `merge_s` apart joined."""
    if len(runs) == 0:
        return runs
    apart = edges_s[runs[1:, 0]] - edges_s[runs[:-1, 1]] > merge_s - _SLACK_S
    starts = np.concatenate([[True], apart])
    ends = np.concatenate([apart, [True]])
    return np.stack([runs[starts, 0], runs[ends, 1]], axis=1)
