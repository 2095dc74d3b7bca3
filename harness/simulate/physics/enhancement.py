"""Perceptual enhancement (`MF`): corrections of the filter are spread over time instead of made at once.

A correction moves the filter's estimate. The output keeps its place, because the opposite of the correction is added to
an offset, which then decays. Mode 1 lets it decay all the time, and mode 2 only while the station moves
(docs/is900.md 4.2 and 13.3). The rates are choices.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import quaternion_from_vector, quaternion_product, rotation_vector

MODES = 3
"""Mode 0 has no offset."""
_DECAY_S = 0.25
_DECAY_M = 0.1
_DECAY_RAD = 0.5
_SLOWEST_S = 0.05


@compiled
def add_to_offset(offset: Floats, moved: Floats, x: float, y: float, z: float) -> None:
    """Add the opposite of a correction to an offset (6,): metres, then a rotation vector [rad] in the tracker's axes.

    `moved` (3,) is how far the station's origin moved [m], (x, y, z) the rotation vector of the turn.
    """
    for i in range(3):
        offset[i] -= moved[i]
    q = quaternion_product(quaternion_from_vector(offset[3], offset[4], offset[5]), quaternion_from_vector(-x, -y, -z))
    offset[3], offset[4], offset[5] = rotation_vector(q)


@compiled
def decay(offsets: Floats, duration_s: float, speed_m_s: float, turn_rad_s: float) -> None:
    """Let the offsets (2, 6) of modes 1 and 2 decay."""
    for mode in range(2):
        rate = 1.0 / _DECAY_S if mode == 0 else min(speed_m_s / _DECAY_M + turn_rad_s / _DECAY_RAD, 1.0 / _SLOWEST_S)
        factor = np.exp(-rate * duration_s)
        for i in range(6):
            offsets[mode, i] *= factor
