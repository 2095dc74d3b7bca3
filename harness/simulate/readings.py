"""Simulated readings before they are encoded: true station poses to which error components are applied."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.seeds import generator
from harness.errors import UnknownName
from harness.stream.polhemus.codec import Emitter

GRAVITY_M_S2 = 9.81


class FilterReadings(NamedTuple):
    """What the device's filters report of S stations at E times, before clock and line, in the tracker's frame."""

    position_m: Floats
    """(E, S, 3) position of the station's origin [m]."""
    tracker_from_station: Floats
    """(E, S, 4) unit quaternions."""
    quality: Floats
    """(E, S) 0 lost to 1 best."""
    ranges_received: Ints
    """(E, S) ranges received in the last cycle, 0 to 12."""
    ranges_rejected: Ints
    """(E, S) ranges of these that the filter rejected."""
    velocity_m_s: Floats
    """(E, S, 3) estimated velocity, for prediction [m/s]."""
    turn_rad_s: Floats
    """(E, S, 3) estimated angular velocity, for prediction [rad/s]."""
    enhanced_position_m: Floats
    """(2, E, S, 3) positions of the enhancement modes 1 and 2 [m]."""
    enhanced_tracker_from_station: Floats
    """(2, E, S, 4) unit quaternions of these modes."""
    coverage_share: Floats
    """(S,) share of the take's slots in which the station has heard three emitters or more within a turn, directly."""
    echo_share: Floats
    """(S,) share of the take's ranges that came from an echo."""


@dataclass(eq=False)
class SimulatedReadings:
    """N samples of S stations in the tracker's frame; components change the arrays in place."""

    seed: int
    take: str
    """Name of the take; part of the key of its random draws."""
    stations: tuple[str, ...]
    time_s: Floats
    """(N, S) true time of each sample [s]."""
    rate_hz: float
    velocity_m_s: Floats
    """(N, S, 3) true velocity in the tracker's axes [m/s]."""
    radius_m: Floats
    """(S,) distance of the station from the axis of its bone [m]; the station's z points away from it, x along it."""
    tissue_m: Floats
    """(S,) thickness of the soft tissue between bone and skin at the station [m]."""
    force_m_s2: Floats
    """(N, S, 3) specific force at the station minus that at rest in the rest pose, in the station's axes [m/s^2]."""
    position_m: Floats
    """(N, S, 3) reported position in the tracker's frame [m]."""
    turn: Floats
    """(N, S, 4) reported orientation, `tracker_from_station`."""
    quality: Floats
    """(N, S) 0 lost to 1 best."""
    device_s: Floats
    """(N, S) time stamp of the device's clock [s]."""
    affected: dict[str, Bools] = field(default_factory=dict)
    """Component name -> (N, S) readings that it changed; for the health record of a run."""
    session: str = ""
    """Name of the session. Takes of one session share the errors that are constant for a session. With "" the take is
    a session of its own."""
    filter: FilterReadings | None = None
    """What the filter of a physical tracker reports; its poses and qualities are those above before the faults."""
    emitters: tuple[Emitter, ...] = ()
    """The constellation of a physical tracker."""
    grown_room_m: tuple[float, float, float] | None = None
    """Length, width and height of its room, whose walls motion or emitters have moved out [m]."""

    def take_rng(self, component: str, station: str) -> np.random.Generator:
        """Random generator of one component at one station in this take, independent of all others."""
        return generator(self.seed, "noise", self.take, component, station)

    def session_rng(self, component: str, station: str) -> np.random.Generator:
        """Random generator of one component at one station for the whole session."""
        return generator(self.seed, "noise", self.session or self.take, component, station)

    def mask(self, stations: Collection[str], from_s: float, to_s: float) -> Bools:
        """(N, S) mask of the readings of these stations, () for all, with from_s <= time < to_s; UnknownName."""
        for station in stations:
            if station not in self.stations:
                raise UnknownName("station", station, self.stations)
        named = np.array([not stations or station in stations for station in self.stations])
        out: Bools = named & (self.time_s >= from_s) & (self.time_s < to_s)
        return out

    def translate(self, offset_m: Floats) -> None:
        """Add offsets (..., 3) in the tracker's axes to the positions [m]."""
        self.position_m = self.position_m + offset_m

    def rotate(self, rotation_vector_rad: Floats) -> None:
        """Rotate orientations by rotation vectors (..., 3) in the tracker's axes [rad]."""
        self.turn = rotations.multiply(rotations.exp(rotation_vector_rad), self.turn)

    def hold_last_valid(self, lost: Bools) -> None:
        """Set quality 0 for these readings (N, S); each repeats the last valid reading of its station."""
        self.quality[lost] = 0.0
        valid_row = np.where(lost, 0, np.arange(len(lost))[:, None])
        last, row = np.maximum.accumulate(valid_row, axis=0), np.arange(len(self.stations))
        self.position_m, self.turn = self.position_m[last, row], self.turn[last, row]
        self.affected["lost"] = self.affected.get("lost", np.zeros_like(lost)) | lost
