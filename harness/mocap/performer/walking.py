"""Walking: footsteps laid along a path, a pelvis that rides over them, arms that swing against the legs.

Timing and amplitudes after Perry, Gait Analysis (1992): stance 62 % of the cycle, pelvis turn and list of about 5 deg,
steps that grow and quicken with speed.
"""

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.performer.curves import ease, smaller, smoothed, wander
from harness.mocap.performer.feet import Plant, foot
from harness.mocap.performer.footwork import highest_root_m
from harness.mocap.performer.figure import LEFT, SIDES, Figure
from harness.mocap.performer.performers import Habits

STANCE = 0.62
"""Share of the gait cycle that a foot is on the floor."""
_PAD_S = 3.0
_TURNS = ("round the room", "to and fro", "square left", "square right", "figure of eight", "wandering")


def move(skeleton: Skeleton, habits: Habits, rng: np.random.Generator, t: Floats, take: int) -> Figure:
    """One take along one of six kinds of path."""
    step_s = t[1] - t[0]
    pad = int(_PAD_S / step_s)
    long = (np.arange(len(t) + 2 * pad) - pad) * step_s
    speed, heading = _course(rng, long, habits, _TURNS[(take - 1 + int(rng.integers(2))) % len(_TURNS)])
    path = np.stack([np.cos(heading), np.sin(heading)], axis=-1) * speed[:, None]
    path = np.concatenate([np.zeros((1, 2)), np.cumsum(0.5 * (path[1:] + path[:-1]) * step_s, axis=0)])
    path -= 0.5 * (path.min(axis=0) + path.max(axis=0))
    # cadence: step length grows as speed to the power 0.55
    rhythm = (
        1.88 * habits.pace * rng.uniform(0.97, 1.03) * (speed / 1.3) ** 0.45 * (1.0 + wander(rng, long, 1.5, 0.012))
    )
    phase = np.concatenate([[0.0], np.cumsum(0.5 * (rhythm[1:] + rhythm[:-1]) * step_s)]) + rng.uniform(0.0, 2.0)

    def at(phases: Floats, curve: Floats) -> Floats:
        out: Floats = np.interp(phases, phase, curve)
        return out

    effort = np.clip(speed.mean() / 1.3, 0.6, 1.4)
    width = rng.uniform(0.045, 0.075)
    land, push, lift = rng.uniform(0.28, 0.40) * effort**0.5, rng.uniform(0.90, 1.05), rng.uniform(0.04, 0.07)
    plants: dict[str, list[Plant]] = {"l": [], "r": []}
    ahead = float(skeleton.length_m[skeleton.index("lfoot")]) * 0.92
    for k in range(int(np.ceil(phase[0])), int(phase[-1] - 2 * STANCE)):
        side = SIDES[k % 2]
        yaw = float(at(np.array(k + 0.62), heading))
        where = np.array([at(np.array(k + 0.53), path[:, 0]), at(np.array(k + 0.53), path[:, 1])])
        out = yaw + LEFT[side] * habits.toes_out_rad + rng.normal(0.0, 0.02)
        aside = LEFT[side] * (width + rng.normal(0.0, 0.006))
        where = (
            where
            + aside * np.array([-np.sin(yaw), np.cos(yaw)])
            + rng.normal(0.0, 0.008) * np.array([np.cos(yaw), np.sin(yaw)])
        )
        where = where + ahead * np.array([np.cos(out), np.sin(out)])
        plants[side].append(
            Plant(
                float(at(np.array(float(k)), long)),
                float(at(np.array(k + 2.0 * STANCE), long)),
                (float(where[0]), float(where[1])),
                float(out),
                land * rng.uniform(0.92, 1.08),
                push * rng.uniform(0.95, 1.05),
                lift * rng.uniform(0.9, 1.1),
                0.6,
            )
        )
    feet = {side: foot(t, skeleton, side, plants[side], 0.03) for side in SIDES}

    inside = slice(pad, pad + len(t))
    turn = np.pi * phase[inside]  # a step is pi
    yaw, pace = heading[inside], speed[inside]
    lean_in = np.clip(np.gradient(yaw, step_s) * pace / 9.81, -0.3, 0.3)
    swing = rng.uniform(0.85, 1.15) * habits.size * effort
    pelvis = np.stack(
        [
            yaw - 0.085 * effort * np.cos(turn + 0.15) + wander(rng, t, 2.5, 0.012),
            habits.pelvis_rad + 0.05 + 0.012 * np.cos(2.0 * turn - 0.8) + wander(rng, t, 3.0, 0.008),
            0.055 * np.cos(turn - 0.4 * np.pi) - 0.5 * lean_in + wander(rng, t, 3.0, 0.008),
        ],
        axis=-1,
    )
    sway = rng.uniform(0.016, 0.026) * np.cos(turn - 0.6 * np.pi)
    aside = np.stack([-np.sin(yaw), np.cos(yaw)], axis=-1) * (sway + wander(rng, t, 2.0, 0.004))[:, None]
    root = np.concatenate(
        [path[inside] + aside - 0.03 * np.stack([np.cos(yaw), np.sin(yaw)], -1), np.full((len(t), 1), 2.0)], axis=1
    )
    breath = np.sin(2.0 * np.pi * t * rng.uniform(0.25, 0.33) + rng.uniform(0.0, 6.0))
    spine = np.stack(
        [
            habits.bend_rad
            + 0.02 * effort
            + 0.02 * np.cos(2.0 * turn + 0.6)
            + 0.008 * breath
            + wander(rng, t, 4.0, 0.012),
            0.15 * swing * np.cos(turn) + wander(rng, t, 3.0, 0.015),
            -0.065 * np.cos(turn - 0.4 * np.pi) + 0.2 * lean_in + wander(rng, t, 3.0, 0.012),
        ],
        axis=-1,
    )
    ahead_s = np.interp(t + 0.35, long, heading)
    gaze = np.stack(
        [
            yaw + np.clip(1.1 * (ahead_s - yaw), -0.7, 0.7) + wander(rng, t, 2.5, 0.05),
            0.06 + rng.uniform(-0.04, 0.08) + wander(rng, t, 2.5, 0.03),
            -0.15 * lean_in + wander(rng, t, 3.0, 0.012),
        ],
        axis=-1,
    )
    forward = {"l": -np.cos(turn - 0.1), "r": np.cos(turn - 0.1)}
    shoulders = {s: (0.02 * breath + wander(rng, t, 3.0, 0.01), 0.04 * swing * forward[s]) for s in SIDES}
    top = highest_root_m(skeleton, root[:, :2], pelvis, feet, 0.994)
    root[:, 2] = smaller(top, smoothed(top, 1.2 / step_s) - 0.012, 0.04)
    figure = Figure(skeleton, root, pelvis, spine, gaze, shoulders)
    for side in SIDES:
        figure.leg(side, feet[side])
        s = forward[side]
        own = rng.uniform(0.9, 1.1)
        figure.hang(
            side,
            0.30 * swing * own * s - 0.08 + wander(rng, t, 2.5, 0.03),
            habits.spread_rad + 0.02 * s + wander(rng, t, 2.5, 0.02),
            0.25 + 0.08 * s + wander(rng, t, 2.5, 0.03),
            0.42 + 0.20 * swing * s + 0.05 * s**2 + wander(rng, t, 2.0, 0.03),
            0.05 + 0.08 * s + wander(rng, t, 2.0, 0.04),
            (-0.22 + 0.08 * s + wander(rng, t, 1.5, 0.03), wander(rng, t, 1.5, 0.03)),
        )
    return figure


def _course(rng: np.random.Generator, t: Floats, habits: Habits, kind: str) -> tuple[Floats, Floats]:
    """Speed [m/s] and heading [rad] over time."""
    usual = rng.uniform(0.95, 1.6)
    heading = np.full(len(t), rng.uniform(-np.pi, np.pi)) + wander(rng, t, 4.0, 0.05)
    slow = np.zeros(len(t))
    start = t[0]
    way = 1.0 if rng.random() < 0.5 else -1.0
    while start < t[-1]:
        angle, lasts_s, straight_s, way = _next_turn(rng, kind, way, usual)
        share = (t - start - straight_s) / lasts_s
        heading += angle * ease(share)
        sharp = min(abs(angle) / lasts_s / 1.6, 1.0)
        slow = np.maximum(slow, sharp * ease(1.0 - np.abs(2.0 * (share - 0.5)) / 1.8))
        start += straight_s + lasts_s
    speed = usual * (1.0 + wander(rng, t, 3.0, 0.02))
    return speed + (np.minimum(speed, 0.92) - speed) * slow, heading


def _next_turn(rng: np.random.Generator, kind: str, way: float, usual: float) -> tuple[float, float, float, float]:
    """Angle [rad], time it takes [s], straight time before it [s], and the side of the turn after it."""
    if kind == "round the room":
        return way * 2.0 * np.pi, 2.0 * np.pi * rng.uniform(1.5, 2.3) / usual, 0.01, way
    if kind == "to and fro":
        return way * np.pi, rng.uniform(2.6, 3.2), rng.uniform(2.5, 4.5), -way
    if kind == "square left":
        return 0.5 * np.pi, rng.uniform(1.3, 1.7), rng.uniform(1.8, 3.2), way
    if kind == "square right":
        return -0.5 * np.pi, rng.uniform(1.3, 1.7), rng.uniform(1.8, 3.2), way
    if kind == "figure of eight":
        return way * 1.6 * np.pi, 1.6 * np.pi * rng.uniform(1.4, 1.9) / usual, rng.uniform(1.0, 1.8), -way
    return way * rng.uniform(0.4, 1.8), rng.uniform(1.2, 2.2), rng.uniform(0.5, 2.5), float(rng.choice([-1.0, 1.0]))
