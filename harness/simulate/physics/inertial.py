"""Inertial sensors: true increments of angle and velocity, and the errors of gyroscopes and accelerometers."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from harness.core.ranges import Range, check_fields

Spread = Annotated[float, Range(0.0, 10.0)]
Time = Annotated[float, Range(1e-2, 1e6)]
Limit = Annotated[float, Range(1.0, 1e6)]


@dataclass(frozen=True)
class InertialErrors:
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

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Gyroscope(InertialErrors):
    """Gyroscopes of the class of an InertiaCube [rad/s]; choices, except for the limit, which is unverified (13.1)."""

    white: Spread = float(np.deg2rad(0.005))
    bias_instability: Spread = float(np.deg2rad(0.003))
    correlation_s: Time = 100.0
    random_walk: Spread = float(np.deg2rad(0.0001))
    turn_on: Spread = float(np.deg2rad(0.02))
    scale: Spread = 1e-3
    misalignment_rad: Spread = 1e-3
    limit: Limit = float(np.deg2rad(1200.0))


@dataclass(frozen=True)
class Accelerometer(InertialErrors):
    """Accelerometers of the class of an InertiaCube [m/s^2]; all numbers are choices."""

    white: Spread = 1e-3
    bias_instability: Spread = 5e-4
    correlation_s: Time = 100.0
    random_walk: Spread = 2e-5
    turn_on: Spread = 0.01
    scale: Spread = 1e-3
    misalignment_rad: Spread = 1e-3
    limit: Limit = 160.0


@dataclass(frozen=True)
class Inertial:
    """The inertial unit of a station."""

    rate_hz: Annotated[float, Range(100.0, 2000.0)] = 400.0
    """Increments per second [choice]."""
    lever_m: Annotated[tuple[float, float, float], Range(-1.0, 1.0)] = (0.0, 0.015, 0.0)
    """Position of the inertial unit in the station's axes [m] [choice]."""
    gyroscope: Gyroscope = field(default_factory=Gyroscope)
    accelerometer: Accelerometer = field(default_factory=Accelerometer)

    def __post_init__(self) -> None:
        check_fields(self)
