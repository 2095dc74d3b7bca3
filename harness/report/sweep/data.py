"""The finished cells of a sweep as columns, so that statistics of 100,000 cells are fast."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from harness.compare.margins import GATED_METRICS
from harness.compare.paired_statistics import MIN_UNITS, mean_interval
from harness.compare.ranking import ClipValues
from harness.compare.units import Sampling, average_units
from harness.core.arrays import Bools, Floats, Ints
from harness.results.reported_metrics import PRIMARY_METRIC, SECONDARY_METRIC
from harness.score.metrics import DEFINITIONS

METRICS = (PRIMARY_METRIC, SECONDARY_METRIC, "mpjre_deg", "mpjpe_root_mm", "jitter_m_s3", "step_p50_ms", "coverage")
"""Metrics that the page shows; summary.csv has all metrics."""
READ_METRICS = tuple(dict.fromkeys((*METRICS, *GATED_METRICS)))
"""Metrics that are read of each cell."""


@dataclass(frozen=True)
class Statistic:
    """Mean over clips, or over units where it has an interval; a clip is first averaged over other varied values."""

    mean: float | None
    clips: int
    sd: float | None = None
    low: float | None = None
    """Lower end of the 95 % interval; None with fewer than `MIN_UNITS` units, or if it was not requested."""
    high: float | None = None
    """Upper end of the 95 % interval."""
    units: int = 0
    """Number of units that the mean and its interval are over; 0 without an interval."""


@dataclass(frozen=True)
class VariedKey:
    """A varied key; its values rise if they are numbers, else they have the order of the plan."""

    name: str
    labels: tuple[str, ...]
    numbers: tuple[float, ...] = ()
    """The values as numbers; () if any value is not a number."""


@dataclass(frozen=True, eq=False)
class SweepData:
    """N finished cells of a sweep."""

    name: str
    planned: int
    failures: Mapping[str, str]
    """Cell -> message of its refusal, or traceback."""
    command: str
    scenarios: tuple[str, ...]
    series: tuple[str, ...]
    performers: tuple[str, ...]
    """"known", "new" or "" for each series; known and new performers have different clips."""
    lags: tuple[int, ...]
    """Lag of the method of each series [frames]; methods with different lags are never ranked together."""
    clips: tuple[str, ...]
    """Names as "scenario: clip", because clips of the same name may differ between scenarios."""
    sampling: Sampling
    """What is a unit of statistics."""
    keys: tuple[VariedKey, ...]
    scenario_of: Ints
    """(N,) index into `scenarios`."""
    series_of: Ints
    """(N,) index into `series`."""
    clip_of: Ints
    """(N,) index into `clips`."""
    value_of: Mapping[str, Ints]
    """Name of a key -> (N,) index of its value; -1 where the cell's scenario does not vary the key."""
    metrics: Mapping[str, Floats]
    """Metric -> (N,) values; NaN means not measured."""

    def __len__(self) -> int:
        return len(self.scenario_of)

    def select(self, scenario: int | None = None, series: int | None = None, **values: int) -> Bools:
        """(N,) mask of the cells of a scenario, of a series and of values of keys."""
        selected: Bools = np.ones(len(self), dtype=bool)
        if scenario is not None:
            selected &= self.scenario_of == scenario
        if series is not None:
            selected &= self.series_of == series
        for key, value in values.items():
            selected &= self.value_of[key] == value
        return selected

    def by_clip(self, metric: str, selected: Bools) -> Floats:
        """(C,) mean of each clip over the selected cells; NaN for a clip without a measured value."""
        values = self.metrics[metric]
        selected = selected & np.isfinite(values)
        sums = np.bincount(self.clip_of[selected], values[selected], minlength=len(self.clips))
        counts = np.bincount(self.clip_of[selected], minlength=len(self.clips))
        with np.errstate(invalid="ignore"):
            means: Floats = sums / counts
        return means

    def clip_values(self, selected: Bools, metrics: Iterable[str]) -> ClipValues:
        """Metric -> clip -> mean over the selected cells."""
        means = {name: self.by_clip(name, selected) for name in metrics}
        return {
            name: {self.clips[n]: float(values[n]) for n in np.flatnonzero(np.isfinite(values))}
            for name, values in means.items()
        }

    def statistic(self, metric: str, selected: Bools, *, with_interval: bool = False) -> Statistic:
        """Statistic over clips; `with_interval` takes units and their interval, if there are `MIN_UNITS` or more."""
        means = self.by_clip(metric, selected)
        means = means[np.isfinite(means)]
        if not len(means):
            return Statistic(None, 0)
        sd = float(means.std(ddof=1)) if len(means) > 1 else None
        mean, low, high, units = float(means.mean()), None, None, 0
        if with_interval:
            by_unit = average_units(self.clip_values(selected, (metric,))[metric], self.sampling)
            if len(by_unit) >= MIN_UNITS:
                of_units = np.array(list(by_unit.values()))
                mean, (low, high), units = float(of_units.mean()), mean_interval(of_units), len(of_units)
        return Statistic(mean, len(means), sd, low, high, units)


def unit_of(metric: str) -> str:
    """Unit of a metric."""
    return DEFINITIONS[metric].unit
