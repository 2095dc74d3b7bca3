"""The finished cells of a sweep in columns, so that statistics of 100,000 of them take a moment."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.compare.paired_statistics import MIN_CLIPS, bootstrap_interval
from harness.core.arrays import Bools, Floats, Ints
from harness.score.metrics import DEFINITIONS

PRIMARY_METRIC, SECONDARY_METRIC = "joint_angle_mean_deg", "mpjpe_mm"
METRICS = (PRIMARY_METRIC, SECONDARY_METRIC, "mpjre_deg", "mpjpe_root_mm", "jitter_m_s3", "step_p50_ms", "coverage")
"""What the page has of each cell; the table has the rest."""


@dataclass(frozen=True)
class Statistic:
    """A mean over clips; each clip is first averaged over whatever else was varied."""

    mean: float | None
    clips: int
    sd: float | None = None
    low: float | None = None
    """End of the 95 % interval; None with fewer than `MIN_CLIPS`, or where it was not asked for."""
    high: float | None = None


@dataclass(frozen=True)
class VariedKey:
    """What was varied: its values in rising order if they are numbers, else as they came."""

    name: str
    labels: tuple[str, ...]
    numbers: tuple[float, ...] = ()
    """The same as numbers; () where any is none."""


@dataclass(frozen=True, eq=False)
class SweepData:
    """N finished cells."""

    name: str
    planned: int
    failures: Mapping[str, str]
    """Cell -> refusal or traceback."""
    command: str
    scenarios: tuple[str, ...]
    series: tuple[str, ...]
    performers: tuple[str, ...]
    """"known", "new" or "" of each series: these have other clips."""
    clips: tuple[str, ...]
    """As "scenario: clip", for equal names may be other motion."""
    keys: tuple[VariedKey, ...]
    scenario_of: Ints
    """(N,) index into `scenarios`."""
    series_of: Ints
    clip_of: Ints
    value_of: Mapping[str, Ints]
    """Name of the key -> (N,) which of its values; -1 where the cell's scenario does not vary it."""
    metrics: Mapping[str, Floats]
    """(N,) each; NaN is "not measured"."""

    def __len__(self) -> int:
        return len(self.scenario_of)

    def select(self, scenario: int | None = None, series: int | None = None, **values: int) -> Bools:
        """(N,) the cells of a scenario, a series and of values of keys."""
        chosen: Bools = np.ones(len(self), dtype=bool)
        if scenario is not None:
            chosen &= self.scenario_of == scenario
        if series is not None:
            chosen &= self.series_of == series
        for key, value in values.items():
            chosen &= self.value_of[key] == value
        return chosen

    def by_clip(self, metric: str, chosen: Bools) -> Floats:
        """(C,) the mean of each clip; NaN for one of which nothing was chosen or measured."""
        values = self.metrics[metric]
        chosen = chosen & np.isfinite(values)
        sums = np.bincount(self.clip_of[chosen], values[chosen], minlength=len(self.clips))
        counts = np.bincount(self.clip_of[chosen], minlength=len(self.clips))
        with np.errstate(invalid="ignore"):
            means: Floats = sums / counts
        return means

    def statistic(self, metric: str, chosen: Bools, *, ends: bool = False) -> Statistic:
        """Over clips; with its interval where there are clips enough and `ends` asks for it."""
        means = self.by_clip(metric, chosen)
        means = means[np.isfinite(means)]
        if not len(means):
            return Statistic(None, 0)
        sd = float(means.std(ddof=1)) if len(means) > 1 else None
        low, high = bootstrap_interval(means) if ends and len(means) >= MIN_CLIPS else (None, None)
        return Statistic(float(means.mean()), len(means), sd, low, high)


def unit_of(metric: str) -> str:
    return DEFINITIONS[metric].unit
