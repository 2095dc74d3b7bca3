"""Shadow boxing: footwork in a bladed stance, a guard, and combinations of punches driven by legs and trunk.

Distances are relative to the top of the chest, facing the opponent; `lead` is the arm and foot in front.
"""

from collections.abc import Mapping

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic import footwork
from harness.mocap.synthetic.articulated_figure import SIDE_SIGN, ArticulatedFigure
from harness.mocap.synthetic.curves import Gesture, Keyframes, smooth_minimum, smooth_noise, sum_gestures
from harness.mocap.synthetic.limb_ik import horizontal_vector, stack_columns
from harness.mocap.synthetic.performers import Habits, sample_posture_offsets


def _out_and_back(value: float, wind_up: float = 0.0) -> Keyframes:
    """Keyframes of a punch: a short wind-up, `value` at the hit, and back to 0."""
    hit_s = 0.24
    return [(0.0, 0.0), (0.3 * hit_s, -wind_up * value), (hit_s, value), (hit_s + 0.05, 0.97 * value), (0.58, 0.0)]


_JAB: Mapping[str, Keyframes] = {
    "lead.ahead": _out_and_back(0.34, 0.06),
    "lead.in": _out_and_back(0.09),
    "lead.up": _out_and_back(0.07),
    "lead.pronate": _out_and_back(1.0),
    "lead.elbow": _out_and_back(0.35),
    "lead.reach": _out_and_back(0.16),
    "twist": _out_and_back(-0.26, 0.15),
    "pelvis": _out_and_back(-0.08, 0.1),
    "ahead": _out_and_back(0.05, 0.1),
    "bend": _out_and_back(0.04),
}
_CROSS: Mapping[str, Keyframes] = {
    "rear.ahead": _out_and_back(0.46, 0.06),
    "rear.in": _out_and_back(0.12),
    "rear.up": _out_and_back(0.03),
    "rear.pronate": _out_and_back(1.0),
    "rear.elbow": _out_and_back(0.4),
    "rear.reach": _out_and_back(0.16),
    "lead.ahead": _out_and_back(-0.06),
    "twist": _out_and_back(0.55, 0.12),
    "pelvis": _out_and_back(0.66, 0.08),
    "ahead": _out_and_back(0.07, 0.1),
    "bend": _out_and_back(0.10),
    "heel": _out_and_back(0.35),
    "pivot": _out_and_back(0.45),
}
_LEAD_HOOK: Mapping[str, Keyframes] = {
    "lead.ahead": [(0.0, 0.0), (0.14, -0.02), (0.28, 0.14), (0.36, 0.08), (0.64, 0.0)],
    "lead.in": [(0.0, 0.0), (0.14, -0.20), (0.28, 0.16), (0.36, 0.22), (0.64, 0.0)],
    "lead.up": [(0.0, 0.0), (0.14, -0.06), (0.28, 0.05), (0.36, 0.03), (0.64, 0.0)],
    "lead.elbow": [(0.0, 0.0), (0.2, 1.25), (0.32, 1.3), (0.64, 0.0)],
    "lead.pronate": [(0.0, 0.0), (0.24, 0.35), (0.34, 0.35), (0.64, 0.0)],
    "twist": [(0.0, 0.0), (0.13, 0.22), (0.30, -0.42), (0.66, 0.0)],
    "pelvis": [(0.0, 0.0), (0.12, 0.15), (0.28, -0.32), (0.66, 0.0)],
    "side": [(0.0, 0.0), (0.13, 0.04), (0.32, -0.04), (0.66, 0.0)],
}
_UPPERCUT: Mapping[str, Keyframes] = {
    "rear.ahead": [(0.0, 0.0), (0.18, 0.04), (0.34, 0.26), (0.40, 0.24), (0.70, 0.0)],
    "rear.up": [(0.0, 0.0), (0.18, -0.30), (0.34, 0.02), (0.40, 0.07), (0.70, 0.0)],
    "rear.in": [(0.0, 0.0), (0.18, -0.05), (0.34, 0.12), (0.40, 0.12), (0.70, 0.0)],
    "rear.pronate": [(0.0, 0.0), (0.2, -0.9), (0.36, -0.9), (0.70, 0.0)],
    "twist": [(0.0, 0.0), (0.16, -0.18), (0.35, 0.36), (0.72, 0.0)],
    "pelvis": [(0.0, 0.0), (0.16, -0.12), (0.33, 0.38), (0.72, 0.0)],
    "dip": [(0.0, 0.0), (0.16, 0.07), (0.34, -0.01), (0.72, 0.0)],
    "lean": [(0.0, 0.0), (0.16, 0.12), (0.36, -0.04), (0.72, 0.0)],
    "heel": [(0.0, 0.0), (0.34, 0.25), (0.72, 0.0)],
    "pivot": [(0.0, 0.0), (0.34, 0.30), (0.72, 0.0)],
}
_BODY_JAB: Mapping[str, Keyframes] = {
    **_JAB,
    "lead.up": _out_and_back(-0.16),
    "dip": _out_and_back(0.10),
    "bend": _out_and_back(0.16),
}
_SLIP: Mapping[str, Keyframes] = {
    "lean": [(0.0, 0.0), (0.25, 0.26), (0.55, 0.0)],
    "side": [(0.0, 0.0), (0.25, -0.09), (0.55, 0.0)],
    "twist": [(0.0, 0.0), (0.25, 0.15), (0.55, 0.0)],
    "dip": [(0.0, 0.0), (0.25, 0.05), (0.55, 0.0)],
}
_ROLL: Mapping[str, Keyframes] = {
    "side": [(0.0, 0.0), (0.22, -0.09), (0.62, 0.10), (0.95, 0.0)],
    "lean": [(0.0, 0.0), (0.22, 0.20), (0.62, -0.20), (0.95, 0.0)],
    "dip": [(0.0, 0.0), (0.38, 0.17), (0.52, 0.16), (0.95, 0.0)],
    "bend": [(0.0, 0.0), (0.40, 0.18), (0.95, 0.0)],
}
_COMBINATIONS: tuple[tuple[Mapping[str, Keyframes], ...], ...] = (
    (_JAB,),
    (_JAB, _JAB),
    (_JAB, _CROSS),
    (_JAB, _CROSS, _LEAD_HOOK),
    (_LEAD_HOOK, _CROSS),
    (_JAB, _UPPERCUT),
    (_BODY_JAB, _CROSS),
    (_UPPERCUT, _LEAD_HOOK),
    (_SLIP, _CROSS),
    (_ROLL, _LEAD_HOOK),
    (_ROLL,),
)


_GUARD_DOWN: Mapping[str, Keyframes] = {
    "drop": [(0.0, 0.0), (0.5, 1.0), (1.8, 0.95), (2.4, 0.0)],
    "pelvis": [(0.0, 0.0), (0.5, 0.25), (1.8, 0.22), (2.4, 0.0)],
    "dip": [(0.0, 0.0), (0.5, -0.04), (1.8, -0.04), (2.4, 0.0)],
    "bend": [(0.0, 0.0), (0.5, -0.10), (1.8, -0.10), (2.4, 0.0)],
}
"""A pause with the guard down, on the toes."""


def synthesize(skeleton: Skeleton, habits: Habits, rng: np.random.Generator, t: Floats, take: int) -> ArticulatedFigure:
    """Generate one take at times `t` (T,) [s]; its random frequencies of combinations depend on the take."""
    rear, style = habits.hand, habits.style
    lead = "l" if rear == "r" else "r"
    s = SIDE_SIGN[lead]
    size, slow = habits.size * float(rng.uniform(0.93, 1.08)), float(rng.uniform(0.80, 1.0)) / habits.pace
    leg = footwork.leg_length_m(skeleton)
    bladed, crouch = float(rng.uniform(0.45, 0.80)), style.crouch + float(rng.uniform(0.04, 0.09))

    stance = {
        lead: footwork.FootPlacement(0.27 * leg * style.width, s * 0.15 * leg * style.width, -s * 0.30),
        rear: footwork.FootPlacement(-0.24 * leg * style.width, -s * 0.16 * leg * style.width, -s * 0.95),
    }
    start, shifts = _plan_footwork(rng, t, slow)
    place, facing = footwork.plan_body_path(t, start, shifts)
    plants = footwork.plan_steps(rng, stance, start, shifts, float(t[-1]))
    act = sum_gestures(t, _plan_combinations(rng, t, size, slow, take))

    bounce = 2.0 * np.pi * np.cumsum((t[1] - t[0]) * (1.9 + smooth_noise(rng, t, 3.0, 0.15)))
    ahead = act["ahead"] + 0.02 * np.sin(0.5 * bounce) + smooth_noise(rng, t, 1.8, 0.012)
    place = place + horizontal_vector(facing, ahead, s * (act["side"] + smooth_noise(rng, t, 1.6, 0.015)))
    heel = 0.32 + 0.04 * np.sin(bounce) + act["heel"]
    feet = {
        lead: footwork.plan_foot(
            t, skeleton, lead, plants[lead], 0.05 + style.knees_out_rad, 0.03 + 0.03 * np.sin(bounce)
        ),
        rear: footwork.plan_foot(t, skeleton, rear, plants[rear], 0.05 + style.knees_out_rad, heel, s * act["pivot"]),
    }
    breath = np.sin(2.0 * np.pi * t * rng.uniform(0.4, 0.55) + rng.uniform(0.0, 6.0))
    pelvis = stack_columns(
        facing - s * (bladed - act["pelvis"]) + smooth_noise(rng, t, 1.6, 0.05),
        habits.pelvis_rad + 0.10 + 0.3 * act["bend"] + smooth_noise(rng, t, 2.0, 0.02),
        s * 0.35 * act["lean"] + smooth_noise(rng, t, 2.0, 0.02),
    )
    spine = stack_columns(
        habits.bend_rad + 0.12 + 1.2 * crouch + act["bend"] + 0.01 * breath + smooth_noise(rng, t, 2.0, 0.025),
        s * (0.16 + act["twist"]) + smooth_noise(rng, t, 1.6, 0.03),
        s * 0.65 * act["lean"] + smooth_noise(rng, t, 2.0, 0.025),
    )
    gaze = stack_columns(
        facing - s * (0.06 - 0.15 * act["twist"]) + smooth_noise(rng, t, 2.0, 0.05),
        0.18 + style.nod_rad + smooth_noise(rng, t, 2.0, 0.03),
        s * 0.4 * act["lean"] + smooth_noise(rng, t, 2.0, 0.03),
    )
    top = footwork.highest_root_m(skeleton, place, pelvis, feet, 0.975)
    height = np.median(top) - crouch * leg + 0.010 * np.sin(bounce) - act["dip"] + smooth_noise(rng, t, 2.0, 0.008)
    root = stack_columns(*place.T, smooth_minimum(top, height, 0.03))
    lift, reach = style.shoulder_rad
    shoulders = {
        side: (lift + 0.06 + 0.02 * breath, reach + act[f"{who}.reach"] + smooth_noise(rng, t, 1.5, 0.015))
        for who, side in (("lead", lead), ("rear", rear))
    }
    figure = ArticulatedFigure(skeleton, root, pelvis, spine, gaze, shoulders, sample_posture_offsets(rng, t, habits))
    for who, side, guard in (("lead", lead, (0.36, 0.16, 0.04)), ("rear", rear, (0.20, 0.14, 0.06))):
        figure.pose_leg(side, feet[side])
        _pose_arm(
            figure,
            side,
            rng,
            t,
            facing,
            np.add(guard, style.guard_m),
            {k: act[f"{who}.{k}"] for k in _CHANNELS},
            act["drop"],
        )
    return figure


_CHANNELS = ("ahead", "in", "up", "elbow", "pronate")


def _pose_arm(
    figure: ArticulatedFigure,
    side: str,
    rng: np.random.Generator,
    t: Floats,
    facing: Floats,
    guard: Floats,
    act: Mapping[str, Floats],
    drop: Floats,
) -> None:
    """Pose one arm from its guard: the wrist's place ahead, out and up of the chest, for an arm of 0.58 m [m]."""
    sign, reach = SIDE_SIGN[side], figure.arm_m(side) / 0.58
    x, y, z = guard + rng.normal(0.0, 0.025, 3)
    wrist = figure.point_near_chest_m(
        facing,
        reach * (x + act["ahead"] - 0.10 * drop + smooth_noise(rng, t, 1.3, 0.018)),
        sign * reach * (y - act["in"] + 0.08 * drop + smooth_noise(rng, t, 1.3, 0.014)),
        reach * (z + act["up"] - 0.30 * drop + smooth_noise(rng, t, 1.3, 0.016)),
    )
    raised = act["elbow"] + 0.30 + float(rng.normal(0.0, 0.08)) + smooth_noise(rng, t, 1.6, 0.05)
    figure.pose_reaching_arm(
        side,
        wrist,
        stack_columns(*horizontal_vector(facing, -0.25, sign * np.sin(raised)).T, -np.cos(raised)),
        -0.35 + act["pronate"] + smooth_noise(rng, t, 1.4, 0.05),
        (-0.08 + 0.06 * act["pronate"], np.full(len(t), 0.05)),
    )


def _plan_footwork(
    rng: np.random.Generator, t: Floats, slow: float
) -> tuple[footwork.StanceShift, list[footwork.StanceShift]]:
    """Steps around the opponent, within about a metre of the origin."""
    yaw = float(rng.uniform(-np.pi, np.pi))
    start = footwork.StanceShift(0.0, (float(rng.normal(0.0, 0.1)), float(rng.normal(0.0, 0.1))), yaw)
    shifts: list[footwork.StanceShift] = []
    now, place = float(t[0]) + rng.uniform(0.2, 0.8), np.array(start.place_m)
    while now < t[-1]:
        yaw += rng.normal(0.0, 0.16)
        home = -0.25 * place
        place = place + horizontal_vector(rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.08, 0.20), 0.0) + home
        step_s = rng.uniform(0.22, 0.28) * slow
        shifts.append(
            footwork.StanceShift(now, (float(place[0]), float(place[1])), yaw, step_s, rng.uniform(0.02, 0.08), 0.022)
        )
        now += 2.0 * step_s + 0.1 + rng.uniform(0.05, 0.9)
    return start, shifts


def _plan_combinations(rng: np.random.Generator, t: Floats, size: float, slow: float, take: int) -> list[Gesture]:
    """Punches and evasions over the take, with pauses."""
    gestures: list[Gesture] = []
    favour = rng.dirichlet(np.full(len(_COMBINATIONS), 1.5))
    favour[(take * 3) % len(_COMBINATIONS)] += 0.15
    now = float(t[0]) - 0.3
    while now < t[-1]:
        combination = _COMBINATIONS[int(rng.choice(len(_COMBINATIONS), p=favour / favour.sum()))]
        for parts in combination:
            flip = -1.0 if parts is _SLIP and rng.random() < 0.5 else 1.0
            punch = Gesture(now, parts).vary(rng, flip * size, slow)
            if flip < 0.0:
                punch = Gesture(now, {**punch.channels, "dip": [(dt, -v) for dt, v in punch.channels["dip"]]})
            gestures.append(punch)
            now += (0.62 if parts is _ROLL else rng.uniform(0.34, 0.46)) * slow
        now += rng.uniform(0.15, 0.8) * slow
        if rng.random() < 0.16:
            gestures.append(Gesture(now, _GUARD_DOWN).vary(rng, 1.0, slow))
            now += 2.1 * slow
    return gestures
