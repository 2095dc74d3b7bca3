"""What the tracker believes, before it is written to the wire: the truth, spoilt by one component after another."""

from collections.abc import Collection
from dataclasses import dataclass, field

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.seeds import generator
from harness.errors import UnknownName

GRAVITY_M_S2 = 9.81


@dataclass(eq=False)
class SimulatedReadings:
    """N samples of S stations in the tracker's frame; components change the arrays in place."""

    seed: int
    take: str
    """Name of the take: noise differs from one to the next."""
    stations: tuple[str, ...]
    time_s: Floats
    """(N, S) true time of each sample [s]."""
    rate_hz: float
    velocity_m_s: Floats
    """(N, S, 3) true velocity."""
    radius_m: Floats
    """(S,) from the axis of the bone to the station; the station's z points away from that axis, its x along it."""
    flesh_m: Floats
    """(S,) soft tissue between the bone and the skin that the station sits on."""
    force_m_s2: Floats
    """(N, S, 3) what a unit mass at the station bears beyond what it bears at rest in the rest pose: acceleration and
    the pull of the Earth, along the station's own axes."""
    position_m: Floats
    """(N, S, 3)"""
    turn: Floats
    """(N, S, 4) `tracker_from_station`."""
    quality: Floats
    """(N, S) 0 lost to 1 best."""
    device_s: Floats
    """(N, S) what the device's clock says [s]."""
    affected: dict[str, Bools] = field(default_factory=dict)
    """(N, S) readings that a component of this name was at work on, for the record."""
    session: str = ""
    """Name of the session, which may have more takes than this one: what lasts for a session is the same in all of
    them. Without one the take is its own session."""

    def take_rng(self, component: str, station: str) -> np.random.Generator:
        """The generator of one component at one station in one take, independent of all others."""
        return generator(self.seed, "noise", self.take, component, station)

    def session_rng(self, component: str, station: str) -> np.random.Generator:
        """The generator of what a component does to a station for a whole session."""
        return generator(self.seed, "noise", self.session or self.take, component, station)

    def during(self, stations: Collection[str], from_s: float, to_s: float) -> Bools:
        """(N, S) readings of these stations, () for all of them, within a stretch of time; UnknownName."""
        for station in stations:
            if station not in self.stations:
                raise UnknownName("station", station, self.stations)
        named = np.array([not stations or station in stations for station in self.stations])
        out: Bools = named & (self.time_s >= from_s) & (self.time_s < to_s)
        return out

    def move(self, offset_m: Floats) -> None:
        """Shift positions by (..., 3) in the tracker's axes."""
        self.position_m = self.position_m + offset_m

    def rotate(self, rotation_vector_rad: Floats) -> None:
        """Turn orientations by (..., 3) about the tracker's axes."""
        self.turn = rotations.multiply(rotations.exp(rotation_vector_rad), self.turn)

    def lose(self, lost: Bools) -> None:
        """Quality 0 for these readings (N, S); each repeats what its station said last."""
        self.quality[lost] = 0.0
        known = np.where(lost, 0, np.arange(len(lost))[:, None])
        last, row = np.maximum.accumulate(known, axis=0), np.arange(len(self.stations))
        self.position_m, self.turn = self.position_m[last, row], self.turn[last, row]
        self.affected["lost"] = self.affected.get("lost", np.zeros_like(lost)) | lost
