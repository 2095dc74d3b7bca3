"""The level of sound at a microphone, and the noise of a range at that level; the filter assumes the same law.

A level is in dB relative to 1 m on the axes of emitter and microphone.
"""

import math

from harness.core.compiled import compiled

NOISE_AT_M = 2.0
"""Distance on the axes for which the noise of a range is specified [m]."""
_LEAST_NOISE, _LARGEST_NOISE = 0.5, 4.0
"""Limits of the factor on the noise of a range [choice]."""
_LEAST_AMPLITUDE = 1e-6


@compiled
def level_db(distance_m: float, cos_emitter: float, cos_station: float, absorption_db_per_m: float) -> float:
    """Level after a distance [dB]; the cosines are of the angles from the emitter's normal and the station's z.

    The amplitude falls with distance, with absorption in the air [dB/m], with the cosine at the emitter, and at the
    microphone with half of one plus the cosine (a choice).
    """
    amplitude = max(cos_emitter, _LEAST_AMPLITUDE) * max(0.5 + 0.5 * cos_station, _LEAST_AMPLITUDE)
    return 20.0 * math.log10(amplitude / max(distance_m, _LEAST_AMPLITUDE)) - absorption_db_per_m * (distance_m - 1.0)


@compiled
def threshold_db(range_m: float, cone_rad: float, absorption_db_per_m: float) -> float:
    """Lowest level that is heard [dB]: at the largest range, at the cone's edge, with the microphone facing it."""
    return level_db(range_m, math.cos(cone_rad), 1.0, absorption_db_per_m)


@compiled
def noise_factor(level: float, absorption_db_per_m: float) -> float:
    """Noise of a range at a level [dB], relative to that at 2 m on the axes: the inverse amplitude, from 0.5 to 4."""
    reference_db = level_db(NOISE_AT_M, 1.0, 1.0, absorption_db_per_m)
    factor: float = 10.0 ** ((reference_db - level) / 20.0)
    return min(max(factor, _LEAST_NOISE), _LARGEST_NOISE)
