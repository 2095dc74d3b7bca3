"""Where a method was worst: the two seconds with the largest mean of a metric."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints

WINDOW_S = 2.0


@dataclass(frozen=True)
class WorstWindow:
    """Some two seconds of one cell, the whole of a shorter one."""

    key: str
    """Of the cell."""
    metric: str
    first: int
    stop: int
    """Rows of the cell's frames: first, first + 1, ... stop - 1."""
    start_s: float
    end_s: float
    mean: float
    """Of the metric over the window's scored frames, in its unit."""


def find_worst_window(key: str, metric: str, time_s: Floats, values: Floats, scored: Bools) -> WorstWindow | None:
    """The worst of all windows that begin at a scored frame, or None if the metric has no value in any of them.

    A window holds the frames within 2 s of its first one; `time_s` (F,) rises. It counts only if at least half as
    many of its frames have a value as in the fullest window: one bad frame beside a gap is no bad two seconds.
    """
    known = scored & np.isfinite(values)
    if not known.any():
        return None
    period_s = float(np.min(np.diff(time_s), initial=np.inf))
    whole = scored & (time_s + WINDOW_S <= time_s[-1] + 1.5 * period_s)
    begins = whole if whole.any() else np.arange(len(scored)) == np.argmax(scored)
    stop = np.searchsorted(time_s, time_s + WINDOW_S - 0.5 * period_s)
    count = _window_sums(known.astype(float), stop)
    total = _window_sums(np.where(known, values, 0.0), stop)
    begins = begins & (count > 0.0) & (count >= 0.5 * np.max(count[begins]))
    if not begins.any():
        return None
    mean = np.where(begins, total / np.maximum(count, 1.0), -np.inf)
    first = int(np.argmax(mean))
    last = int(stop[first])
    return WorstWindow(key, metric, first, last, float(time_s[first]), float(time_s[last - 1]), float(mean[first]))


def select_worst(windows: Iterable[WorstWindow]) -> WorstWindow | None:
    """The one with the largest mean; the first of equals."""
    return max(windows, key=lambda window: window.mean, default=None)


def group_overlapping(windows: Iterable[WorstWindow]) -> list[tuple[WorstWindow, ...]]:
    """Windows of one cell that overlap by more than half, so that the same moment is shown once; the first leads."""
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
    """Sums (F,) from each frame to the end of its window."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    out: Floats = sums[stop] - sums[: len(values)]
    return out
