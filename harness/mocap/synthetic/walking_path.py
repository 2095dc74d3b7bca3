"""Walking paths: speed and heading over time, within a room."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.mocap.synthetic.curves import minimum_jerk, smooth_noise

PATH_KINDS = ("round the room", "to and fro", "square left", "square right", "figure of eight", "wandering")
_USUAL_SPEED_M_S = 1.25
_TURNING_SPEED_M_S = 0.92
"""Speed in a sharp turn."""


@dataclass(frozen=True, eq=False)
class WalkingPath:
    """A path over T frames."""

    place_m: Floats
    """(T, 2) position on the floor [m]."""
    yaw_rad: Floats
    """(T,) heading [rad]."""
    speed_m_s: Floats
    """(T,) [m/s]."""


def sample_walking_path(
    rng: np.random.Generator, t: Floats, take: int, speed_factor: float = 1.0, variety: float = 1.0
) -> WalkingPath:
    """A random path at times `t` (T,) [s], centred on the origin; the take's number and chance decide its kind.

    `speed_factor` scales the speed, and `variety` the take's deviation from a usual speed.
    """
    kind = PATH_KINDS[(take - 1 + int(rng.integers(2))) % len(PATH_KINDS)]
    speed_m_s = rng.uniform(0.95, 1.6)
    speed_m_s = speed_factor * (speed_m_s + (variety - 1.0) * (speed_m_s - _USUAL_SPEED_M_S))
    yaw = rng.uniform(-np.pi, np.pi) + smooth_noise(rng, t, 4.0, 0.05)
    slow = np.zeros(len(t))
    start_s = float(t[0])
    side = 1.0 if rng.random() < 0.5 else -1.0
    while start_s < t[-1]:
        angle, turn_s, straight_s, side = _sample_turn(rng, kind, side, speed_m_s)
        share = (t - start_s - straight_s) / turn_s
        yaw += angle * minimum_jerk(share)
        sharp = min(abs(angle) / turn_s / 1.6, 1.0)
        slow = 1.0 - (1.0 - slow) * (
            1.0 - sharp * minimum_jerk((share + 0.4) / 0.7) * minimum_jerk((1.4 - share) / 0.7)
        )
        start_s += straight_s + turn_s
    speed = speed_m_s * (1.0 + smooth_noise(rng, t, 3.0, 0.02))
    speed += (min(_TURNING_SPEED_M_S, speed_m_s) - speed) * slow
    velocity = np.stack([np.cos(yaw), np.sin(yaw)], axis=-1) * speed[:, None]
    place = np.concatenate([np.zeros((1, 2)), np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * (t[1] - t[0]), axis=0)])
    return WalkingPath(place - 0.5 * (place.min(axis=0) + place.max(axis=0)), yaw, speed)


def _sample_turn(
    rng: np.random.Generator, kind: str, side: float, speed_m_s: float
) -> tuple[float, float, float, float]:
    """Angle of a turn [rad], its duration [s], that of the straight before it [s], and the side of the next turn."""
    if kind == "round the room":
        return side * 2.0 * np.pi, 2.0 * np.pi * rng.uniform(1.5, 2.3) / speed_m_s, 0.01, side
    if kind == "to and fro":
        return side * np.pi, rng.uniform(2.6, 3.2), rng.uniform(2.5, 4.5), -side
    if kind in ("square left", "square right"):
        left = 1.0 if kind == "square left" else -1.0
        return left * 0.5 * np.pi, rng.uniform(1.3, 1.7), rng.uniform(1.8, 3.2), side
    if kind == "figure of eight":
        return side * 1.6 * np.pi, 1.6 * np.pi * rng.uniform(1.4, 1.9) / speed_m_s, rng.uniform(1.0, 1.8), -side
    return side * rng.uniform(0.4, 1.8), rng.uniform(1.4, 2.2), rng.uniform(0.5, 2.5), float(rng.choice([-1.0, 1.0]))
