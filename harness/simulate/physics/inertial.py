"""Inertial sensors: true increments of angle and velocity, and the errors of gyroscopes and accelerometers."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import as_tuple, quaternion_product, rotate, rotation_vector
from harness.core.ranges import CheckedFields, Range
from harness.core.seeds import generator
from harness.simulate.physics.motion import TrackerMotion
from harness.simulate.readings import GRAVITY_M_S2

Spread = Annotated[float, Range(0.0, 10.0)]
Time = Annotated[float, Range(1e-2, 1e6)]
Limit = Annotated[float, Range(1.0, 1e6)]


@dataclass(frozen=True)
class InertialErrors(CheckedFields):
    """Errors of three gyroscopes or three accelerometers; x stands for rad or m/s."""

    white: Spread
    """Angle or velocity random walk [x/sqrt(s)]."""
    bias_instability: Spread
    """Standard deviation of a first-order Gauss-Markov bias [x/s]."""
    correlation_s: Time
    """Time after which the correlation of that bias is 1/e [s]."""
    random_walk: Spread
    """Random walk of the bias [x/s/sqrt(s)]."""
    turn_on: Spread
    """Standard deviation of the constant bias of a session [x/s]."""
    scale: Spread
    """Standard deviation of each axis's scale error, for a session."""
    misalignment_rad: Spread
    """Standard deviation of each axis's angles to the station's axes, for a session [rad]."""
    limit: Limit
    """Largest measured value on each axis [x/s]."""


@dataclass(frozen=True)
class Gyroscope(InertialErrors):
    """Gyroscopes of the class of an InertiaCube [rad/s].

    White noise and misalignment are those of an orientation tracker with the same limit (XS: 0.1 deg/s per root hertz,
    0.1 deg). The limit is unverified (docs/is900.md 13.1). The others are choices.
    """

    white: Spread = float(np.deg2rad(0.07))
    bias_instability: Spread = float(np.deg2rad(0.003))
    correlation_s: Time = 100.0
    random_walk: Spread = float(np.deg2rad(0.0001))
    turn_on: Spread = float(np.deg2rad(0.02))
    scale: Spread = 0.02
    misalignment_rad: Spread = float(np.deg2rad(0.1))
    limit: Limit = float(np.deg2rad(1200.0))


@dataclass(frozen=True)
class Accelerometer(InertialErrors):
    """Accelerometers of the class of an InertiaCube [m/s^2].

    White noise and misalignment are those of an orientation tracker with about the same limit (XS: 0.004 m/s^2 per root
    hertz, 0.1 deg). The turn-on bias makes the published tilt (docs/is900.md 13.1): 2.5 mg, as much as an accelerometer
    of 0.5 mg/K (AD) gains in 5 K. The others are choices.
    """

    white: Spread = 0.0028
    bias_instability: Spread = 5e-4
    correlation_s: Time = 100.0
    random_walk: Spread = 2e-5
    turn_on: Spread = 0.025
    scale: Spread = 3e-3
    misalignment_rad: Spread = float(np.deg2rad(0.1))
    limit: Limit = 160.0


@dataclass(frozen=True)
class Inertial(CheckedFields):
    """The inertial unit of a station."""

    rate_hz: Annotated[float, Range(100.0, 2000.0)] = 400.0
    """Increments per second [choice]."""
    lever_m: Annotated[tuple[float, float, float], Range(-1.0, 1.0)] = (0.0, 0.015, 0.0)
    """Position of the inertial unit in the station's axes [m] [choice]."""
    gyroscope: Gyroscope = field(default_factory=Gyroscope)
    accelerometer: Accelerometer = field(default_factory=Accelerometer)


def true_increments(motion: TrackerMotion, lever_m: Floats) -> tuple[Floats, Floats]:
    """Increments of angle [rad] and velocity [m/s] of inertial units between the ticks of a block, (T, S, 3) each.

    The units are at `lever_m` (3,) in the station's axes [m]. Increments are in the station's axes at the interval's
    beginning: the rotation vector to its end, and the integral of the specific force. They are exact, since they come
    from the motion at the ticks: no coning or sculling is left in them.
    """
    _, velocity_m_s = motion.points(lever_m)
    turn, shape = motion.tracker_from_station, (len(motion.time_s) - 1, *velocity_m_s.shape[1:])
    angle_rad, gain_m_s = np.empty(shape), np.empty(shape)
    _increments(motion.time_s, turn, velocity_m_s, angle_rad, gain_m_s)
    return angle_rad, gain_m_s


@compiled
def _increments(time_s: Floats, turn: Floats, velocity_m_s: Floats, angle_rad: Floats, gain_m_s: Floats) -> None:
    for k in range(len(time_s) - 1):
        fall_m_s = GRAVITY_M_S2 * (time_s[k + 1] - time_s[k])
        for s in range(turn.shape[1]):
            w, x, y, z = as_tuple(turn[k, s])
            station_from_tracker = (w, -x, -y, -z)
            change = rotation_vector(quaternion_product(station_from_tracker, as_tuple(turn[k + 1, s])))
            gain = rotate(
                station_from_tracker,
                velocity_m_s[k + 1, s, 0] - velocity_m_s[k, s, 0],
                velocity_m_s[k + 1, s, 1] - velocity_m_s[k, s, 1],
                velocity_m_s[k + 1, s, 2] - velocity_m_s[k, s, 2] - fall_m_s,
            )
            for i in range(3):
                angle_rad[k, s, i], gain_m_s[k, s, i] = change[i], gain[i]


class InertialUnit:
    """Gyroscopes and accelerometers of S stations. It carries state: `measure` takes block after block.

    Each station has its own draws. Scale, misalignment and turn-on bias are constant for a session.
    """

    def __init__(self, settings: Inertial, stations: Sequence[str], *, seed: int, take: str, session: str = "") -> None:
        self._triads = (settings.gyroscope, settings.accelerometer)
        self._step_s = 1.0 / settings.rate_hz
        self._rng = [generator(seed, "physics", take, "inertial", station) for station in stations]
        shape = (2, len(stations), 3)
        self._matrix, self._turn_on, self._bias = np.empty((*shape, 3)), np.empty(shape), np.zeros((2, *shape))
        for s, station in enumerate(stations):
            session_rng = generator(seed, "physics", session or take, "inertial", station, "session")
            for triad, errors in enumerate(self._triads):
                self._turn_on[triad, s] = errors.turn_on * session_rng.standard_normal(3)
                scale = 1.0 + errors.scale * session_rng.standard_normal(3)
                axes = np.eye(3) + errors.misalignment_rad * session_rng.standard_normal((3, 3)) * (1.0 - np.eye(3))
                length = np.sqrt(np.sum(axes**2, axis=1, keepdims=True))
                self._matrix[triad, s] = scale[:, None] * axes / length
                self._bias[0, triad, s] = errors.bias_instability * self._rng[s].standard_normal(3)

    def measure_increments(self, angle_rad: Floats, velocity_m_s: Floats) -> tuple[Floats, Floats]:
        """Measured increments for true ones, (T, S, 3) each [rad], [m/s]."""
        out = np.empty_like(angle_rad), np.empty_like(velocity_m_s)
        for s, rng in enumerate(self._rng):
            draws = rng.standard_normal((len(angle_rad), 2, 3, 3))
            for triad, (errors, true) in enumerate(zip(self._triads, (angle_rad, velocity_m_s), strict=True)):
                _sensor_increments(
                    true[:, s],
                    draws[:, triad],
                    self._matrix[triad, s],
                    self._turn_on[triad, s],
                    self._bias[:, triad, s],
                    (errors.white, errors.bias_instability, errors.correlation_s, errors.random_walk, errors.limit),
                    self._step_s,
                    out[triad][:, s],
                )
        return out


@compiled
def _sensor_increments(
    true: Floats,
    draws: Floats,
    matrix: Floats,
    turn_on: Floats,
    bias: Floats,
    errors: tuple[float, float, float, float, float],
    step_s: float,
    out: Floats,
) -> None:
    """Increments (T, 3) of one triad of sensors, from draws (T, 3 sources, 3); `bias` (2, 3) is its state."""
    white, instability, correlation_s, random_walk, limit = errors
    kept = math.exp(-step_s / correlation_s)
    fresh = instability * math.sqrt(-math.expm1(-2.0 * step_s / correlation_s))
    root = math.sqrt(step_s)
    for a in range(3):
        wander, walk = bias[0, a], bias[1, a]
        for k in range(len(true)):
            wander = kept * wander + fresh * draws[k, 1, a]
            walk += random_walk * root * draws[k, 2, a]
            value = matrix[a, 0] * true[k, 0] + matrix[a, 1] * true[k, 1] + matrix[a, 2] * true[k, 2]
            value += (turn_on[a] + wander + walk) * step_s + white * root * draws[k, 0, a]
            out[k, a] = min(max(value, -limit * step_s), limit * step_s)
        bias[0, a], bias[1, a] = wander, walk
