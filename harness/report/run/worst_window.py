"""The two seconds of a cell with the largest mean of a metric."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.number_format import format_number
from harness.report.run.data import WORST_METRICS, RunData
from harness.score import DEFINITIONS

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

    @property
    def span(self) -> str:
        """Begin and end, "1.2–3.2 s"."""
        return f"{self.start_s:.1f}–{self.end_s:.1f} s"

    @property
    def mean_text(self) -> str:
        """The mean with its unit."""
        unit = DEFINITIONS[self.metric].unit
        return f"{format_number(self.mean, unit)} {unit}"

    def scored_rows(self, run: RunData) -> Ints:
        """Rows of the scored frames of the window."""
        out: Ints = self.first + np.flatnonzero(run.trace(self.key).scored[self.first : self.stop])
        return out


def worst_windows(run: RunData) -> dict[tuple[str, str], WorstWindow]:
    """(series, metric) -> the worst two seconds over all clips."""
    windows = {}
    for series in run.series:
        traces = [trace for trace in run.traces if trace.series == series]
        for metric in WORST_METRICS:
            by_trace = [find_worst_window(t.key, metric, t.time_s, t.errors[metric], t.scored) for t in traces]
            if measured := [window for window in by_trace if window is not None]:
                windows[series, metric] = max(measured, key=lambda window: window.mean)
    return windows


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
