"""Coverage: how many emitters are heard at a place, or by the stations of a performer, and how well they fix it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints, freeze
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.simulate.physics.constellation import Constellation, middle_of_path_m
from harness.simulate.physics.line_of_sight import LineOfSight
from harness.simulate.physics.room import Room, place_room
from harness.simulate.physics.sound import Sound, level_db, threshold_db
from harness.simulate.trajectory import Trajectory

FIX_RANGES = 3
"""Number of ranges that a position needs."""
LARGEST_DILUTION = 10.0
"""Largest dilution of precision that counts as a fix [choice]: 4 mm of a range then make 4 cm."""
PLAN_POINTS = 121
"""Places along each axis of a plan view [choice]."""
_MARGIN_M = 2.0
"""Width of the strip around the emitters in a plan view [m] [choice]."""
_SINGULAR = 1e-9
"""Determinant of the normal matrix below which ranges fix no position: the emitters lie in a plane with the station."""
MOST_SAMPLES = 600
"""Most instants of a clip that are looked at [choice]."""
_SAMPLES_HZ = 10.0


def dilution_of_precision(unit: Floats, heard: Bools) -> Floats:
    """Dilution of precision of a position from ranges: (...,) from unit vectors (..., J, 3) to emitters heard (..., J).

    With the heard unit vectors as the rows of G it is sqrt(trace((G'G)^-1)): the standard deviation of the position
    over that of a range (Langley 1999, "Dilution of Precision", GPS World 10). NaN where fewer than three emitters are
    heard, and where these fix no position.
    """
    g = np.where(heard[..., None], unit, 0.0)
    (xx, xy, xz), (yy, yz), (zz,) = ([np.sum(g[..., a] * g[..., b], axis=-1) for b in range(a, 3)] for a in range(3))
    minors = xx * yy - xy**2 + xx * zz - xz**2 + yy * zz - yz**2
    determinant = xx * (yy * zz - yz**2) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    fixed = (np.sum(heard, axis=-1) >= FIX_RANGES) & (determinant > _SINGULAR)
    out: Floats = np.sqrt(np.where(fixed, minors, np.nan) / np.where(fixed, determinant, 1.0))
    return out


class EmitterCoverage(NamedTuple):
    """Coverage at N places without a body; a station there faces each emitter."""

    emitters: Ints
    """(N,) number of emitters heard."""
    dilution: Floats
    """(N,) dilution of precision; NaN without a fix."""

    @property
    def share(self) -> float:
        """Share of the places where three emitters or more are heard."""
        return float(np.mean(self.emitters >= FIX_RANGES))

    @property
    def fix_share(self) -> float:
        """Share of the places where these ranges fix a position, with a dilution of at most `LARGEST_DILUTION`."""
        return float(np.mean(self.dilution <= LARGEST_DILUTION))

    @property
    def median_emitters(self) -> float:
        """Median number of emitters heard."""
        return float(np.median(self.emitters))

    @property
    def median_dilution(self) -> float:
        """Median dilution of precision over the places with a fix; NaN without any."""
        return median_of_finite(self.dilution)


def emitter_coverage(constellation: Constellation, position_m: Floats) -> EmitterCoverage:
    """Coverage at places (N, 3) in the tracker's frame [m]: emitters in whose range and cone a place lies."""
    ray_m = position_m[:, None] - constellation.position_m
    distance_m = np.sqrt(np.sum(ray_m**2, axis=-1))
    in_cone = np.sum(ray_m * constellation.normal, axis=-1) >= np.cos(constellation.cone_rad) * distance_m
    heard = (distance_m <= constellation.range_m) & in_cone & (distance_m > 0.0)
    unit = ray_m / np.where(distance_m > 0.0, distance_m, 1.0)[..., None]
    return EmitterCoverage(heard.sum(axis=-1), dilution_of_precision(unit, heard))


def plan_axes_m(constellation: Constellation) -> tuple[Floats, Floats]:
    """x and y of the places of a plan view, (PLAN_POINTS,) each: the emitters and a strip around them [m]."""
    low_m, high_m = np.min(constellation.position_m, axis=0), np.max(constellation.position_m, axis=0)
    x_m, y_m = (np.linspace(low_m[axis] - _MARGIN_M, high_m[axis] + _MARGIN_M, PLAN_POINTS) for axis in (0, 1))
    return x_m, y_m


def grid_m(x_m: Floats, y_m: Floats, z_m: Floats) -> Floats:
    """(X * Y * Z, 3) the places of a grid, z changing fastest [m]."""
    out: Floats = np.stack(np.meshgrid(x_m, y_m, z_m, indexing="ij"), axis=-1).reshape(-1, 3)
    return out


def median_of_finite(values: Floats) -> float:
    """Median of the finite values; NaN without any."""
    finite = values[np.isfinite(values)]
    return float(np.median(finite)) if finite.size else float("nan")


@dataclass(frozen=True, eq=False)
class StationCoverage:
    """Coverage of S stations at N instants of a clip."""

    stations: tuple[str, ...]
    emitters: Ints
    """(N, S) number of emitters that one of the station's microphones hears."""
    dilution: Floats
    """(N, S) dilution of precision at the station's origin; NaN without a fix."""

    def __post_init__(self) -> None:
        freeze(self, np.int64, emitters=("N", len(self.stations)))
        freeze(self, dilution=(len(self.emitters), len(self.stations)))

    def shares(self, station: int) -> tuple[float, float, float, float]:
        """Shares of the time in which a station hears no emitter, one, two, and three or more."""
        counts = np.bincount(np.minimum(self.emitters[:, station], FIX_RANGES), minlength=FIX_RANGES + 1) / len(
            self.emitters
        )
        none, one, two, enough = map(float, counts)
        return none, one, two, enough

    def fix_share(self, station: int) -> float:
        """Share of the time in which a station has a fix, with a dilution of at most `LARGEST_DILUTION`."""
        return float(np.mean(self.dilution[:, station] <= LARGEST_DILUTION))

    def median_dilution(self, station: int) -> float:
        """Median dilution of precision of a station while it has a fix; NaN if it never has."""
        return median_of_finite(self.dilution[:, station])


def station_coverage(
    constellation: Constellation,
    body: Body,
    motion: BodyMotion,
    calibration: Calibration,
    *,
    room: Room | None = None,
    sound: Sound | None = None,
) -> StationCoverage:
    """Coverage of the stations of a calibration on a performer who moves below a constellation.

    The constellation stands above the middle of the motion's path. An emitter is heard when a microphone lies in its
    range and cone, receives enough sound, and neither body nor furniture is between them. At most ten instants per
    second are looked at, and at most `MOST_SAMPLES`.
    """
    room, sound = room or Room(), sound or Sound()
    trajectory = Trajectory(body, motion)
    count = min(int(trajectory.duration_s * _SAMPLES_HZ) + 1, MOST_SAMPLES)
    time_s = np.linspace(0.0, trajectory.duration_s, count)
    qpos = trajectory.qpos(time_s)
    stations = trajectory.station_motion(calibration, np.repeat(time_s[:, None], len(calibration.stations), axis=1))
    centre_m = middle_of_path_m(motion.qpos)
    tracker_from_world = rotations.inverse(calibration.world_from_tracker)
    centred, placed = place_room(room, constellation, centre_m, calibration)
    position_m = rotations.rotate(tracker_from_world, stations.position_m - calibration.tracker_origin_m)
    turned = rotations.multiply(tracker_from_world, stations.world_from_station)
    sight = LineOfSight(body, placed) if room.shadow else None
    heard = np.empty((count, len(calibration.stations), len(constellation)), dtype=bool)
    for n in range(count):
        if sight is not None:
            sight.pose_body(qpos[n])
        heard[n] = audible_emitters(centred, position_m[n], turned[n], sound, sight)
    ray_m = position_m[:, :, None] - centred.position_m
    unit = ray_m / np.sqrt(np.sum(ray_m**2, axis=-1, keepdims=True))
    return StationCoverage(calibration.stations, heard.sum(axis=-1), dilution_of_precision(unit, heard))


def audible_emitters(
    constellation: Constellation, position_m: Floats, turned: Floats, sound: Sound, sight: LineOfSight | None
) -> Bools:
    """(S, J) which emitters a microphone of each station hears.

    Stations have positions (S, 3) and orientations (S, 4) in the tracker's frame. `sight` tells what is in the way.
    """
    out = np.zeros((len(position_m), len(constellation)), dtype=bool)
    microphones_m = position_m[:, None] + rotations.rotate(turned[:, None], np.array(sound.microphones_m))
    outward = rotations.rotate(turned, np.array([0.0, 0.0, 1.0]))
    least_db = threshold_db(constellation.range_m, constellation.cone_rad, sound.absorption_db_per_m)
    cone_cos = float(np.cos(constellation.cone_rad))
    for emitter, (at_m, normal) in enumerate(zip(constellation.position_m, constellation.normal, strict=True)):
        ray_m = microphones_m - at_m
        distance_m = np.sqrt(np.sum(ray_m**2, axis=-1))
        emitter_cos = np.sum(ray_m * normal, axis=-1) / distance_m
        station_cos = -np.sum(ray_m * outward[:, None], axis=-1) / distance_m
        near: Bools = (distance_m <= constellation.range_m) & (emitter_cos >= cone_cos)
        for station, microphone in np.argwhere(near):
            each = station, microphone
            level = level_db(distance_m[each], emitter_cos[each], station_cos[each], sound.absorption_db_per_m)
            near[each] = level >= least_db
        if sight is not None and near.any():
            near[near] = ~sight.occlusion(at_m, microphones_m[near])
        out[:, emitter] = near.any(axis=1)
    return out
