"""Ranging: which sound each microphone hears in each slot, and the range that the device measures from it.

What a microphone hears, and how loud, is computed from the geometry at the instant in which the emitter fires; the time
of flight from the microphone's motion until the sound arrives.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.compiled import compiled
from harness.core.seeds import generator
from harness.simulate.physics.constellation import Constellation
from harness.simulate.physics.line_of_sight import LineOfSight
from harness.simulate.physics.motion import TrackerMotion
from harness.simulate.physics.room import PlacedRoom
from harness.simulate.physics.schedule import TICKS_PER_SLOT, Schedule
from harness.simulate.physics.sound import (
    MICROPHONES,
    Bursts,
    Sound,
    level_db,
    mirror_images,
    noise_factor,
    reflection_point,
    speed_of_sound_m_s,
    threshold_db,
    time_of_flight_s,
)

_EARLY_SHARE = 0.5
"""Share of the microphones that a burst triggers early; the others hear nothing [choice]."""


@dataclass(frozen=True, eq=False)
class Ranges:
    """The ranges of F slots, S stations and two microphones."""

    emitter: Ints
    """(F,) index of the emitter that fired."""
    range_m: Floats
    """(F, S, 2) measured time of flight times the assumed speed of sound [m]; NaN where nothing was heard."""
    direct: Bools
    """(F, S, 2) whether the range is that of the sound that came straight from the emitter."""
    echo: Bools
    """(F, S, 2) whether it is that of an echo. It is neither where a burst of noise triggered the microphone."""


class _Acoustics(NamedTuple):
    """What decides whether sound is heard, for the compiled loops."""

    tick_s: float
    cone_cos: float
    range_m: float
    threshold_db: float
    absorption_db_per_m: float
    reflection_db: float


_Paths = tuple[Ints, Floats, Floats, Floats, Floats, Floats, Floats, _Acoustics]
"""For compiled loops: emitter of each slot (F,), positions and normals of the emitters (J, 3), positions and velocities
of the microphones at the ticks (T+1, S, 2, 3), the stations' z axes (F, S, 3), speed of sound (F, S), and what decides
whether it is heard."""


class Ranging:
    """Measures ranges block after block of slots. Every random draw belongs to a station, a session or a take."""

    def __init__(
        self,
        sound: Sound,
        constellation: Constellation,
        schedule: Schedule,
        placed: PlacedRoom,
        sight: LineOfSight | None,
        stations: tuple[str, ...],
        *,
        seed: int,
        take: str,
        session: str = "",
    ) -> None:
        """Begin a take with the emitters at their true positions.

        Without `sight` nothing blocks sound; there are echoes if `placed.room` has them.
        """
        self._sound, self._schedule, self._sight = sound, schedule, sight
        self._position_m = np.array(constellation.position_m)
        self._normal = np.array(constellation.normal)
        reflection = placed.room.reflection
        self._planes = placed.planes() if placed.room.echoes and reflection > 0.0 else np.zeros((0, 4))
        self._images_m = mirror_images(self._planes, self._position_m)
        self._acoustics = _Acoustics(
            tick_s=1.0 / schedule.tick_hz,
            cone_cos=math.cos(constellation.cone_rad),
            range_m=constellation.range_m,
            threshold_db=threshold_db(constellation.range_m, constellation.cone_rad, sound.absorption_db_per_m),
            absorption_db_per_m=sound.absorption_db_per_m,
            reflection_db=20.0 * math.log10(reflection) if reflection > 0.0 else -math.inf,
        )
        self.temperature_c = sound.temperature_c + sound.temperature_sd_c * float(
            generator(seed, "physics", session or take, "sound", "temperature").standard_normal()
        )
        """True temperature of the session [deg C]."""
        self._speed_m_s = speed_of_sound_m_s(self.temperature_c)
        self._assumed_m_s = speed_of_sound_m_s(sound.assumed_c)
        self._bursts = Bursts(sound.bursts_per_min, sound.burst_s, seed=seed, take=take)
        self._noise = [generator(seed, "physics", take, "range noise", station) for station in stations]
        self._chance = [generator(seed, "physics", take, "range faults", station) for station in stations]
        self._air_m_s = np.full((schedule.emitters, len(stations)), np.nan)
        self._air_slot = np.zeros(schedule.emitters, dtype=np.int64)

    def measure_ranges(self, first_slot: int, emitter: Ints, motion: TrackerMotion, qpos: Floats | None) -> Ranges:
        """The ranges of the next block of F slots, in which emitters (F,) fire.

        `motion` covers the block's ticks. `qpos` (F, 55) is the body's configuration at the beginning of each slot, for
        `sight`; None if no body is in the room.
        """
        points = [motion.points(np.array(offset_m)) for offset_m in self._sound.microphones_m]
        position_m, velocity_m_s = (np.ascontiguousarray(np.stack(part, axis=2)) for part in zip(*points, strict=True))
        slots = len(emitter)
        begins = slice(0, slots * TICKS_PER_SLOT, TICKS_PER_SLOT)
        facing = rotations.rotate(motion.tracker_from_station[begins], np.array([0.0, 0.0, 1.0]))
        normals = np.stack([rng.standard_normal((slots, MICROPHONES + 1)) for rng in self._noise], axis=1)
        uniforms = np.stack([rng.random((slots, MICROPHONES, 2)) for rng in self._chance], axis=1)
        _air_speeds(
            self._air_m_s,
            self._air_slot,
            first_slot,
            emitter,
            normals[..., MICROPHONES],
            self._schedule.slot_s / self._sound.air_correlation_s,
            self._sound.air_speed_sd_m_s,
            air := np.empty((slots, len(self._noise))),
        )
        speed_m_s = self._speed_m_s + air
        paths = (emitter, self._position_m, self._normal, position_m, velocity_m_s, facing, speed_m_s, self._acoustics)
        time_s, level = _direct_sound(paths)
        at_m = position_m[begins]
        self._occlude_direct(emitter, at_m, qpos, time_s)
        direct = ~np.isnan(time_s)
        if len(self._planes):
            reflected_s, reflected_db, bounce_m = _reflected_sound(self._planes, self._images_m, time_s, paths)
            self._occlude_reflected(emitter, at_m, qpos, reflected_s, bounce_m)
            _first_arrival(reflected_s, reflected_db, time_s, level)
        echo = ~np.isnan(time_s) & ~direct
        ticks_s = self._schedule.ticks_s(first_slot, slots)[::TICKS_PER_SLOT]
        burst = self._bursts.overlaps(ticks_s[:-1], ticks_s[1:])
        range_m = _range_measurements(time_s, level, normals, uniforms, burst, self._assumed_m_s, self._sound_errors())
        undisturbed = ~burst[:, None, None]
        return Ranges(emitter, range_m, direct & undisturbed, echo & undisturbed)

    def _sound_errors(self) -> tuple[float, float, float, float]:
        sound = self._sound
        return sound.range_noise_m, sound.wrong_cycle_share, sound.frequency_hz, sound.absorption_db_per_m

    def _occlude_direct(self, emitter: Ints, at_m: Floats, qpos: Floats | None, time_s: Floats) -> None:
        """Set the times to NaN where the straight path is blocked."""
        if self._sight is None:
            return
        candidates = ~np.isnan(time_s)
        for slot in np.nonzero(candidates.any(axis=(1, 2)))[0]:
            if qpos is not None:
                self._sight.pose_body(qpos[slot])
            heard = candidates[slot]
            blocked = self._sight.occlusion(self._position_m[emitter[slot]], at_m[slot][heard])
            time_s[slot][heard] = np.where(blocked, np.nan, time_s[slot][heard])

    def _occlude_reflected(
        self, emitter: Ints, at_m: Floats, qpos: Floats | None, time_s: Floats, bounce_m: Floats
    ) -> None:
        """Set the times (F, S, 2, P) to NaN where the path to the plane, or from it, is blocked."""
        if self._sight is None:
            return
        candidates = ~np.isnan(time_s)
        for slot in np.nonzero(candidates.any(axis=(1, 2, 3)))[0]:
            if qpos is not None:
                self._sight.pose_body(qpos[slot])
            at, j = candidates[slot], emitter[slot]
            at[at] = ~self._sight.occlusion(self._position_m[j], bounce_m[slot][at])
            for plane in np.nonzero(at.any(axis=(0, 1)))[0]:
                own = at[..., plane]
                # No geom lies outside the room, so that the part of the ray beyond the plane hits nothing.
                own[own] = ~self._sight.occlusion(self._images_m[j, plane], at_m[slot][own])
            time_s[slot][~at] = np.nan


@compiled
def _air_speeds(
    state: Floats,
    state_slot: Ints,
    first_slot: int,
    emitter: Ints,
    normals: Floats,
    decay: float,
    sd: float,
    out: Floats,
) -> None:
    """Speed of the air along each path (F, S): a Gauss-Markov step at each firing of the path's emitter.

    `state` (J, S) was reached in `state_slot` (J,). `decay` is the duration of a slot in correlation times.
    """
    for slot in range(len(emitter)):
        j = emitter[slot]
        correlation = math.exp(-decay * (first_slot + slot - state_slot[j]))
        fresh = sd * math.sqrt(1.0 - correlation * correlation)
        state_slot[j] = first_slot + slot
        for s in range(state.shape[1]):
            if np.isnan(state[j, s]):
                state[j, s] = sd * normals[slot, s]
            else:
                state[j, s] = correlation * state[j, s] + fresh * normals[slot, s]
            out[slot, s] = state[j, s]


@compiled
def _path_level(
    source_m: Floats, leaves: Floats, normal: Floats, at_m: Floats, facing: Floats, acoustics: _Acoustics
) -> float:
    """Level of sound that leaves an emitter along `leaves` and arrives from a source [dB]; NaN outside the cone."""
    length = math.sqrt(leaves[0] ** 2 + leaves[1] ** 2 + leaves[2] ** 2)
    emitter_cos = (leaves[0] * normal[0] + leaves[1] * normal[1] + leaves[2] * normal[2]) / length
    if not emitter_cos >= acoustics.cone_cos:
        return np.nan
    distance_m, station_cos = 0.0, 0.0
    for axis in range(3):
        distance_m += (source_m[axis] - at_m[axis]) ** 2
        station_cos += (source_m[axis] - at_m[axis]) * facing[axis]
    distance_m = math.sqrt(distance_m)
    return level_db(distance_m, emitter_cos, station_cos / distance_m, acoustics.absorption_db_per_m)


@compiled
def _direct_sound(paths: _Paths) -> tuple[Floats, Floats]:
    """Time of flight (F, S, 2) and level of the direct sound; NaN where it is not heard, were nothing in its way."""
    emitter, emitter_m, normal, position_m, velocity_m_s, facing, speed_m_s, acoustics = paths
    slots, stations, microphones = len(emitter), position_m.shape[1], position_m.shape[2]
    time_s = np.full((slots, stations, microphones), np.nan)
    level = np.full((slots, stations, microphones), np.nan)
    for slot in range(slots):
        first, end = slot * TICKS_PER_SLOT, (slot + 1) * TICKS_PER_SLOT + 1
        source_m, axis = emitter_m[emitter[slot]], normal[emitter[slot]]
        for s in range(stations):
            for m in range(microphones):
                leaves = position_m[first, s, m] - source_m
                if leaves[0] ** 2 + leaves[1] ** 2 + leaves[2] ** 2 > acoustics.range_m**2:
                    continue
                loud = _path_level(source_m, leaves, axis, position_m[first, s, m], facing[slot, s], acoustics)
                if loud >= acoustics.threshold_db:
                    track_m, track_m_s = position_m[first:end, s, m], velocity_m_s[first:end, s, m]
                    level[slot, s, m] = loud
                    time_s[slot, s, m] = time_of_flight_s(
                        source_m, track_m, track_m_s, acoustics.tick_s, speed_m_s[slot, s]
                    )
    return time_s, level


@compiled
def _reflected_sound(
    planes: Floats, images_m: Floats, direct_s: Floats, paths: _Paths
) -> tuple[Floats, Floats, Floats]:
    """Time (F, S, 2, P), level and point of reflection (F, S, 2, P, 3) of each echo where no direct sound is heard."""
    emitter, emitter_m, normal, position_m, velocity_m_s, facing, speed_m_s, acoustics = paths
    shape = (*direct_s.shape, len(planes))
    time_s, level, bounce_m = np.full(shape, np.nan), np.full(shape, np.nan), np.zeros((*shape, 3))
    for slot in range(shape[0]):
        first, end = slot * TICKS_PER_SLOT, (slot + 1) * TICKS_PER_SLOT + 1
        j = emitter[slot]
        for s in range(shape[1]):
            longest_m = 1.1 * speed_m_s[slot, s] * acoustics.tick_s * TICKS_PER_SLOT
            for m in range(shape[2]):
                if not np.isnan(direct_s[slot, s, m]):
                    continue
                at_m = position_m[first, s, m]
                for plane in range(shape[3]):
                    image_m, bounce = images_m[j, plane], bounce_m[slot, s, m, plane]
                    far = 0.0
                    for axis in range(3):
                        far += (at_m[axis] - image_m[axis]) ** 2
                    if far > longest_m**2 or not reflection_point(planes[plane], image_m, at_m, bounce):
                        continue
                    leaves = bounce - emitter_m[j]
                    loud = acoustics.reflection_db + _path_level(
                        image_m, leaves, normal[j], at_m, facing[slot, s], acoustics
                    )
                    if loud >= acoustics.threshold_db:
                        track_m, track_m_s = position_m[first:end, s, m], velocity_m_s[first:end, s, m]
                        level[slot, s, m, plane] = loud
                        time_s[slot, s, m, plane] = time_of_flight_s(
                            image_m, track_m, track_m_s, acoustics.tick_s, speed_m_s[slot, s]
                        )
    return time_s, level, bounce_m


@compiled
def _first_arrival(reflected_s: Floats, reflected_db: Floats, time_s: Floats, level: Floats) -> None:
    """Where no direct sound is heard, put in the echo that arrives first."""
    slots, stations, microphones, planes = reflected_s.shape
    for slot in range(slots):
        for s in range(stations):
            for m in range(microphones):
                if not np.isnan(time_s[slot, s, m]):
                    continue
                for plane in range(planes):
                    at_s = reflected_s[slot, s, m, plane]
                    if not np.isnan(at_s) and not time_s[slot, s, m] <= at_s:
                        time_s[slot, s, m] = at_s
                        level[slot, s, m] = reflected_db[slot, s, m, plane]


@compiled
def _range_measurements(
    time_s: Floats,
    level: Floats,
    normals: Floats,
    uniforms: Floats,
    burst: Bools,
    assumed_m_s: float,
    errors: tuple[float, float, float, float],
) -> Floats:
    """Measured ranges (F, S, 2) from the times of flight, with noise, wrong cycles and bursts [m]."""
    noise_m, wrong_share, frequency_hz, absorption = errors
    out = np.full(time_s.shape, np.nan)
    for slot in range(time_s.shape[0]):
        for s in range(time_s.shape[1]):
            for m in range(time_s.shape[2]):
                at_s = time_s[slot, s, m]
                if np.isnan(at_s):
                    continue
                chance, moment = uniforms[slot, s, m]
                if burst[slot]:
                    if chance < _EARLY_SHARE:
                        out[slot, s, m] = assumed_m_s * at_s * moment
                    continue
                factor = noise_factor(level[slot, s, m], absorption)
                if chance < wrong_share * factor:
                    at_s += 1.0 / frequency_hz
                out[slot, s, m] = assumed_m_s * at_s + noise_m * factor * normals[slot, s, m]
    return out
