"""Feet that stand where they were put: trajectories of ankle and ball from a plan of plants.

While it is planted a foot first turns about its heel (toes up), then lies flat, then turns about its ball (heel up);
the ball does not move from the moment the foot lies flat until it leaves. Between plants the ball travels smoothly.
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
"""Height of the ankle of a flat foot [m]; the ankles of real clips in stance are at 0.07 to 0.09 ..."""
BALL_M = 0.047
"""... and the balls at 0.03 to 0.05; a flat foot of the body (`body.anatomy`) has its ball at 0.049."""
HEEL_BEHIND_M = 0.045
"""How far the heel's sole lies behind the ankle [m]."""

_CLEARANCE_M = 0.022
"""How high the heel of a walker's swinging foot passes."""


@dataclass(frozen=True)
class FootContact:
    """A foot on the floor."""

    on_s: float
    off_s: float
    ball_m: tuple[float, float]
    """Where the ball stands."""
    yaw_rad: float
    land_rad: float = 0.0
    """How far the toes point up when the heel comes down."""
    push_rad: float = 0.0
    """How far the heel is up when the ball leaves."""
    lift_m: float = 0.05
    """How high the ball is carried to the next plant."""
    lift_peak: float = 0.5
    """Where on that way it is highest, 0.5 at most."""


def flat_pitch_rad(skeleton: Skeleton, side: str) -> float:
    """How far below the horizon the foot bone of a flat foot points."""
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
    """The foot's movement (T,) through its plants, in order of time; it rests on the first before and the last after.

    `heel_up` adds to the pitch and `pivot` to the heading, both about the ball: a boxer's or golfer's rear foot.
    `knee_out_rad` turns the knee outwards of the foot.
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
    """A foot of heel-up `pitch` about the ball (T, 3), or about the heel as far as `heel_first` says."""
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
    at: list[float] = []
    value: list[float] = []
    for k, plant in enumerate(plants):
        stand = plant.off_s - plant.on_s
        if k and plant.land_rad:
            at += [plant.on_s - 0.25 * (plant.on_s - plants[k - 1].off_s), plant.on_s]
            value += [-1.15 * plant.land_rad, -plant.land_rad]
        at += [plant.on_s + (min(0.2 * stand, 0.15) if plant.land_rad else -0.01)]
        value += [0.0]
        if k + 1 < len(plants) and plant.push_rad:
            swing = plants[k + 1].on_s - plant.off_s
            at += [plant.off_s - 0.5 * stand, plant.off_s, plant.off_s + 0.12 * swing]
            value += [0.0, 0.9 * plant.push_rad, plant.push_rad]
        else:
            at += [plant.off_s]
            value += [0.0]
    return at, value
