"""The table `[physics.fusion]` of a scenario: what the filter of a station assumes."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from harness.core.ranges import CheckedFields, Name, Range

Spread = Annotated[float, Range(0.0, 10.0)]


@dataclass(frozen=True)
class SensorModel(CheckedFields):
    """What the filter assumes of three gyroscopes or three accelerometers; x stands for rad or m/s."""

    noise: Spread
    """Angle or velocity random walk [x/sqrt(s)]."""
    bias: Spread
    """Standard deviation of the bias at switch-on [x/s]."""
    bias_walk: Spread
    """Random walk of the bias [x/s/sqrt(s)]."""


GYROSCOPE = SensorModel(*(float(deg) for deg in np.deg2rad([0.9, 0.02, 4e-4])))
ACCELEROMETER = SensorModel(noise=0.0028, bias=0.03, bias_walk=7e-5)


@dataclass(frozen=True)
class Fusion(CheckedFields):
    """What the device's filter assumes, when it gives a station up, and the settings of each station."""

    gate: Annotated[float, Range(0.5, 100.0)] = 4.0
    """Largest innovation of an accepted range, in its standard deviations. InterSense's header gives a factor of 4
    (docs/is900.md 13.2)."""
    range_noise_m: Annotated[float, Range(0.0, 1.0)] = 0.00075
    """Assumed standard deviation of a range at 2 m on the axis [m]; it grows with distance and angle as in `sound`. The
    value is that of `sound` [choice]."""
    range_scale: Annotated[float, Range(0.0, 0.1)] = 0.002
    """Assumed standard deviation of the scale of a range, from temperature and air [choice]."""
    survey_m: Annotated[float, Range(0.0, 1.0)] = 0.001
    """Assumed standard deviation of an emitter's position [m] [choice]."""
    gyroscope: SensorModel = GYROSCOPE
    """Its noise is 13 times that of the sensors. A filter that expects as much corrects the attitude at once, and its
    jumps are the published resolution of 0.75 mm and 0.05 deg (docs/is900.md 13.2) [choice]."""
    accelerometer: SensorModel = ACCELEROMETER
    """Its noise is that of the sensors, its bias a little more [choice]."""
    inertial_scale: Annotated[float, Range(0.0, 0.1)] = 0.003
    """Assumed standard deviation of scale and misalignment of the inertial sensors [choice]."""
    sigma_limit_m: Annotated[float, Range(1e-3, 10.0)] = 0.03
    """Standard deviation of the position beyond which the station is suspect and has quality 0 [m] [choice]."""
    reject_share: Annotated[float, Range(0.0, 1.0)] = 0.6
    """Share of rejected ranges in a second beyond which the station is lost; late ones do not count while the others
    fit [choice]."""
    coast_s: Annotated[float, Range(0.05, 60.0)] = 1.5
    """Longest time without an accepted range before the station is lost [s] [choice]."""
    quality_sigma_m: Annotated[float, Range(1e-5, 1.0)] = 0.003
    """Standard deviation of the position up to which the quality is 1 [m] [choice]."""
    warm_up_s: Annotated[float, Range(0.5, 600.0)] = 3.0
    """Time that the device runs before a take while the performer stands in its first pose [s] [choice]."""
    prediction_ms: dict[Name, Annotated[int, Range(0, 50)]] = field(default_factory=dict)
    """Station -> prediction (`Mp`) [ms]; 0 for the others (docs/is900.md 4.2)."""
    enhancement: dict[Name, Annotated[int, Range(0, 2)]] = field(default_factory=dict)
    """Station -> perceptual enhancement (`MF`); 0 for the others (docs/is900.md 4.2)."""
