"""Emitters, rooms and motions of stations for tests of the physics."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.body import DEFAULT_MOUNTS, Body
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.motion import BodyMotion
from harness.simulate.link import TrackerConfig
from harness.simulate.physics.constellation import Constellation
from harness.simulate.physics.motion import TrackerMotion
from harness.simulate.physics.room import PlacedRoom, Room
from harness.simulate.physics.schedule import TICKS_PER_SLOT
from harness.simulate.simulation import WORLD_FROM_TRACKER, exact_calibration
from harness.simulate.trajectory import Trajectory
from harness.stream.polhemus import DEFAULT_EMITTERS
from harness.stream.polhemus.codec import Emitter

TICK_HZ = 400.0
ORIGIN_M = np.array(TrackerConfig().origin_m)


def emitters_at(*position_m: Sequence[float], cone_deg: float = 70.0) -> Constellation:
    """Emitters that face down and reach 4 m."""
    count = len(position_m)
    return Constellation(
        number=np.arange(count),
        position_m=np.array(position_m),
        normal=np.tile([0.0, 0.0, 1.0], (count, 1)),
        identity=np.arange(count),
        cone_rad=math.radians(cone_deg),
        range_m=4.0,
    )


def write_mcf(folder: Path, emitters: Sequence[Emitter]) -> Path:
    """A file of the lines that the device sends."""
    path = folder / "room.mcf"
    path.write_bytes(b"".join(emitter.line() for emitter in emitters))
    return path


def grid() -> Constellation:
    """The emulator's nine emitters, which face down 2.5 m above the floor."""
    return emitters_at(*(emitter.position_m for emitter in DEFAULT_EMITTERS))


def emitters_in_turn(first_slot: int, slots: int, emitters: int = 9) -> Ints:
    """(F,) the emitter of each slot, one after another."""
    out: Ints = np.arange(first_slot, first_slot + slots) % emitters
    return out


def placed(room: Room | None = None, centre_m: Floats = ORIGIN_M[:2]) -> PlacedRoom:
    """A room in the world, by default around the tracker's origin."""
    return PlacedRoom(room or Room(), centre_m, WORLD_FROM_TRACKER, ORIGIN_M)


def block_of(motion: TrackerMotion, first: int, slots: int) -> TrackerMotion:
    """Some slots of a motion."""
    ticks = slice(first * TICKS_PER_SLOT, (first + slots) * TICKS_PER_SLOT + 1)
    return TrackerMotion(*(part[ticks] for part in motion))


def some_stations(motion: TrackerMotion, *rows: int) -> TrackerMotion:
    """Some stations of a motion."""
    return motion._replace(
        position_m=motion.position_m[:, list(rows)],
        tracker_from_station=motion.tracker_from_station[:, list(rows)],
        velocity_m_s=motion.velocity_m_s[:, list(rows)],
        turn_rad_s=motion.turn_rad_s[:, list(rows)],
    )


UP = (0.0, 1.0, 0.0, 0.0)
"""Orientation of a station in the tracker's frame whose z points up."""
DOWN = (1.0, 0.0, 0.0, 0.0)


def still(slots: int, *position_m: Sequence[float], turn: Sequence[float] = UP) -> TrackerMotion:
    """Stations at rest at these places of the tracker's frame."""
    return moving(slots, *position_m, turn=turn, velocity_m_s=(0.0, 0.0, 0.0))


def moving(
    slots: int, *position_m: Sequence[float], turn: Sequence[float], velocity_m_s: Sequence[float]
) -> TrackerMotion:
    """Stations that begin at these places and move at a constant velocity."""
    time_s = np.arange(slots * TICKS_PER_SLOT + 1) / TICK_HZ
    shape = (len(time_s), len(position_m))
    velocity: Floats = np.broadcast_to(np.array(velocity_m_s), (*shape, 3))
    return TrackerMotion(
        time_s=time_s,
        position_m=np.array(position_m) + time_s[:, None, None] * velocity,
        tracker_from_station=np.broadcast_to(turn, (*shape, 4)),
        velocity_m_s=velocity,
        turn_rad_s=np.zeros((*shape, 3)),
    )


def worn(body: Body, take: BodyMotion, slots: int, *names: str) -> tuple[TrackerMotion, Floats]:
    """Stations on a performer, by default all with a default mount, and the configuration at each slot's beginning."""
    trajectory = Trajectory(body, take)
    mounts = [DEFAULT_MOUNTS[name] for name in names or DEFAULT_MOUNTS]
    calibration = exact_calibration(body, mounts, TrackerConfig())
    time_s = np.arange(slots * TICKS_PER_SLOT + 1) / TICK_HZ
    motion = trajectory.station_motion(calibration, np.repeat(time_s[:, None], len(mounts), axis=1))
    into = rotations.inverse(WORLD_FROM_TRACKER)
    stations = TrackerMotion(
        time_s=time_s,
        position_m=rotations.rotate(into, motion.position_m - ORIGIN_M),
        tracker_from_station=rotations.multiply(into, motion.world_from_station),
        velocity_m_s=rotations.rotate(into, motion.velocity_m_s),
        turn_rad_s=rotations.rotate(into, motion.turn_rad_s),
    )
    return stations, trajectory.qpos(time_s[:-1:TICKS_PER_SLOT])
