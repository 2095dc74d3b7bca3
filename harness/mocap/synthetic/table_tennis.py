"""Table tennis: a low ready stance, strokes that start from the hips, and side steps between them.

Distances are relative to the top of the chest, facing the table; `bat` is the arm that holds the bat, `in` is the
direction towards the other arm. In a rally a ball is played every 1.1 to 1.6 s.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic import footwork
from harness.mocap.synthetic.articulated_figure import SIDE_SIGN, ArticulatedFigure
from harness.mocap.synthetic.curves import Gesture, Keyframes, smooth_minimum, smooth_noise, sum_gestures
from harness.mocap.synthetic.limb_ik import horizontal_vector, stack_columns
from harness.mocap.synthetic.performers import Habits, sample_posture_offsets

_FOREHAND: Mapping[str, Keyframes] = {
    "ahead": [(0.0, 0.0), (0.34, -0.30), (0.52, 0.14), (0.64, 0.16), (1.05, 0.0)],
    "in": [(0.0, 0.0), (0.34, -0.22), (0.52, 0.08), (0.66, 0.30), (1.05, 0.0)],
    "up": [(0.0, 0.0), (0.34, -0.12), (0.52, 0.10), (0.66, 0.26), (1.05, 0.0)],
    "elbow": [(0.0, 0.0), (0.34, 0.40), (0.6, 0.55), (1.05, 0.0)],
    "pronate": [(0.0, 0.0), (0.34, -0.25), (0.62, 0.55), (1.05, 0.0)],
    "lay": [(0.0, 0.0), (0.36, 0.30), (0.54, -0.15), (1.05, 0.0)],
    "twist": [(0.0, 0.0), (0.32, -0.50), (0.58, 0.38), (1.05, 0.0)],
    "pelvis": [(0.0, 0.0), (0.30, -0.55), (0.55, 0.32), (1.05, 0.0)],
    "side": [(0.0, 0.0), (0.30, -0.08), (0.56, 0.06), (1.05, 0.0)],
    "dip": [(0.0, 0.0), (0.30, 0.05), (0.56, -0.02), (1.05, 0.0)],
    "lean": [(0.0, 0.0), (0.30, -0.10), (0.56, 0.06), (1.05, 0.0)],
    "reach": [(0.0, 0.0), (0.32, -0.10), (0.60, 0.12), (1.05, 0.0)],
    "free ahead": [(0.0, 0.0), (0.32, 0.06), (0.58, -0.10), (1.05, 0.0)],
    "free out": [(0.0, 0.0), (0.32, 0.05), (0.58, 0.10), (1.05, 0.0)],
}
_BACKHAND: Mapping[str, Keyframes] = {
    "ahead": [(0.0, 0.0), (0.30, -0.10), (0.46, 0.20), (0.54, 0.20), (0.92, 0.0)],
    "in": [(0.0, 0.0), (0.30, 0.24), (0.46, 0.10), (0.58, -0.10), (0.92, 0.0)],
    "up": [(0.0, 0.0), (0.30, -0.08), (0.46, 0.08), (0.58, 0.16), (0.92, 0.0)],
    "elbow": [(0.0, 0.0), (0.30, 0.75), (0.5, 0.55), (0.92, 0.0)],
    "pronate": [(0.0, 0.0), (0.30, 0.55), (0.52, -0.45), (0.92, 0.0)],
    "lay": [(0.0, 0.0), (0.30, -0.35), (0.5, 0.30), (0.92, 0.0)],
    "twist": [(0.0, 0.0), (0.28, 0.24), (0.50, -0.14), (0.92, 0.0)],
    "pelvis": [(0.0, 0.0), (0.28, 0.14), (0.50, -0.08), (0.92, 0.0)],
    "bend": [(0.0, 0.0), (0.28, 0.10), (0.50, -0.05), (0.92, 0.0)],
    "dip": [(0.0, 0.0), (0.28, 0.03), (0.50, -0.02), (0.92, 0.0)],
    "reach": [(0.0, 0.0), (0.30, 0.06), (0.48, 0.10), (0.92, 0.0)],
    "free out": [(0.0, 0.0), (0.30, -0.03), (0.50, 0.06), (0.92, 0.0)],
}
_SMASH: Mapping[str, Keyframes] = {
    **_FOREHAND,
    "ahead": [(0.0, 0.0), (0.38, -0.28), (0.54, 0.24), (0.66, 0.20), (1.1, 0.0)],
    "up": [(0.0, 0.0), (0.38, 0.28), (0.54, 0.14), (0.70, -0.10), (1.1, 0.0)],
    "elbow": [(0.0, 0.0), (0.36, 0.95), (0.6, 0.6), (1.1, 0.0)],
    "dip": [(0.0, 0.0), (0.36, -0.05), (0.60, 0.05), (1.1, 0.0)],
}
_PUSH: Mapping[str, Keyframes] = {
    "ahead": [(0.0, 0.0), (0.28, -0.07), (0.52, 0.26), (0.9, 0.0)],
    "in": [(0.0, 0.0), (0.28, 0.14), (0.52, 0.10), (0.9, 0.0)],
    "up": [(0.0, 0.0), (0.28, 0.08), (0.52, -0.08), (0.9, 0.0)],
    "pronate": [(0.0, 0.0), (0.28, 0.10), (0.52, -0.50), (0.9, 0.0)],
    "lay": [(0.0, 0.0), (0.28, 0.15), (0.52, 0.25), (0.9, 0.0)],
    "bend": [(0.0, 0.0), (0.46, 0.14), (0.9, 0.0)],
    "forward": [(0.0, 0.0), (0.46, 0.07), (0.9, 0.0)],
    "twist": [(0.0, 0.0), (0.5, 0.12), (0.9, 0.0)],
    "reach": [(0.0, 0.0), (0.5, 0.12), (0.9, 0.0)],
}
_STROKES = (_FOREHAND, _BACKHAND, _SMASH, _PUSH)
_STROKE_FREQUENCIES = (
    (0.6, 0.3, 0.0, 0.1),
    (0.2, 0.6, 0.0, 0.2),
    (0.45, 0.4, 0.1, 0.05),
    (0.35, 0.2, 0.35, 0.1),
    (0.3, 0.3, 0.0, 0.4),
)
"""Relative frequency of each stroke, by kind of take."""


_BETWEEN_RALLIES: Mapping[str, Keyframes] = {
    "rest": [(0.0, 0.0), (0.6, 1.0), (1.5, 0.95), (2.2, 0.0)],
    "bend": [(0.0, 0.0), (0.6, -0.26), (1.5, -0.24), (2.2, 0.0)],
    "dip": [(0.0, 0.0), (0.6, -0.09), (1.5, -0.09), (2.2, 0.0)],
}
"""Upright stance with low hands between rallies."""
_SERVE: Mapping[str, Keyframes] = {
    "free ahead": [(0.0, 0.0), (0.5, 0.05), (0.9, 0.08), (1.5, 0.0)],
    "free up": [(0.0, 0.0), (0.5, -0.06), (0.85, 0.30), (1.05, 0.24), (1.5, 0.0)],
    "ahead": [(0.0, 0.0), (0.5, -0.02), (0.85, -0.26), (1.08, 0.16), (1.5, 0.0)],
    "in": [(0.0, 0.0), (0.5, 0.14), (0.85, -0.16), (1.08, 0.16), (1.5, 0.0)],
    "up": [(0.0, 0.0), (0.85, 0.16), (1.08, -0.04), (1.5, 0.0)],
    "elbow": [(0.0, 0.0), (0.85, 0.6), (1.5, 0.0)],
    "lay": [(0.0, 0.0), (0.85, 0.3), (1.08, -0.3), (1.5, 0.0)],
    "twist": [(0.0, 0.0), (0.8, -0.36), (1.1, 0.26), (1.5, 0.0)],
    "pelvis": [(0.0, 0.0), (0.8, -0.25), (1.1, 0.15), (1.5, 0.0)],
    "bend": [(0.0, 0.0), (0.6, 0.14), (1.5, 0.0)],
    "look": [(0.0, 0.0), (0.5, -0.15), (0.9, -0.40), (1.1, 0.0)],
}


def synthesize(skeleton: Skeleton, habits: Habits, rng: np.random.Generator, t: Floats, take: int) -> ArticulatedFigure:
    """Generate one take at times `t` (T,) [s]: rallies of several strokes, each started with a serve."""
    bat, style = habits.hand, habits.style
    free = "l" if bat == "r" else "r"
    s = SIDE_SIGN[free]  # the side of the bat has the sign -s
    leg = footwork.leg_length_m(skeleton)
    size, slow = habits.size * float(rng.uniform(0.95, 1.15)), float(rng.uniform(0.92, 1.12)) / habits.pace
    crouch = style.crouch + float(rng.uniform(0.06, 0.13))

    start, shifts, strokes = _plan_rallies(rng, t, size, slow, _STROKE_FREQUENCIES[take % len(_STROKE_FREQUENCIES)], -s)
    stance = {
        bat: footwork.FootPlacement(-0.06 * leg, -s * 0.34 * leg * style.width, -s * 0.30),
        free: footwork.FootPlacement(0.12 * leg, s * 0.34 * leg * style.width, s * 0.18),
    }
    place, facing = footwork.plan_body_path(t, start, shifts)
    plants = footwork.plan_steps(rng, stance, start, shifts, float(t[-1]))
    act = sum_gestures(t, strokes)
    bounce = 2.0 * np.pi * np.cumsum((t[1] - t[0]) * (1.5 + smooth_noise(rng, t, 3.0, 0.12)))
    knees_out = 0.10 + style.knees_out_rad
    feet = {
        side: footwork.plan_foot(t, skeleton, side, plants[side], knees_out, 0.10 + 0.03 * np.sin(bounce))
        for side in (bat, free)
    }
    breath = np.sin(2.0 * np.pi * t * rng.uniform(0.35, 0.5) + rng.uniform(0.0, 6.0))
    pelvis = stack_columns(
        facing + s * (act["pelvis"] - 0.12) + smooth_noise(rng, t, 1.8, 0.03),
        habits.pelvis_rad + 0.14 + crouch + 0.5 * act["bend"] + smooth_noise(rng, t, 2.0, 0.02),
        s * 0.3 * act["lean"] + smooth_noise(rng, t, 2.0, 0.02),
    )
    spine = stack_columns(
        habits.bend_rad + 0.20 + 1.2 * crouch + act["bend"] + 0.01 * breath + smooth_noise(rng, t, 2.0, 0.02),
        s * (act["twist"] - 0.05) + smooth_noise(rng, t, 1.8, 0.03),
        -s * 0.7 * act["lean"] + smooth_noise(rng, t, 2.0, 0.02),
    )
    gaze = stack_columns(
        facing + s * 0.25 * act["twist"] + smooth_noise(rng, t, 1.2, 0.09),
        0.24 + style.nod_rad + 0.2 * act["bend"] + act["look"] + smooth_noise(rng, t, 1.2, 0.04),
        smooth_noise(rng, t, 2.0, 0.03),
    )
    ahead = -0.06 * leg - 0.05 + act["forward"] + 0.012 * np.sin(bounce) + smooth_noise(rng, t, 1.8, 0.01)
    place = place + horizontal_vector(facing, ahead, s * act["side"] + smooth_noise(rng, t, 1.8, 0.012))
    top = footwork.highest_root_m(skeleton, place, pelvis, feet, 0.975)
    height = np.median(top) - crouch * leg - act["dip"] + 0.010 * np.sin(bounce) + smooth_noise(rng, t, 2.0, 0.006)
    root = stack_columns(*place.T, smooth_minimum(top, height, 0.03))
    lift, reach = style.shoulder_rad
    shoulders = {
        bat: (lift + 0.02 + 0.01 * breath, reach + 0.06 + act["reach"] + smooth_noise(rng, t, 1.5, 0.012)),
        free: (lift + 0.02 + 0.01 * breath, reach + 0.05 + 0.3 * act["free ahead"] + smooth_noise(rng, t, 1.5, 0.012)),
    }
    figure = ArticulatedFigure(skeleton, root, pelvis, spine, gaze, shoulders, sample_posture_offsets(rng, t, habits))
    low = act["rest"]
    wrists = {
        bat: (0.30 + act["ahead"] - 0.08 * low, 0.26 - act["in"] - 0.02 * low, -0.30 + act["up"] - 0.14 * low),
        free: (
            0.30 + act["free ahead"] - 0.10 * low,
            0.20 + act["free out"],
            -0.22 + 0.3 * act["free out"] + act["free up"] - 0.18 * low,
        ),
    }
    forearm = {
        bat: (act["elbow"], act["pronate"], act["lay"]),
        free: (0.6 * act["free out"], 0.2 * act["free out"] - 2.0 * act["free up"], 0.0 * t),
    }
    heading = {bat: facing, free: facing + 0.75 * s * (act["pelvis"] + act["twist"])}
    for side in (bat, free):
        figure.pose_leg(side, feet[side])
        held = [x + more for x, more in zip(wrists[side], style.guard_m, strict=True)]
        _pose_arm(figure, side, rng, t, heading[side], held, forearm[side])
    return figure


def _pose_arm(
    figure: ArticulatedFigure,
    side: str,
    rng: np.random.Generator,
    t: Floats,
    facing: Floats,
    wrist_m: Sequence[Floats],
    forearm: tuple[Floats, Floats, Floats],
) -> None:
    """Pose one arm: `wrist_m` is ahead, out and up of the chest for an arm of 0.58 m [m].

    `forearm` is the raise of the elbow, the pronation and the extension of the wrist [rad].
    """
    sign, reach = SIDE_SIGN[side], figure.arm_m(side) / 0.58
    ahead, out, up = (x + rng.normal(0.0, 0.02) + smooth_noise(rng, t, 1.4, 0.018) for x in wrist_m)
    elbow, pronate, lay = forearm
    raised = 0.35 + elbow + float(rng.normal(0.0, 0.08)) + smooth_noise(rng, t, 1.6, 0.05)
    figure.pose_reaching_arm(
        side,
        figure.point_near_chest_m(facing, reach * ahead, sign * reach * out, reach * up),
        stack_columns(*horizontal_vector(facing, -0.45, sign * np.sin(raised)).T, -np.cos(raised)),
        -0.25 + pronate + smooth_noise(rng, t, 1.4, 0.05),
        (-0.12 - lay, 0.05 + 0.4 * lay),
    )


def _plan_rallies(
    rng: np.random.Generator, t: Floats, size: float, slow: float, style: tuple[float, ...], bat_side: float
) -> tuple[footwork.StanceShift, list[footwork.StanceShift], list[Gesture]]:
    """Start, side steps and strokes of a take; balls come to the forehand or the backhand corner."""
    yaw = float(rng.uniform(-np.pi, np.pi))
    start = footwork.StanceShift(0.0, (0.0, 0.0), yaw)
    shifts: list[footwork.StanceShift] = []
    strokes: list[Gesture] = []
    left_in_rally = int(rng.integers(2, 7))
    now = float(t[0]) - rng.uniform(0.0, 0.8)
    aside, ahead, busy_s = 0.0, 0.0, float(t[0])
    while now < t[-1]:
        parts = _STROKES[int(rng.choice(len(_STROKES), p=style))]
        corner = {id(_BACKHAND): -0.22, id(_PUSH): -0.05}.get(id(parts), 0.22)
        wanted = bat_side * (corner + rng.normal(0.0, 0.14))
        deep = rng.normal(0.08 if parts is _PUSH else -0.03, 0.06)
        stroke = Gesture(now, parts).vary(rng, size, slow)
        strokes.append(stroke)
        step_s = rng.uniform(0.19, 0.25) * slow
        if abs(wanted - aside) > 0.12 and now - 0.15 > busy_s:
            heading = yaw + rng.normal(0.0, 0.06) - 0.25 * wanted
            c, d = np.cos(yaw), np.sin(yaw)
            move = float(np.clip(wanted - aside, -0.28, 0.28))
            aside, ahead = aside + move, float(np.clip(0.5 * ahead + deep, -0.25, 0.25))
            step_s *= 0.75 + 1.3 * abs(move)
            spot = (float(c * ahead - d * aside), float(d * ahead + c * aside))
            shifts.append(footwork.StanceShift(now - 0.15, spot, heading, step_s, rng.uniform(0.0, 0.05), 0.025))
            busy_s = now - 0.15 + 2.0 * step_s + 0.15
        now += rng.uniform(0.95, 1.35) * slow
        left_in_rally -= 1
        if left_in_rally <= 0:
            strokes += [
                Gesture(now, _BETWEEN_RALLIES).vary(rng, 1.0, slow),
                Gesture(now + 2.0 * slow, _SERVE).vary(rng, size, slow),
            ]
            now += 3.3 * slow
            left_in_rally = int(rng.integers(3, 8))
    return start, shifts, strokes
