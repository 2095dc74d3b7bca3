"""Emitters, rooms and motions of stations for tests of the physics."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.body.humanoid import Body
from harness.body.mounts import DEFAULT_MOUNTS
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.simulate.link import TrackerConfig
from harness.simulate.physics.room import PlacedRoom, Room
from harness.simulate.physics.schedule import TICKS_PER_SLOT, Schedule
from harness.simulate.simulation import WORLD_FROM_TRACKER, exact_calibration
from harness.simulate.trajectory import Trajectory
from harness.stream.emulator.settings import DEFAULT_EMITTERS

TICK_HZ = 400.0
ORIGIN_M = np.array(TrackerConfig().origin_m)


@dataclass
class Emitters:
    """Emitters in the tracker's frame."""

    position_m: Floats
    normal: Floats
    cone_rad: float = float(np.deg2rad(70.0))
    range_m: float = 4.0

    @property
    def schedule(self) -> Schedule:
        return Schedule(TICK_HZ, len(self.position_m))


def grid() -> Emitters:
    """The emulator's nine emitters, which face down 2.5 m above the floor."""
    return Emitters(np.array([e.position_m for e in DEFAULT_EMITTERS]), np.tile([0.0, 0.0, 1.0], (9, 1)))


def placed(room: Room | None = None) -> PlacedRoom:
    """A room around the tracker's frame."""
    return PlacedRoom(room or Room(), ORIGIN_M[:2], WORLD_FROM_TRACKER, ORIGIN_M)


@dataclass
class Stations:
    """Motion of the origins of stations at the ticks of a block."""

    position_m: Floats
    velocity_m_s: Floats
    tracker_from_station: Floats
    turn_rad_s: Floats

    def points(self, offset_m: Floats) -> tuple[Floats, Floats]:
        arm_m = rotations.rotate(self.tracker_from_station, offset_m)
        return self.position_m + arm_m, self.velocity_m_s + np.cross(self.turn_rad_s, arm_m)

    def block(self, first: int, slots: int) -> "Stations":
        """Some of its slots."""
        ticks = slice(first * TICKS_PER_SLOT, (first + slots) * TICKS_PER_SLOT + 1)
        return Stations(
            self.position_m[ticks], self.velocity_m_s[ticks], self.tracker_from_station[ticks], self.turn_rad_s[ticks]
        )

    def only(self, *rows: int) -> "Stations":
        """Some of its stations."""
        at = list(rows)
        return Stations(
            self.position_m[:, at],
            self.velocity_m_s[:, at],
            self.tracker_from_station[:, at],
            self.turn_rad_s[:, at],
        )


UP = (0.0, 1.0, 0.0, 0.0)
"""Orientation of a station in the tracker's frame whose z points up."""
DOWN = (1.0, 0.0, 0.0, 0.0)


def still(slots: int, *position_m: Sequence[float], turn: Sequence[float] = UP) -> Stations:
    """Stations at rest at these places of the tracker's frame."""
    shape = (slots * TICKS_PER_SLOT + 1, len(position_m))
    at_m, turns = np.broadcast_to(position_m, (*shape, 3)), np.broadcast_to(turn, (*shape, 4))
    return Stations(np.array(at_m), np.zeros((*shape, 3)), np.array(turns), np.zeros((*shape, 3)))


def worn(body: Body, take: BodyMotion, slots: int, *names: str) -> tuple[Stations, Floats]:
    """Stations on a performer, by default all with a default mount, and the configuration at each slot's beginning."""
    trajectory = Trajectory(body, take)
    mounts = [DEFAULT_MOUNTS[name] for name in names or DEFAULT_MOUNTS]
    calibration = exact_calibration(body, mounts, TrackerConfig())
    time_s = np.arange(slots * TICKS_PER_SLOT + 1) / TICK_HZ
    motion = trajectory.station_motion(calibration, np.repeat(time_s[:, None], len(mounts), axis=1))
    into = rotations.inverse(WORLD_FROM_TRACKER)
    stations = Stations(
        rotations.rotate(into, motion.position_m - ORIGIN_M),
        rotations.rotate(into, motion.velocity_m_s),
        rotations.multiply(into, motion.world_from_station),
        rotations.rotate(into, motion.turn_rad_s),
    )
    return stations, trajectory.qpos(time_s[:-1:TICKS_PER_SLOT])
