"""Footwork in a stance: which foot steps when, as the body moves from place to place."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic import limb_ik
from harness.mocap.synthetic.articulated_figure import SIDES, FootTarget
from harness.mocap.synthetic.curves import minimum_jerk, smooth_maximum, smooth_minimum
from harness.mocap.synthetic.foot_trajectory import FootContact


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
