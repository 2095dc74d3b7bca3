"""Ground frames and station features of a single pose, compiled for use in every frame.

A ground frame is x, y [m] and heading [rad]; `solver.ground_frame` has the functions for many poses.
"""

import numpy as np

from harness.core.arrays import Floats, Singles
from harness.core.compiled import compiled


@compiled
def step_ground(ground: Floats, step: Floats) -> Floats:
    """Ground frame (3,) after a step (3,): forward, left [m] and rotation [rad]."""
    cosine, sine = np.cos(ground[2]), np.sin(ground[2])
    forward, left, turn = step[0], step[1], step[2]
    x, y = ground[0] + cosine * forward - sine * left, ground[1] + sine * forward + cosine * left
    return np.array([x, y, ground[2] + turn])


@compiled
def ground_after_step(qpos: Floats, step: Floats) -> Floats:
    """Ground frame (3,) after a step (3,) from that of a configuration (55,)."""
    return step_ground(np.array([qpos[0], qpos[1], 2.0 * np.arctan2(qpos[6], qpos[3])]), step)


@compiled
def features_from_readings(position_m: Floats, turned: Floats, ground: Floats, lever_m: float) -> Singles:
    """(9 S,) `station_features` of positions (S, 3) and orientations (S, 4), relative to a ground frame (3,)."""
    cosine, sine = np.cos(ground[2]), np.sin(ground[2])
    out = np.empty((len(position_m), 9), np.float32)
    for k in range(len(position_m)):
        x, y = position_m[k, 0] - ground[0], position_m[k, 1] - ground[1]
        out[k, 0], out[k, 1] = cosine * x + sine * y, cosine * y - sine * x
        out[k, 2] = position_m[k, 2]
        a, b, c, d = turned[k, 0], turned[k, 1], turned[k, 2], turned[k, 3]
        forward = 1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)
        left = 2.0 * (b * c - a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d + a * b)
        out[k, 3], out[k, 4] = (
            lever_m * (cosine * forward[0] + sine * forward[1]),
            lever_m * (cosine * left[0] + sine * left[1]),
        )
        out[k, 5], out[k, 6] = (
            lever_m * (cosine * forward[1] - sine * forward[0]),
            lever_m * (cosine * left[1] - sine * left[0]),
        )
        out[k, 7], out[k, 8] = lever_m * forward[2], lever_m * left[2]
    return out.reshape(-1)
