"""Short losses: the line of sight is blocked, the station coasts on its inertial sensors, then it is lost."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from harness.core.arrays import Floats
from harness.core.ranges import Range, check_fields
from harness.simulate.readings import GRAVITY_M_S2, SimulatedReadings

MOST_PER_S = 100.0
"""Most gaps of one station in a second, on average [choice]; each is drawn."""


@dataclass(frozen=True)
class Dropout:
    """Gaps of quality 0, each after a period of falling quality and growing error.

    While the station coasts, a tilt error leaks gravity into the horizontal: 0.5 g sin(tilt) t^2 (docs/is900.md 13.4).
    During the gap, records repeat the filter's last state (section 7). Share and lengths are inferred (13.5).
    """

    share: Annotated[float, Range(0.0, 0.99)] = 0.01
    """Share of station readings with quality 0, 0 to below 1."""
    gap_s: Annotated[tuple[float, float], Range(1e-3, 1e6, ascending=True)] = (0.1, 0.5)
    """Shortest and longest gap [s]."""
    coast_s: Annotated[float, Range(1e-3, 60.0)] = 0.5
    """Time without ranges before each gap, at most since the previous gap [s]."""
    tilt_rad: Annotated[float, Range(0.0, 1.0)] = float(np.deg2rad(0.25))
    """Tilt error while coasting [rad]: the RMS of pitch and roll."""

    def __post_init__(self) -> None:
        check_fields(self)
        check_fields(self, share=Range(0.0, MOST_PER_S * 0.5 * sum(self.gap_s)))

    def apply(self, readings: SimulatedReadings) -> None:
        lost = np.zeros(readings.time_s.shape, bool)
        coasting = np.zeros(readings.time_s.shape, bool)
        leak_m_s2 = GRAVITY_M_S2 * float(np.sin(self.tilt_rad))
        for row, station in enumerate(readings.stations):
            time_s, sighted_s = readings.time_s[:, row], -np.inf
            for begin_s, end_s, sideways in self.gaps(readings.take_rng("dropout", station), float(time_s.max())):
                blocked_s = max(begin_s - self.coast_s, sighted_s)
                coast = (time_s >= blocked_s) & (time_s < begin_s)
                coasted_s = time_s[coast] - blocked_s
                readings.position_m[coast, row] += leak_m_s2 * 0.5 * coasted_s[:, None] ** 2 * sideways
                left = 1.0 - coasted_s / self.coast_s
                readings.quality[coast, row] = np.minimum(readings.quality[coast, row], np.maximum(left, 1.0 / 255.0))
                coasting[:, row] |= coast
                lost[:, row] |= (time_s >= begin_s) & (time_s < end_s)
                sighted_s = end_s
        readings.lose(lost)
        readings.affected["coast"] = coasting & ~lost

    def gaps(self, rng: np.random.Generator, until_s: float) -> list[tuple[float, float, Floats]]:
        """Begin and end [s] of each gap up to `until_s`, and the horizontal unit vector (3,) of the error before it."""
        gaps: list[tuple[float, float, Floats]] = []
        if self.share <= 0.0:
            return gaps
        between_s = 0.5 * sum(self.gap_s) * (1.0 - self.share) / self.share
        end_s = -5.0 * between_s
        while (begin_s := end_s + rng.exponential(between_s)) < until_s + self.coast_s:
            end_s, angle = begin_s + rng.uniform(*self.gap_s), rng.uniform(0.0, 2.0 * np.pi)
            gaps.append((begin_s, end_s, np.array([np.cos(angle), np.sin(angle), 0.0])))
        return [gap for gap in gaps if gap[1] > 0.0]
