"""What the page of the tracker's physics shows: error statistics of several models, and the rows of the truth table."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats, freeze
from harness.results.findings import BenchmarkStatement

ERROR_QUANTILES = (0.5, 0.95, 0.99)
"""Quantiles of the position error that `TrackerErrorStatistics` holds."""


@dataclass(frozen=True, eq=False)
class TrackerErrorStatistics:
    """Statistics of a tracker's position errors under one error model, pooled over recordings and stations.

    Errors are distances from the true position of the tracker. Readings of quality 0 are lost and have no error.
    """

    label: str
    """Name of the model, such as "physics" or "noise = default"."""
    source: str
    """Where the errors come from, and of which motion, in one sentence."""
    recordings: int
    """Number of recordings."""
    station_s: float
    """Sum of the recordings' durations over all stations [s]."""
    readings: int
    """Number of readings, lost ones included."""
    frequency_hz: Floats
    """(F,) frequencies of the spectrum [Hz]."""
    density_m2_hz: Floats
    """(F,) one-sided power spectral density of the error, summed over the axes [m^2/Hz]; NaN: not measured."""
    segments: int
    """Number of segments behind the spectrum."""
    excursion_s: Floats
    """(N,) durations of the excursions [s]."""
    excursion_peak_m: Floats
    """(N,) largest error of each excursion [m]."""
    gap_s: Floats
    """(G,) durations of the gaps with quality 0 [s]."""
    truncated: int
    """Number of excursions and gaps that a recording begins or ends within."""
    quality_share: Floats
    """(B + 1,) shares of the readings: those of quality 0, then those of B classes of equal width from 0 to 1.

    A class includes its upper end, and quality 0 is in none of them.
    """
    class_error_m: Floats
    """(B, 3) `ERROR_QUANTILES` of the error in each class of quality [m]; NaN without any reading."""
    error_m: Floats
    """(3,) `ERROR_QUANTILES` of the error of all readings that are not lost [m]; NaN without any."""

    def __post_init__(self) -> None:
        freeze(self, frequency_hz=("F",), density_m2_hz=("F",))
        freeze(self, excursion_s=("N",), excursion_peak_m=("N",))
        quantiles = len(ERROR_QUANTILES)
        freeze(self, gap_s=("G",), class_error_m=("B", quantiles), error_m=(quantiles,))
        freeze(self, quality_share=(len(self.class_error_m) + 1,))

    @property
    def lost_share(self) -> float:
        """Share of the readings with quality 0."""
        return float(self.quality_share[0])

    @property
    def quality_edges(self) -> Floats:
        """(B + 1,) ends of the classes of quality, from 0 to 1."""
        return np.linspace(0.0, 1.0, len(self.class_error_m) + 1)

    def per_minute(self, episodes: int | Floats) -> Floats:
        """A number of episodes for each minute and station; NaN without any recording."""
        return np.asarray(episodes) * (60.0 / self.station_s if self.station_s else np.nan)


@dataclass(frozen=True, eq=False)
class ErrorModelComparison:
    """Error models side by side, and the truth table of the first one."""

    models: tuple[TrackerErrorStatistics, ...]
    """The statistics of each model; the first one is the model that the rows are about."""
    rows: tuple[BenchmarkStatement, ...]
    """The rows of the truth table, in their order."""
    command: str
    """The command that makes the page."""
    limit_m: float
    """Errors beyond this are excursions [m]."""
    merge_s: float
    """Excursions closer to each other than this are one [s]."""
    segment_s: float
    """Length of a segment of the spectrum [s]."""
