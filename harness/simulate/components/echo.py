"""Outliers from ultrasound reflections."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.ranges import Range, check_fields
from harness.simulate.components.excursion import direction
from harness.simulate.readings import SimulatedReadings

_WARM_UP = 64
"""Readings simulated before the take, so that it may begin inside a burst."""


@dataclass(frozen=True)
class Echo:
    """Bursts of readings that are displaced in one direction, each burst by its own distance.

    A reflection lengthens a range and never shortens it (National Academy Press; rate and size are inferred,
    docs/is900.md 13.3 and 13.5). `share` is the "outlier rate" of the studies.
    """

    share: Annotated[float, Range(0.0, 0.99)] = 0.03
    """Share of station readings that are outliers, 0 to below 1."""
    burst_records: Annotated[tuple[int, int], Range(1, 100_000, ascending=True)] = (1, 8)
    """Fewest and most readings in a burst; uniform."""
    size_m: Annotated[tuple[float, float], Range(0.0, 10.0, ascending=True)] = (0.05, 0.30)
    """Smallest and largest displacement [m]; uniform."""

    def __post_init__(self) -> None:
        check_fields(self)

    def apply(self, readings: SimulatedReadings) -> None:
        hit = np.zeros(readings.time_s.shape, bool)
        if self.share > 0.0:
            for row, station in enumerate(readings.stations):
                self._add_bursts(readings, hit, row, readings.take_rng("echo", station))
        readings.affected["echo"] = hit

    def _add_bursts(self, readings: SimulatedReadings, hit: np.ndarray, row: int, rng: np.random.Generator) -> None:
        fewest, most = self.burst_records
        clean = 0.5 * (fewest + most) * (1.0 - self.share) / self.share
        at = -_WARM_UP
        while at < len(hit):
            at += int(rng.geometric(1.0 / (1.0 + clean))) - 1
            burst = slice(max(at, 0), max(at := at + int(rng.integers(fewest, most + 1)), 0))
            readings.position_m[burst, row] += rng.uniform(*self.size_m) * direction(rng)
            hit[burst, row] = True
