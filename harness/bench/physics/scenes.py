"""Scenes for `harness bench physics --truth`: free stations and a performer under the default constellation."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.optimize import least_squares

from harness.bench import common
from harness.body import DEFAULT_MOUNTS, build_body, retarget_to_own_body, tpose
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.mocap import synthetic
from harness.simulate import (
    WORLD_FROM_TRACKER,
    FilterReadings,
    Noise,
    SimulatedReadings,
    TrackerConfig,
    Trajectory,
    noise_preset,
    sampling_times_s,
    simulate_readings,
)
from harness.simulate.physics import (
    FACING_UP,
    Box,
    FreeMotionSource,
    LineOfSight,
    PhysicalTracker,
    Physics,
    PlacedRoom,
    Ranges,
    RangeSource,
    RangingModel,
    TrackerMotion,
    lead_in_s,
    load_constellation,
    random_motion,
    range_variance,
)

RATE_HZ = 40.0
"""Records per second of each station."""
HEIGHT_M = 1.2
"""Height of the middle of the free motion above the floor [m]."""
BYSTANDER = Box(centre_m=(0.0, 0.7, 0.875), size_m=(0.5, 0.3, 1.75))
"""A person who stands beside the free motion. The emitters hang overhead, so that it shades next to nothing."""
BOARD = Box(centre_m=(0.2, 0.1, 1.9), size_m=(0.8, 0.8, 0.1))
"""A board that hangs above the free motion and shades a part of it, such as a lamp."""
_TRACKER = TrackerConfig(rate_hz=RATE_HZ)
ORIGIN_M = np.array(_TRACKER.origin_m)
"""Origin of the tracker's frame in the world [m]."""
MIDDLE_M = (0.0, 0.0, float(ORIGIN_M[2]) - HEIGHT_M)
"""The middle of the free motion in the tracker's frame [m]."""
STATION = "station"


@dataclass(frozen=True, eq=False)
class StationErrors:
    """Errors of one station at E records."""

    time_s: Floats
    """(E,) times [s]."""
    error_m: Floats
    """(E, 3) reported minus true position, in the tracker's axes [m]."""
    turn_rad: Floats
    """(E, 3) rotation vector from the true to the reported orientation, in the tracker's axes [rad]."""
    quality: Floats
    """(E,) 0 lost to 1 best."""

    @property
    def size_m(self) -> Floats:
        """(E,) size of the position error [m]; NaN where the station is lost."""
        size_m: Floats = np.sqrt(np.sum(self.error_m**2, axis=1))
        return np.where(self.quality > 0.0, size_m, np.nan)

    @property
    def tilt_rad(self) -> Floats:
        """(E,) angle between the reported and the true vertical [rad]; exact for small errors."""
        out: Floats = np.hypot(self.turn_rad[:, 0], self.turn_rad[:, 1])
        return out

    @property
    def rms_m(self) -> float:
        """Root mean square of the position error of tracked records [m]; NaN without any."""
        found = self.size_m[np.isfinite(self.size_m)]
        return float(np.sqrt(np.mean(found**2))) if len(found) else float("nan")


def rest_source(seconds: float, physics: Physics, *, pitch_rad: float = 0.0) -> FreeMotionSource:
    """A station that rests below the middle of the constellation, its z axis at an angle to the vertical [rad]."""
    turn = rotations.multiply(FACING_UP, rotations.exp(np.array([0.0, pitch_rad, 0.0])))
    return resting_source(np.array(MIDDLE_M), turn, seconds, physics)


def resting_source(
    position_m: Floats, tracker_from_station: Floats, seconds: float, physics: Physics
) -> FreeMotionSource:
    """A station that rests at a position (3,) with an orientation (4,)."""
    return FreeMotionSource(
        (STATION,),
        np.array([0.0, seconds / 2.0, seconds]),
        np.broadcast_to(position_m, (3, 1, 3)),
        np.broadcast_to(tracker_from_station, (3, 1, 4)),
        warm_up_s=lead_in_s(physics),
    )


def free_source(seed: int, seconds: float, speed_m_s: float, physics: Physics) -> FreeMotionSource:
    """Random motion in a cube of 1 m below the middle of the constellation."""
    return random_motion(
        seed,
        STATION,
        seconds=seconds,
        size_m=1.0,
        speed_m_s=speed_m_s,
        warm_up_s=lead_in_s(physics),
        centre_m=MIDDLE_M,
    )


def with_furniture(physics: Physics, box: Box) -> Physics:
    """The physics with one piece of furniture in the room."""
    return replace(physics, room=replace(physics.room, furniture=(box,)))


def without_shadow(physics: Physics) -> Physics:
    """The physics without shadow and echoes."""
    return replace(physics, room=replace(physics.room, shadow=False, echoes=False))


def track_free_station(
    make_source: Callable[[], FreeMotionSource],
    seconds: float,
    physics: Physics,
    seed: int,
    *,
    covered_s: tuple[float, float] | None = None,
) -> StationErrors:
    """Errors of a free station. `make_source` makes equal sources; all emitters are covered in `covered_s` [s]."""
    time_s, readings = measure_free_station(make_source(), seconds, physics, seed, covered_s=covered_s)
    true = make_source().sample_motion(time_s)
    turns = readings.tracker_from_station, true.tracker_from_station
    return _errors(time_s, (readings.position_m, true.position_m), turns, readings.quality)


def measure_free_station(
    source: FreeMotionSource,
    seconds: float,
    physics: Physics,
    seed: int,
    *,
    covered_s: tuple[float, float] | None = None,
) -> tuple[Floats, FilterReadings]:
    """Times (E,) of the records of a free station [s], and what they show; see `track_free_station`."""
    placed = PlacedRoom(physics.room, np.zeros(2), WORLD_FROM_TRACKER, ORIGIN_M)
    shade = physics.room.shadow and bool(physics.room.furniture)
    constellation, sight = load_constellation(physics.constellation), LineOfSight(None, placed) if shade else None
    tracker = PhysicalTracker(source, physics, constellation, placed, sight, seed=seed, take=STATION)
    if covered_s is not None:
        tracker.ranging = _CoveredEmitters(tracker.ranging, covered_s, tracker.schedule.slot_s)
    time_s = np.arange(int(seconds * RATE_HZ) + 1) / RATE_HZ
    return time_s, tracker.measure_take(time_s[:, None])


def join_errors(parts: Sequence[StationErrors]) -> StationErrors:
    """The errors of several recordings of a station as one; times begin anew with each."""
    return StationErrors(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(StationErrors)))


class _CoveredEmitters:
    """Ranges of a tracker, but for a time in which all emitters are covered."""

    def __init__(self, ranging: RangeSource, covered_s: tuple[float, float], slot_s: float) -> None:
        self._ranging, self._covered_s, self._slot_s = ranging, covered_s, slot_s

    def measure_ranges(self, first_slot: int, emitter: Ints, motion: TrackerMotion, qpos: Floats | None) -> Ranges:
        ranges = self._ranging.measure_ranges(first_slot, emitter, motion, qpos)
        time_s = (first_slot + np.arange(len(ranges.emitter))) * self._slot_s
        covered = (time_s >= self._covered_s[0]) & (time_s < self._covered_s[1])
        return replace(ranges, range_m=np.where(covered[:, None, None], np.nan, ranges.range_m))


def _errors(
    time_s: Floats, positions_m: tuple[Floats, Floats], turns: tuple[Floats, Floats], quality: Floats
) -> StationErrors:
    """The errors of the only station, from positions (E, 1, 3) and turns (E, 1, 4) that are reported and true."""
    turn_rad = rotations.log(rotations.multiply(turns[0][:, 0], rotations.inverse(turns[1][:, 0])))
    return StationErrors(time_s, positions_m[0][:, 0] - positions_m[1][:, 0], turn_rad, quality[:, 0])


def track_hand(seed: int, seconds: float, physics: Physics, *, behind: bool) -> StationErrors:
    """Errors of a station on the back of the right hand, in front of the belly or behind the back of a performer.

    The performer stands and sways a little.
    """
    body = build_body()
    skeleton = body.skeleton
    angles_deg = _BEHIND_BACK if behind else _IN_FRONT
    qpos = tpose(skeleton).copy()
    for name, angle_deg in angles_deg.items():
        qpos[QPOS_OF_DOF[skeleton.dof_names.index(name)] + 7] = np.deg2rad(angle_deg)
    rate_hz = 30.0
    frames = int(seconds * rate_hz) + 1
    sway = generator(seed, "physics", "sway").normal(size=(6, 2))
    time_s = np.arange(frames) / rate_hz
    poses = np.tile(qpos, (frames, 1))
    for k in range(2):
        for n in range(3):
            poses[:, k] += 0.01 * sway[n, k] * np.sin(2.0 * np.pi * (0.15 + 0.1 * n) * time_s + sway[3 + n, k])
    take = BodyMotion(f"hand {behind}", "standard", "scene", "standing", rate_hz, poses)
    trajectory, mounts = Trajectory(body, take), [DEFAULT_MOUNTS["right_hand"]]
    at_s = sampling_times_s(trajectory.duration_s, _TRACKER, 1)
    found, true = (
        simulate_readings(trajectory, mounts, _TRACKER, noise, at_s, seed=seed, take="hand")
        for noise in (Noise(physics=physics), noise_preset("clean"))
    )
    return _errors(at_s[:, 0], (found.position_m, true.position_m), (found.turn, true.turn), found.quality)


_IN_FRONT = {"rclavicle.rz": 11.0, "rhumerus.rx": -13.0, "rhumerus.ry": 66.0, "rhumerus.rz": -77.0, "rradius.rx": 76.0}
_BEHIND_BACK = {
    "rclavicle.rz": 11.0,
    "rhumerus.rx": -121.0,
    "rhumerus.ry": 27.0,
    "rhumerus.rz": 176.0,
    "rradius.rx": 91.0,
}
"""Angles of the right arm that put the hand 0.27 m in front of the spine and 0.24 m behind it [deg]."""


def scaled_position_m(place_m: Floats, scale: float, physics: Physics) -> Floats:
    """(3,) where least squares put a station at `place_m` (3,) when every range is too long by a factor [m].

    The ranges are those to all emitters within cone and reach, with the weights that the filter gives them.
    """
    constellation = load_constellation(physics.constellation)
    ray_m = place_m - constellation.position_m
    distance_m = np.sqrt(np.sum(ray_m**2, axis=1))
    cosine = np.sum(ray_m * constellation.normal, axis=1) / distance_m
    heard = (distance_m <= constellation.range_m) & (cosine >= np.cos(constellation.cone_rad))
    noise = physics.fusion.range_noise_m, physics.fusion.range_scale, physics.fusion.survey_m
    emitters = constellation.position_m, constellation.normal
    hearing = constellation.range_m, np.cos(constellation.cone_rad), -np.inf
    model = RangingModel(*emitters, np.zeros((1, 1, 3)), 1.0, physics.sound.absorption_db_per_m, *noise, *hearing)
    rays = enumerate(zip(distance_m, ray_m / distance_m[:, None], strict=True))
    sigma_m = np.sqrt([range_variance(model, j, r, x, y, z, z) for j, (r, (x, y, z)) in rays])[heard]
    emitters_m, measured_m = constellation.position_m[heard], scale * distance_m[heard]

    def residuals(at_m: Floats) -> Floats:
        out: Floats = (np.sqrt(np.sum((at_m - emitters_m) ** 2, axis=1)) - measured_m) / sigma_m
        return out

    found: Floats = least_squares(residuals, place_m).x
    return found


def simulate_performer(
    behaviour: str, seed: int, seconds: float, noise: Noise
) -> tuple[SimulatedReadings, SimulatedReadings]:
    """Readings of the six stations on built-in motion, and the true ones, at the tracker's default rate."""
    performers = synthetic.REFERENCE_PERFORMERS
    clip = synthetic.generate(behaviour, performers[seed % len(performers)], 1, seed=seed, duration_s=seconds)
    body, take = retarget_to_own_body(clip)
    trajectory, tracker = Trajectory(body, take), TrackerConfig()
    time_s = sampling_times_s(trajectory.duration_s, tracker, len(common.MOUNTS))
    found, true = (
        simulate_readings(trajectory, common.MOUNTS, tracker, model, time_s, seed=seed, take=take.name)
        for model in (noise, noise_preset("clean"))
    )
    return found, true
