"""What the device knows about ranges: its emitters, its microphones and the noise that it expects."""

from typing import NamedTuple

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.simulate.physics.level import level_db, noise_factor


class RangingModel(NamedTuple):
    """Constants of all stations, in the tracker's frame."""

    emitter_m: Floats
    """(J, 3) positions."""
    normal: Floats
    """(J, 3) unit vectors along which the emitters send."""
    arm_m: Floats
    """(M, 3) positions of the microphones from the inertial unit, in the station's axes."""
    speed_m_s: float
    """Assumed speed of sound."""
    absorption_db_per_m: float
    range_noise_m: float
    """Standard deviation of a range at 2 m on the axes."""
    range_scale: float
    """Standard deviation of the scale of a range."""
    survey_m: float
    """Standard deviation of an emitter's position."""


@compiled
def range_variance(
    model: RangingModel, emitter: int, distance_m: float, x: float, y: float, z: float, cos_station: float
) -> float:
    """Variance of a range [m^2] at a distance, in the direction (x, y, z) from the emitter to the microphone.

    `cos_station` is the cosine of the angle between the station's z axis and the direction to the emitter.
    """
    normal = model.normal[emitter]
    cos_emitter = normal[0] * x + normal[1] * y + normal[2] * z
    level = level_db(distance_m, cos_emitter, cos_station, model.absorption_db_per_m)
    noise = model.range_noise_m * noise_factor(level, model.absorption_db_per_m)
    return noise * noise + (model.range_scale * distance_m) ** 2 + model.survey_m**2
