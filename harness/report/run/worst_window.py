"""The two seconds of a cell with the largest mean of a metric."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints

WINDOW_S = 2.0


@dataclass(frozen=True)
class WorstWindow:
    """A window of two seconds in one cell, or all of a shorter cell."""

    key: str
    """Key of the cell."""
    metric: str
    first: int
    stop: int
    """Rows of the cell's frames: first, first + 1, ... stop - 1."""
    start_s: float
    end_s: float
    mean: float
    """Mean of the metric over the window's scored frames, in the metric's unit."""


def find_worst_window(key: str, metric: str, time_s: Floats, values: Floats, scored: Bools) -> WorstWindow | None:
    """The worst of all windows that begin at a scored frame, or None if the metric has no value in any of them.

    A window holds the frames within 2 s of its first one; `time_s` (F,) rises. Windows with less than half as many
    values as the fullest one are left out, so that a single bad frame next to a gap does not count as two bad seconds.
    """
    valid = scored & np.isfinite(values)
    if not valid.any():
        return None
    period_s = float(np.min(np.diff(time_s), initial=np.inf))
    complete = scored & (time_s + WINDOW_S <= time_s[-1] + 1.5 * period_s)
    begins = complete if complete.any() else np.arange(len(scored)) == np.argmax(scored)
    stop = np.searchsorted(time_s, time_s + WINDOW_S - 0.5 * period_s)
    count = _window_sums(valid.astype(float), stop)
    total = _window_sums(np.where(valid, values, 0.0), stop)
    begins = begins & (count > 0.0) & (count >= 0.5 * np.max(count[begins]))
    if not begins.any():
        return None
    mean = np.where(begins, total / np.maximum(count, 1.0), -np.inf)
    first = int(np.argmax(mean))
    last = int(stop[first])
    return WorstWindow(key, metric, first, last, float(time_s[first]), float(time_s[last - 1]), float(mean[first]))


def select_worst(windows: Iterable[WorstWindow]) -> WorstWindow | None:
    """The window with the largest mean; the first of equal ones."""
    return max(windows, key=lambda window: window.mean, default=None)


def group_overlapping(windows: Iterable[WorstWindow]) -> list[tuple[WorstWindow, ...]]:
    """Groups of windows of one cell that overlap the group's first window by more than half."""
    groups: list[list[WorstWindow]] = []
    for window in windows:
        for group in groups:
            lead = group[0]
            shared_s = min(lead.end_s, window.end_s) - max(lead.start_s, window.start_s)
            if lead.key == window.key and shared_s > 0.5 * WINDOW_S:
                group.append(window)
                break
        else:
            groups.append([window])
    return [tuple(group) for group in groups]


def _window_sums(values: Floats, stop: Ints) -> Floats:
    """(F,) sums from each frame to the end of its window."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    out: Floats = sums[stop] - sums[: len(values)]
    return out
