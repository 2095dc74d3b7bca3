"""Prediction of poses, which the device computes with the setting `Mp` (docs/is900.md 4.2)."""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints

MAX_PREDICTION_MS = 50
"""Largest setting [ms]."""


def predict_poses(
    position_m: Floats,
    tracker_from_station: Floats,
    velocity_m_s: Floats,
    turn_rad_s: Floats,
    prediction_ms: Ints,
) -> tuple[Floats, Floats]:
    """Return positions (..., S, 3) and quaternions (..., S, 4) this many milliseconds (S,) ahead.

    Velocity and turn rate (..., S, 3) are in the tracker's axes and stay constant meanwhile [m/s, rad/s]. Stations with
    0 ms are returned to the bit, and results do not depend on the leading shape.
    """
    ahead_s = 1e-3 * np.asarray(prediction_ms, dtype=float)[:, None]
    moves = ahead_s > 0.0
    turned = rotations.multiply(rotations.exp(turn_rad_s * ahead_s), tracker_from_station)
    return (
        np.where(moves, position_m + velocity_m_s * ahead_s, position_m),
        np.where(moves, turned, tracker_from_station),
    )
