"""Mount errors: trackers that are put on beside their nominal mounts, or that slip on their straps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from harness.body import Mount
from harness.core import rotations
from harness.core.ranges import CheckedFields, Range
from harness.core.seeds import generator
from harness.errors import UnknownName
from harness.simulate.readings import SimulatedReadings


@dataclass(frozen=True)
class MountOffset(CheckedFields):
    """Constant normal offset of each tracker from its nominal mount, for a whole session. In no noise preset."""

    position_m: Annotated[float, Range(0.0, 1.0)] = 0.0
    """Standard deviation along each axis of the station [m]."""
    orientation_rad: Annotated[float, Range(0.0, math.pi)] = 0.0
    """Standard deviation about each axis of the station [rad]."""

    def apply(self, readings: SimulatedReadings) -> None:
        for row, station in enumerate(readings.stations):
            draw = readings.session_rng("mount", station).normal(size=6)
            readings.position_m[:, row] += rotations.rotate(readings.turn[:, row], self.position_m * draw[:3])
            turn = rotations.exp(self.orientation_rad * draw[3:])
            readings.turn[:, row] = rotations.multiply(readings.turn[:, row], turn)


@dataclass(frozen=True)
class MountSlip(CheckedFields):
    """A slip of one strap: the tracker moves around and along its bone, at once or slowly, and stays there."""

    station: str
    from_s: Annotated[float, Range(-1e6, 1e6)] = 0.0
    """Beginning of the slip [s]."""
    over_s: Annotated[float, Range(0.0, 1e6)] = 0.0
    """Duration of the slip [s]; 0 is a step."""
    around_rad: Annotated[float, Range(-100.0, 100.0)] = 0.0
    """Final angle about the bone, by the right-hand rule about the bone's direction [rad]."""
    along_m: Annotated[float, Range(-10.0, 10.0)] = 0.0
    """Final distance along the bone, towards its far end [m]."""

    def apply(self, readings: SimulatedReadings) -> None:
        if self.station not in readings.stations:
            raise UnknownName("station", self.station, readings.stations)
        row = readings.stations.index(self.station)
        since_s = readings.time_s[:, row] - self.from_s
        share = np.where(since_s < 0.0, 0.0, np.minimum(since_s / max(self.over_s, 1e-9), 1.0))
        share = np.where((since_s >= 0.0) & (self.over_s == 0.0), 1.0, share)
        # In the station's axes the bone runs along x, `radius_m` below the origin.
        angle = self.around_rad * share
        below = readings.radius_m[row] * np.stack([np.zeros_like(angle), -np.sin(angle), np.cos(angle) - 1.0], axis=1)
        below[:, 0] = self.along_m * share
        readings.position_m[:, row] += rotations.rotate(readings.turn[:, row], below)
        around = rotations.exp(angle[:, None] * np.array([1.0, 0.0, 0.0]))
        readings.turn[:, row] = rotations.multiply(readings.turn[:, row], around)


@dataclass(frozen=True)
class StrapSlip(CheckedFields):
    """Each strap slips once in a take with probability `share`, at a uniformly random moment (see `MountSlip`).

    The slip is N(0, `along_m`) along the bone and N(0, `around_rad`) around it. In no noise preset; all numbers are
    choices. Each station has its own random draws, so it slips alike in every set of stations that contains it.
    """

    share: Annotated[float, Range(0.0, 1.0)] = 0.2
    """Probability that a strap slips."""
    along_m: Annotated[float, Range(0.0, 0.5)] = 0.01
    """Standard deviation of the slip along the bone [m]."""
    around_rad: Annotated[float, Range(0.0, math.pi)] = 0.15
    """Standard deviation of the slip around the bone [rad]."""
    over_s: Annotated[float, Range(0.0, 60.0)] = 0.5
    """Duration of a slip [s]."""

    def apply(self, readings: SimulatedReadings) -> None:
        begin_s, end_s = float(readings.time_s.min()), float(readings.time_s.max())
        for station in readings.stations:
            slip = self.draw(readings.take_rng("loose", station), station, begin_s, end_s)
            if slip is not None:
                slip.apply(readings)

    def draw(self, rng: np.random.Generator, station: str, begin_s: float, end_s: float) -> MountSlip | None:
        """The slip of a station in a take between two times [s]; None when its strap holds."""
        slips, when, along, around = rng.random() < self.share, rng.random(), rng.normal(), rng.normal()
        if not slips:
            return None
        return MountSlip(
            station,
            from_s=begin_s + when * (end_s - begin_s),
            over_s=self.over_s,
            around_rad=self.around_rad * around,
            along_m=self.along_m * along,
        )


def perturb_mounts(
    mounts: Sequence[Mount], *, beside_m: float, turned_rad: float, seed: int, session: str
) -> tuple[Mount, ...]:
    """Mounts with normal errors: `beside_m` along each axis [m], and `turned_rad` about each axis [rad].

    Both are standard deviations; half a turn makes the orientation practically uniform. Each station of each session
    has its own random draws.
    """
    return tuple(_perturb_mount(mount, beside_m, turned_rad, seed, session) for mount in mounts)


def _perturb_mount(mount: Mount, beside_m: float, turned_rad: float, seed: int, session: str) -> Mount:
    off = generator(seed, "strapped", session, mount.station).normal(size=6)
    (x, y, z), (a, b, c) = (beside_m * off[:3]).tolist(), (turned_rad * off[3:]).tolist()
    return replace(mount, offset_m=(x, y, z), rotation_rad=(a, b, c))
