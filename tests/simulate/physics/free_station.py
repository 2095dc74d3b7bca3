"""Synthetic truth for tests of the filter: free stations under nine emitters, with exact increments and ranges."""

from dataclasses import dataclass, replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.simulate.physics.constellation import Constellation
from harness.simulate.physics.filter_settings import Fusion, SensorModel
from harness.simulate.physics.filter_state import Outputs
from harness.simulate.physics.fusion import FusionFilter, empty_outputs
from harness.simulate.physics.inertial import Accelerometer, Gyroscope, Inertial, InertialErrors
from harness.simulate.physics.schedule import TICKS_PER_SLOT, Schedule
from harness.simulate.physics.sound import Sound, level_db, noise_factor, speed_of_sound_m_s
from harness.simulate.physics.tracking_status import TRACKING
from harness.simulate.readings import GRAVITY_M_S2
from tests.simulate.physics.rooms import emitters_in_turn

TICK_HZ = 400.0
EMITTER_M: Floats = np.array([[x, y, -2.5] for x in (-1.2, 0.0, 1.2) for y in (-1.2, 0.1, 1.2)])
NORMAL: Floats = np.tile([0.0, 0.0, 1.0], (9, 1))
FACING_UP: Floats = np.array([0.0, 1.0, 0.0, 0.0])
RANGE_NOISE_M = Fusion().range_noise_m


def _matched(errors: InertialErrors) -> SensorModel:
    return SensorModel(errors.white, errors.turn_on, errors.random_walk)


EXACT = Fusion(
    range_scale=0.0,
    survey_m=0.0,
    inertial_scale=0.0,
    gyroscope=_matched(Gyroscope()),
    accelerometer=_matched(Accelerometer()),
)
"""A filter that assumes what `noisy` adds to `exact_inertial`."""


@dataclass(frozen=True, eq=False)
class FreeStation:
    """Motion of one station at the ticks of F slots, and what it measures without noise."""

    position_m: Floats
    """(5 F + 1, 3) of the station's origin."""
    tracker_from_station: Floats
    """(5 F + 1, 4)."""
    velocity_m_s: Floats
    """(5 F + 1, 3) of the station's origin."""
    unit_position_m: Floats
    """(5 F + 1, 3) of the inertial unit."""
    unit_velocity_m_s: Floats
    angle_rad: Floats
    """(5 F, 3) increments."""
    gain_m_s: Floats
    """(5 F, 3) increments."""
    range_m: Floats
    """(F, 2)."""
    sigma_m: Floats
    """(F, 2) standard deviation of a range by the law of `level`, for the default noise."""


def free_station(
    seconds: float, seed: int = 0, *, speed: float = 1.0, sound: Sound | None = None, lever: bool = True
) -> FreeStation:
    """A smooth random motion within some decimetres; at speed 0 a station at rest."""
    sound = sound or Sound()
    rng = generator(seed, "free station")
    slots = round(seconds * TICK_HZ / TICKS_PER_SLOT)
    waves = rng.uniform(0.1, 0.9, (6, 3)), rng.uniform(0.0, 2.0 * np.pi, (6, 3)), rng.normal(0.0, 0.12, (6, 3))
    heading, centre = rng.uniform(-np.pi, np.pi), np.array([*rng.uniform(-0.4, 0.4, 2), -1.1])
    arm = np.array(Inertial().lever_m) if lever else np.zeros(3)

    def place(time_s: Floats) -> tuple[Floats, Floats]:
        phase = 2.0 * np.pi * speed * waves[0] * time_s[:, None, None] + waves[1]
        sway = np.sum(waves[2] * np.sin(phase), axis=2)
        turn = rotations.multiply(rotations.multiply(rotations.about_z(heading), FACING_UP), rotations.exp(sway[:, 3:]))
        return centre + sway[:, :3], turn

    def point(time_s: Floats, offset: Floats) -> Floats:
        position, turn = place(time_s)
        return position + rotations.rotate(turn, offset)

    def velocity(time_s: Floats, offset: Floats) -> Floats:
        h = 1e-3
        near, far = point(time_s + h, offset) - point(time_s - h, offset), point(time_s + 2 * h, offset)
        return (8.0 * near - (far - point(time_s - 2 * h, offset))) / (12.0 * h)

    time_s = np.arange(slots * TICKS_PER_SLOT + 1) / TICK_HZ
    position, turn = place(time_s)
    unit_velocity = velocity(time_s, arm)
    gain = np.diff(unit_velocity, axis=0) - np.array([0.0, 0.0, GRAVITY_M_S2 / TICK_HZ])
    begin = np.arange(slots) * TICKS_PER_SLOT / TICK_HZ
    emitter = EMITTER_M[np.arange(slots) % len(EMITTER_M)]
    distance, sigma = np.zeros((slots, 2)), np.zeros((slots, 2))
    speed_m_s = speed_of_sound_m_s(sound.assumed_c)
    for m, offset in enumerate(np.array(sound.microphones_m)):
        for _ in range(8):
            away = point(begin + distance[:, m] / speed_m_s, offset) - emitter
            distance[:, m] = np.sqrt(np.sum(away**2, axis=1))
        axis = rotations.rotate(place(begin + distance[:, m] / speed_m_s)[1], np.array([0.0, 0.0, 1.0]))
        for f in range(slots):
            cosine = away[f, 2] / distance[f, m]
            facing = -float(np.sum(axis[f] * away[f])) / distance[f, m]
            level = level_db(distance[f, m], cosine, facing, sound.absorption_db_per_m)
            sigma[f, m] = RANGE_NOISE_M * noise_factor(level, sound.absorption_db_per_m)
    return FreeStation(
        position,
        turn,
        velocity(time_s, np.zeros(3)),
        point(time_s, arm),
        unit_velocity,
        rotations.log(rotations.multiply(rotations.inverse(turn[:-1]), turn[1:])),
        rotations.rotate(rotations.inverse(turn[:-1]), gain),
        distance,
        sigma,
    )


def exact_inertial() -> Inertial:
    """Sensors without scale, misalignment, turn-on bias and Gauss-Markov bias: what the filter's model describes."""
    return Inertial(
        gyroscope=Gyroscope(scale=0.0, misalignment_rad=0.0, bias_instability=0.0),
        accelerometer=Accelerometer(scale=0.0, misalignment_rad=0.0, bias_instability=0.0),
    )


def noisy(
    station: FreeStation, seed: int, inertial: Inertial, range_noise_m: float = RANGE_NOISE_M
) -> tuple[FreeStation, Floats]:
    """The station with white noise, a turn-on bias that walks, and noise of ranges; and the biases (5 F + 1, 6)."""
    rng = generator(seed, "noise")
    count, dt = len(station.angle_rad), 1.0 / TICK_HZ
    measured, biases = [], []
    for errors, true in ((inertial.gyroscope, station.angle_rad), (inertial.accelerometer, station.gain_m_s)):
        walk = np.cumsum(errors.random_walk * np.sqrt(dt) * rng.standard_normal((count + 1, 3)), axis=0)
        bias = errors.turn_on * rng.standard_normal(3) + walk
        measured.append(true + bias[:-1] * dt + errors.white * np.sqrt(dt) * rng.standard_normal((count, 3)))
        biases.append(bias)
    noise = station.sigma_m * range_noise_m / RANGE_NOISE_M * rng.standard_normal(station.sigma_m.shape)
    out = replace(station, angle_rad=measured[0], gain_m_s=measured[1], range_m=station.range_m + noise)
    return out, np.concatenate(biases, axis=1)


def new_filter(
    stations: int = 1, *, fusion: Fusion = EXACT, inertial: Inertial | None = None, emitter_m: Floats = EMITTER_M
) -> FusionFilter:
    """A filter of some stations under the nine emitters."""
    names = [f"station {s}" for s in range(stations)]
    schedule = Schedule(TICK_HZ, len(EMITTER_M))
    numbers = np.arange(len(emitter_m))
    constellation = Constellation(numbers, emitter_m, NORMAL, numbers, np.deg2rad(70.0), 4.0)
    microphone_m = np.tile(Sound().microphones_m, (stations, 1, 1))
    return FusionFilter(fusion, Sound(), inertial or Inertial(), constellation, microphone_m, schedule, names)


def records_every(ticks: int, slots: int, stations: int = 1, fraction: float = 0.0) -> Outputs:
    """Empty outputs of records every some ticks of F slots."""
    tick = np.arange(0, slots * TICKS_PER_SLOT, ticks)
    return empty_outputs(np.repeat(tick[:, None], stations, axis=1), np.full((len(tick), stations), fraction))


def run(fusion_filter: FusionFilter, *measured: FreeStation, block: int = 10**6, ticks: int = 10) -> Outputs:
    """Outputs of the filter on the measurements of its stations, from the first slot on."""
    angle = np.stack([station.angle_rad for station in measured], axis=1)
    gain = np.stack([station.gain_m_s for station in measured], axis=1)
    heard = np.stack([station.range_m for station in measured], axis=1)
    outputs = records_every(ticks, len(heard), len(measured))
    for first in range(0, len(heard), block):
        span = slice(first * TICKS_PER_SLOT, (first + block) * TICKS_PER_SLOT)
        part = heard[first : first + block]
        emitter = emitters_in_turn(first, len(part), len(EMITTER_M))
        fusion_filter.filter_block(first, emitter, angle[span], gain[span], part, outputs)
    return outputs


FIRST_SIGMA: Floats = np.repeat([0.005, 0.02, 0.01, *(bias.turn_on for bias in (Gyroscope(), Accelerometer()))], 3)
"""(15,) standard deviations of the error with which `start` begins."""


def start(fusion_filter: FusionFilter, station: FreeStation, error: Floats) -> None:
    """Let the only station track from the truth less an error (15,), with the covariance of `FIRST_SIGMA`."""
    state = fusion_filter.state
    turn = rotations.multiply(rotations.exp(-error[6:9]), station.tracker_from_station[0])
    place = station.unit_position_m[0] - error[:3], station.unit_velocity_m_s[0] - error[3:6]
    state.motion[0, -1] = np.concatenate([*place, turn])
    state.bias[0] = 0.0
    state.covariance[0] = np.diag(FIRST_SIGMA**2)
    state.status[0] = [TRACKING, 0, 0, 0, 0, 0]


def true_error(fusion_filter: FusionFilter, station: FreeStation, biases: Floats, slots: int) -> Floats:
    """(15,) error of the only station's estimate after some slots."""
    motion, tick = fusion_filter.state.motion[0, -1], slots * TICKS_PER_SLOT
    turn = rotations.multiply(station.tracker_from_station[tick], rotations.inverse(motion[6:]))
    return np.concatenate(
        [
            station.unit_position_m[tick] - motion[:3],
            station.unit_velocity_m_s[tick] - motion[3:6],
            rotations.log(turn),
            biases[tick] - fusion_filter.state.bias[0],
        ]
    )
