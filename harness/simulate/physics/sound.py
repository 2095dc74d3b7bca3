"""Ultrasonic ranges: level, time of flight and the errors of its measurement."""

import math
from dataclasses import dataclass
from typing import Annotated

from harness.core.ranges import Range, check_fields
from harness.errors import BadInput

MICROPHONES = 2
"""Number of microphones of a station (docs/is900.md 7)."""
Point = Annotated[tuple[float, float, float], Range(-1.0, 1.0)]


@dataclass(frozen=True)
class Sound:
    """Speed and level of sound, the microphones of a station, and the errors of a range."""

    temperature_c: Annotated[float, Range(-40.0, 60.0)] = 20.0
    """Mean temperature of the air [deg C] [choice]."""
    temperature_sd_c: Annotated[float, Range(0.0, 20.0)] = 0.6
    """Standard deviation of the temperature between sessions [K]: a scale error of 0.1 % (docs/is900.md 13.5)."""
    assumed_c: Annotated[float, Range(-40.0, 60.0)] = 20.0
    """Temperature for which the device computes the speed of sound [deg C] [choice]."""
    range_noise_m: Annotated[float, Range(0.0, 1.0)] = 0.002
    """Standard deviation of a range at 2 m on the axis of emitter and microphone [m]. It grows as the amplitude falls,
    to about 4 mm in the mean. Chosen because the position at rest then varies by about the published 1.5 mm
    (docs/is900.md 13.1)."""
    wrong_cycle_share: Annotated[float, Range(0.0, 1.0)] = 0.01
    """Share of ranges at 2 m on the axis that are one wavelength too long (docs/is900.md 13.3); it grows likewise
    [choice]."""
    frequency_hz: Annotated[float, Range(1e3, 1e6)] = 40e3
    """Frequency (docs/is900.md 13.1)."""
    absorption_db_per_m: Annotated[float, Range(0.0, 100.0)] = 1.3
    """Absorption of the air at 40 kHz, 20 deg C and 50 % humidity [dB/m] (ISO 9613-1)."""
    air_speed_sd_m_s: Annotated[float, Range(0.0, 20.0)] = 0.05
    """Standard deviation of the air's speed along each path [m/s] [choice]."""
    air_correlation_s: Annotated[float, Range(1e-2, 1e6)] = 5.0
    """Time after which the correlation of that speed is 1/e [s] [choice]."""
    bursts_per_min: Annotated[float, Range(0.0, 600.0)] = 2.0
    """Mean number of bursts of noise in the band, such as jingling keys (docs/is900.md 13.3) [choice]."""
    burst_s: Annotated[tuple[float, float], Range(0.0, 60.0, ascending=True)] = (0.02, 0.1)
    """Shortest and longest burst [s] [choice]."""
    microphones_m: tuple[Point, ...] = ((0.0, 0.03, 0.01), (0.0, -0.03, 0.01))
    """Positions of the two microphones in the station's axes [m]. The manual has two (docs/is900.md 7). They lie across
    the bone, so that the ranges fix the heading of a station on an upright bone [choice]."""

    def __post_init__(self) -> None:
        check_fields(self)
        if len(self.microphones_m) != MICROPHONES:
            raise BadInput(
                f"sound.microphones_m has {len(self.microphones_m)} positions.", f"A station has {MICROPHONES}."
            )


def speed_of_sound_m_s(temperature_c: float) -> float:
    """Speed of sound in dry air at a temperature [deg C]: 331.3 m/s at 0 deg C, as the root of the absolute one."""
    return 331.3 * math.sqrt(1.0 + temperature_c / 273.15)
