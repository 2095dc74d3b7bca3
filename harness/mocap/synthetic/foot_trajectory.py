"""Trajectories of the feet from a plan of contacts with the floor; a foot in contact does not slide.

In contact a foot first rotates about its heel (toes up), then lies flat, then rotates about its ball (heel up). The
ball does not move from the moment that the foot lies flat until it leaves. Between contacts the ball moves smoothly.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic.articulated_figure import FootTarget
from harness.mocap.synthetic.curves import interpolate_keys, minimum_jerk, pulse, smooth_trapezoid

ANKLE_M = 0.080
"""Height of the ankle of a flat foot [m]; in stance, ankles of real clips are at 0.07 to 0.09 m."""
BALL_M = 0.047
"""Height of the ball of a flat foot [m]; real clips have 0.03 to 0.05 m, the body (`body.anatomy`) 0.049 m."""
HEEL_BEHIND_M = 0.045
"""Distance of the sole at the heel behind the ankle [m]."""

_CLEARANCE_M = 0.022
"""Height of the heel of a swinging foot in walking [m]."""


@dataclass(frozen=True)
class FootContact:
    """One contact of a foot with the floor, and the swing after it."""

    on_s: float
    off_s: float
    ball_m: tuple[float, float]
    """Position of the ball on the floor [m]."""
    yaw_rad: float
    land_rad: float = 0.0
    """Angle of the toes above the floor when the heel lands [rad]."""
    push_rad: float = 0.0
    """Angle of the heel above the floor when the ball leaves [rad]."""
    lift_m: float = 0.05
    """Greatest height of the ball on the way to the next contact [m]."""
    lift_peak: float = 0.5
    """Share of that way at which the ball is highest, 0.5 at most."""


def flat_pitch_rad(skeleton: Skeleton, side: str) -> float:
    """Angle below the horizon of the foot bone of a flat foot [rad]."""
    return float(np.arcsin((ANKLE_M - BALL_M) / skeleton.length_m[skeleton.index(f"{side}foot")]))


def plan_foot(
    t: Floats,
    skeleton: Skeleton,
    side: str,
    plants: Sequence[FootContact],
    knee_out_rad: float | Floats = 0.0,
    heel_up: Floats | float = 0.0,
    pivot: Floats | float = 0.0,
) -> FootTarget:
    """Target of a foot at times `t` (T,) from its contacts in order of time.

    The foot rests on the first contact before it and on the last one after it. `heel_up` adds to the pitch and `pivot`
    to the heading, both about the ball, as in a boxer's or golfer's rear foot [rad]. `knee_out_rad` is the heading of
    the knee outwards of the foot.
    """
    ball = np.empty((len(t), 3))
    yaw = np.full(len(t), plants[0].yaw_rad)
    pitch = interpolate_keys(t, *_pitch_keyframes(plants)) + heel_up
    heel_first = np.zeros(len(t))
    ball[:] = (*plants[0].ball_m, BALL_M)
    for a, b in pairwise(plants):
        share = (t - a.off_s) / (b.on_s - a.off_s)
        moving = share > 0.0
        now = share[moving]
        way = np.append(np.subtract(b.ball_m, a.ball_m), 0.0)
        # a flat foot is lifted before it moves on and set down after; a heel clears the floor until it lands
        first, last = (0.03, 0.92) if b.land_rad else (0.12, 0.88)
        ball[moving] = (*a.ball_m, BALL_M) + smooth_trapezoid((now - first) / (last - first))[:, None] * way
        ball[moving, 2] += a.lift_m * pulse(now, a.lift_peak)
        if b.land_rad:
            ball[moving, 2] += _CLEARANCE_M * minimum_jerk(now / 0.35) * minimum_jerk((1.0 - now) / 0.35)
        yaw[moving] = a.yaw_rad + (b.yaw_rad - a.yaw_rad) * minimum_jerk((now - first) / (0.85 - first))
        heel_first[moving] = minimum_jerk(now / 0.7) if b.land_rad else 0.0
        heel_first[t > 0.5 * (b.on_s + b.off_s)] = 0.0  # it lies flat there
    return pose_foot(skeleton, side, ball, yaw + pivot, pitch, heel_first, knee_out_rad)


def pose_foot(
    skeleton: Skeleton,
    side: str,
    ball: Floats,
    yaw: Floats,
    pitch: Floats,
    heel_first: Floats | float,
    knee_out_rad: float | Floats = 0.0,
) -> FootTarget:
    """Target of a foot with its ball at `ball` (T, 3) [m], heading `yaw` and heel-up `pitch` (T,) [rad].

    The pitch is about the ball where `heel_first` is 0, and about the heel where it is 1.
    """
    ahead = np.stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    steep = flat_pitch_rad(skeleton, side)
    x = HEEL_BEHIND_M + float(skeleton.length_m[skeleton.index(f"{side}foot")]) * np.cos(steep)
    c, s = np.cos(pitch), np.sin(pitch)
    toe = ball + (heel_first * ((c - 1.0) * x + s * BALL_M))[:, None] * ahead
    toe = toe + (heel_first * ((c - 1.0) * BALL_M - s * x))[:, None] * up
    direction = np.cos(steep + pitch)[:, None] * ahead - np.sin(steep + pitch)[:, None] * up
    out = yaw + knee_out_rad * (1.0 if side == "l" else -1.0)
    return FootTarget(toe, direction, np.stack([np.cos(out), np.sin(out), np.zeros_like(out)], axis=-1))


def _pitch_keyframes(plants: Sequence[FootContact]) -> tuple[list[float], list[float]]:
    """Times [s] and heel-up pitch [rad] of a foot's keyframes."""
    at: list[float] = []
    value: list[float] = []
    for k, plant in enumerate(plants):
        contact_s = plant.off_s - plant.on_s
        if k and plant.land_rad:
            at += [plant.on_s - 0.25 * (plant.on_s - plants[k - 1].off_s), plant.on_s]
            value += [-1.15 * plant.land_rad, -plant.land_rad]
        at += [plant.on_s + (min(0.2 * contact_s, 0.15) if plant.land_rad else -0.01)]
        value += [0.0]
        if k + 1 < len(plants) and plant.push_rad:
            swing = plants[k + 1].on_s - plant.off_s
            at += [plant.off_s - 0.5 * contact_s, plant.off_s, plant.off_s + 0.12 * swing]
            value += [0.0, 0.9 * plant.push_rad, plant.push_rad]
        else:
            at += [plant.off_s]
            value += [0.0]
    return at, value
