"""Feet: which foot steps when in a stance, and trajectories from contacts with the floor, in which no foot slides.

In contact a foot first rotates about its heel (toes up), then lies flat, then rotates about its ball (heel up). The
ball does not move from the moment that the foot lies flat until it leaves. Between contacts the ball moves smoothly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic import limb_ik
from harness.mocap.synthetic.articulated_figure import SIDES, FootTarget
from harness.mocap.synthetic.curves import (
    interpolate_keys,
    minimum_jerk,
    pulse,
    smooth_maximum,
    smooth_minimum,
    smooth_trapezoid,
)

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


@dataclass(frozen=True)
class FootPlacement:
    """Position of a foot relative to the body's place on the floor, and its heading relative to the body's."""

    ahead_m: float
    left_m: float
    yaw_rad: float


@dataclass(frozen=True)
class StanceShift:
    """A move of the body to another place and heading, one foot after the other."""

    at_s: float
    place_m: tuple[float, float]
    yaw_rad: float
    step_s: float = 0.26
    gap_s: float = 0.05
    lift_m: float = 0.035


def plan_steps(
    rng: np.random.Generator,
    stance: Mapping[str, FootPlacement],
    start: StanceShift,
    shifts: Sequence[StanceShift],
    end_s: float,
) -> dict[str, list[FootContact]]:
    """Contacts of both feet; the foot on the side of the move steps first. Shifts must not overlap in time."""
    placed: dict[str, tuple[float, tuple[float, float], float]] = {}
    plants: dict[str, list[FootContact]] = {side: [] for side in SIDES}
    for side in SIDES:
        placed[side] = (start.at_s - 10.0, *_place_foot(rng, stance[side], start))
    before = start
    for shift in shifts:
        move = np.subtract(shift.place_m, before.place_m)
        c, s = np.cos(shift.yaw_rad), np.sin(shift.yaw_rad)
        ahead, left = float(move[0] * c + move[1] * s), float(move[1] * c - move[0] * s)
        order = sorted(SIDES, key=lambda side: -(stance[side].ahead_m * ahead + stance[side].left_m * left))
        for n, side in enumerate(order):
            on_s, ball, yaw = placed[side]
            off_s = shift.at_s + n * (shift.step_s + shift.gap_s)
            plants[side].append(FootContact(on_s, off_s, ball, yaw, 0.0, 0.30, shift.lift_m * rng.uniform(0.8, 1.2)))
            placed[side] = (off_s + shift.step_s, *_place_foot(rng, stance[side], shift))
        before = shift
    for side in SIDES:
        on_s, ball, yaw = placed[side]
        plants[side].append(FootContact(on_s, max(end_s, on_s) + 10.0, ball, yaw))
    return plants


def _place_foot(rng: np.random.Generator, stance: FootPlacement, at: StanceShift) -> tuple[tuple[float, float], float]:
    c, s = np.cos(at.yaw_rad), np.sin(at.yaw_rad)
    ahead, left = stance.ahead_m + rng.normal(0.0, 0.015), stance.left_m + rng.normal(0.0, 0.015)
    ball = (at.place_m[0] + c * ahead - s * left, at.place_m[1] + s * ahead + c * left)
    return ball, at.yaw_rad + stance.yaw_rad + rng.normal(0.0, 0.03)


def plan_body_path(t: Floats, start: StanceShift, shifts: Sequence[StanceShift]) -> tuple[Floats, Floats]:
    """Place (T, 2) [m] and heading (T,) [rad] of the body, which moves smoothly while the feet step."""
    place = np.tile(np.array(start.place_m), (len(t), 1))
    yaw = np.full(len(t), start.yaw_rad)
    before = start
    for shift in shifts:
        duration_s = 2.0 * shift.step_s + shift.gap_s
        share = minimum_jerk((t - shift.at_s + 0.08) / (duration_s + 0.12))
        place += share[:, None] * np.subtract(shift.place_m, before.place_m)
        yaw += share * (shift.yaw_rad - before.yaw_rad)
        before = shift
    return place, yaw


def leg_length_m(skeleton: Skeleton) -> float:
    """Length of thigh and shank together [m]."""
    return float(sum(skeleton.length_m[skeleton.index(bone)] for bone in ("lfemur", "ltibia")))


def highest_root_m(
    skeleton: Skeleton, place_m: Floats, pelvis: Floats, feet: Mapping[str, FootTarget], straightest: float
) -> Floats:
    """(T,) greatest height of the root over `place_m` (T, 2) at which no leg exceeds `straightest` of its length [m].

    `pelvis` (T, 3) is the pelvis's yaw, pitch and roll [rad]; `feet` are the targets of both feet.
    """
    rotation = limb_ik.yaw_pitch_roll_rotation(pelvis)
    height = np.full(len(place_m), np.inf)
    length = straightest * leg_length_m(skeleton)
    for side in SIDES:
        hip = rotation @ skeleton.bone_m[skeleton.index(f"{side}hipjoint")]
        ankle = feet[side].toe_m - float(skeleton.length_m[skeleton.index(f"{side}foot")]) * feet[side].direction
        flat = np.sum((place_m + hip[:, :2] - ankle[:, :2]) ** 2, axis=1)
        # where the foot is out of reach, the square root gets a small positive argument; plans avoid this
        top = ankle[:, 2] + np.sqrt(smooth_maximum(length**2 - flat, np.array(0.15), 0.05)) - hip[:, 2]
        height = top if np.isinf(height[0]) else smooth_minimum(height, top, 0.02)
    return height
