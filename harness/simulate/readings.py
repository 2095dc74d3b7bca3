"""What S trackers would report at E instants, on its way from the truth to the wire."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Bools, Floats

Draw = Callable[[str], np.random.Generator]
"""The generator of one station for one component: adding either leaves every other draw as it was."""


@dataclass(frozen=True, eq=False)
class Readings:
    """Rows are instants, columns stations."""

    stations: tuple[str, ...]
    rate_hz: float
    time_s: Floats
    """(E, S) true time of each measurement [s]; stations are read one after another."""
    position_m: Floats
    """(E, S, 3) in the tracker frame."""
    tracker_from_station: Floats
    """(E, S, 4)"""
    velocity_m_s: Floats
    """(E, S, 3) true, in the tracker frame."""
    quality: Floats
    """(E, S) 0 lost to 1 best."""
    marks: Mapping[str, Bools] = field(default_factory=dict)
    """Component -> (E, S) which readings it hit; for tests and for the stream's health, never for a method."""

    def marked(self, component: str, hit: Bools) -> dict[str, Bools]:
        """The marks with this component's added."""
        return {**self.marks, component: hit}


def per_station(readings: Readings, draw: Draw, values: Callable[[np.random.Generator], Floats]) -> Floats:
    """(E, S, ...) of one draw for each station, from its own generator."""
    return np.stack([values(draw(station)) for station in readings.stations], axis=1)
