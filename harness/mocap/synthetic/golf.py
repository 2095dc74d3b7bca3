"""Golf swings: address, backswing, top, downswing, impact, follow-through, hold, and return to the next ball.

The hands move on a tilted circle about the top of the chest, and the wrists cock the club. The hips lead the downswing,
and the gaze stays on the ball until after impact. The backswing takes 0.75 to 1.0 s and the downswing 0.23 to 0.3 s,
near the 3:1 tempo of Grober (2009). Signs are those of a right-hander who faces the ball with the target on the left;
the factor `s` mirrors them.
"""

from collections.abc import Mapping

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic import footwork
from harness.mocap.synthetic.articulated_figure import SIDE_SIGN, ArticulatedFigure
from harness.mocap.synthetic.curves import (
    Gesture,
    Keyframes,
    keyframes_at,
    smooth_maximum,
    smooth_minimum,
    smooth_noise,
    sum_gestures,
)
from harness.mocap.synthetic.limb_ik import horizontal_vector, normalize, stack_columns
from harness.mocap.synthetic.performers import Habits, sample_posture_offsets

_WRIST_SEPARATION_M = 0.075
"""Distance of the two wrists along the grip [m]."""


def synthesize(skeleton: Skeleton, habits: Habits, rng: np.random.Generator, t: Floats, take: int) -> ArticulatedFigure:
    """Generate one take at times `t` (T,) [s]: a swing about every eight seconds, full or three-quarter."""
    trail, style = habits.hand, habits.style
    lead = "l" if trail == "r" else "r"
    s = SIDE_SIGN[lead]
    leg = footwork.leg_length_m(skeleton)
    full = (1.0, 0.88, 0.95, 0.80)[(take - 1) % 4] * float(rng.uniform(0.97, 1.03))
    swings, begins = _plan_swings(rng, t, habits, full)
    act = sum_gestures(t, swings)

    half = leg * style.width * float(rng.uniform(0.22, 0.30))
    stance = {
        lead: footwork.FootPlacement(0.06, s * half, s * float(rng.uniform(0.20, 0.40))),
        trail: footwork.FootPlacement(0.06, -s * half, -s * float(rng.uniform(0.05, 0.20))),
    }
    start = footwork.StanceShift(0.0, (0.0, 0.0), float(rng.uniform(-np.pi, np.pi)))
    shifts = _plan_footwork(rng, start, begins)
    place, facing = footwork.plan_body_path(t, start, shifts)
    plants = footwork.plan_steps(rng, stance, start, shifts, float(t[-1]))
    feet = {
        lead: footwork.plan_foot(t, skeleton, lead, plants[lead], 0.02 + style.knees_out_rad, act["lead heel"]),
        trail: footwork.plan_foot(
            t, skeleton, trail, plants[trail], 0.02 + style.knees_out_rad, act["trail heel"], s * act["pivot"]
        ),
    }
    tilt = float(rng.uniform(0.26, 0.40)) + act["tilt"] + smooth_noise(rng, t, 2.5, 0.01)
    bend = habits.bend_rad + float(rng.uniform(0.26, 0.38)) + act["bend"] + smooth_noise(rng, t, 2.5, 0.015)
    turn = s * (act["pelvis"] + smooth_noise(rng, t, 2.5, 0.015))
    twist = s * (0.10 + act["twist"] + smooth_noise(rng, t, 2.5, 0.02))
    # the trunk bends towards the ball, whatever the rotation of hips and chest
    pelvis = stack_columns(facing + turn, tilt * np.cos(turn), tilt * np.sin(turn) + s * act["drop"])
    over = turn + 0.5 * twist
    breath = 0.01 * np.sin(2.0 * np.pi * t * rng.uniform(0.25, 0.33) + rng.uniform(0.0, 6.0))
    spine = stack_columns(bend * np.cos(over) + breath, twist, bend * np.sin(over) + s * (0.10 - act["side bend"]))
    gaze = stack_columns(
        facing + s * (act["look"] + 0.03) + smooth_noise(rng, t, 2.5, 0.03),
        0.80 + style.nod_rad + act["nod"] + smooth_noise(rng, t, 2.5, 0.02),
        s * act["cant"] + smooth_noise(rng, t, 3.0, 0.015),
    )
    ahead = -0.13 * leg - 0.03 + act["ahead"] + smooth_noise(rng, t, 2.5, 0.006)
    place = place + horizontal_vector(facing, ahead, s * act["side"] + smooth_noise(rng, t, 2.5, 0.006))
    top = footwork.highest_root_m(skeleton, place, pelvis, feet, 0.985)
    height = (
        np.median(top)
        - (style.crouch + float(rng.uniform(0.025, 0.05))) * leg
        + act["up"]
        + smooth_noise(rng, t, 2.5, 0.004)
    )
    root = stack_columns(*place.T, smooth_minimum(top, height, 0.03))
    lift, reach = style.shoulder_rad
    shoulders = {
        lead: (lift + act["lead lift"] + breath, reach + 0.05 + act["lead reach"]),
        trail: (lift - 0.05 + act["trail lift"] + breath, reach + 0.13 + act["trail reach"]),
    }
    figure = ArticulatedFigure(
        skeleton, root, pelvis, spine, gaze, shoulders, sample_posture_offsets(rng, t, habits, 1.4)
    )
    for side in (lead, trail):
        figure.pose_leg(side, feet[side])
    _pose_arms(figure, rng, t, facing, act, lead, trail)
    return figure


def _pose_arms(
    figure: ArticulatedFigure,
    rng: np.random.Generator,
    t: Floats,
    facing: Floats,
    act: Mapping[str, Floats],
    lead: str,
    trail: str,
) -> None:
    """Pose both arms on the club: `swing` is the angle of the arms in the swing plane, `cock` that of the wrists."""
    s = SIDE_SIGN[lead]
    arm = figure.arm_m(lead) / 0.58
    swing = act["swing"] + smooth_noise(rng, t, 2.5, 0.015)
    plane = float(rng.uniform(0.88, 1.02)) + act["plane"]
    target = stack_columns(*horizontal_vector(facing, 0.0, s).T, 0.0)
    away = stack_columns(*horizontal_vector(facing, np.cos(plane), 0.0).T, -np.sin(plane))
    out = 0.52 + act["radius"] + smooth_noise(rng, t, 2.5, 0.006)
    cos, sin = np.cos(swing)[:, None], np.sin(swing)[:, None]
    grip = figure.chest_m + arm * out[:, None] * (cos * away + sin * target)
    grip += stack_columns(*horizontal_vector(facing, arm * (0.02 + act["in"]), 0.0).T, arm * act["raise"])
    cocked = swing + act["cock"] + 0.02
    shaft = np.cos(cocked)[:, None] * away + np.sin(cocked)[:, None] * target
    strike = cos * target - sin * away
    ends = {lead: -0.5 * _WRIST_SEPARATION_M * shaft, trail: 0.5 * _WRIST_SEPARATION_M * shaft}
    for side in (trail, lead, trail, lead):  # move the grip towards the shoulders until both arms reach it
        line = grip + ends[side] - figure.shoulder_m(side)
        distance = np.sqrt(np.sum(line**2, axis=1))
        over = smooth_maximum(distance - 0.965 * figure.arm_m(side), np.array(0.0), 0.01) / distance
        grip = grip - over[:, None] * line
    for side in (lead, trail):
        wrist = grip + ends[side]
        chest = figure.chest
        forward = (act["lead elbow"] if side == lead else act["trail elbow"]) - 0.35
        elbow = forward[:, None] * chest[:, :, 0] + 0.35 * SIDE_SIGN[side] * chest[:, :, 1] - 0.8 * chest[:, :, 2]
        palm = (1.0 if side == trail else -1.0) * strike - [0.0, 0.0, 0.2]
        back = 0.10 + (0.35 if side == trail else 0.10) * np.tanh(0.8 * act["load"])
        up = 0.05 + 0.45 * np.tanh(0.6 * act["load"])
        figure.pose_reaching_arm(
            side, wrist, elbow, figure.pronation_facing(side, wrist, elbow, normalize(palm)), (-back, up)
        )


def _plan_swings(rng: np.random.Generator, t: Floats, habits: Habits, full: float) -> tuple[list[Gesture], list[float]]:
    """The swings, and the times at which the returns to the ball start [s]."""
    gestures: list[Gesture] = []
    begins: list[float] = []
    now = float(t[0]) - rng.uniform(0.0, 3.0)
    slow = float(rng.uniform(0.95, 1.12)) / habits.pace
    while now < t[-1]:
        waggle, relax, home = (float(rng.uniform(*span)) for span in ((1.0, 1.8), (0.6, 2.2), (1.5, 2.1)))
        at = {"address": waggle}
        at["top"] = at["address"] + float(rng.uniform(0.80, 0.98)) * slow
        down = float(rng.uniform(0.26, 0.31)) * slow
        at["late"] = at["top"] + 0.06 + 0.5 * down
        at["hit"] = at["top"] + 0.06 + down
        at["finish"] = at["hit"] + float(rng.uniform(0.42, 0.52)) * slow
        at["hold"] = at["finish"] + float(rng.uniform(0.6, 1.3))
        at["end"] = at["hold"] + home
        size = full * float(rng.normal(1.0, 0.02))
        gestures += [
            Gesture(now, _swing_channels(at, size)).vary(rng, 1.0, 1.0, 0.02),
            _relax_gesture(rng, now + at["hold"] + 0.5 * home, relax),
            Gesture(now, {"swing": _waggle_keyframes(rng, waggle), "cock": _waggle_keyframes(rng, waggle, 1.6)}),
        ]
        begins.append(now + at["hold"] + 0.25)
        now += at["end"] + relax + 0.6 * home
    return gestures, begins


def _swing_channels(at: Mapping[str, float], size: float) -> Mapping[str, Keyframes]:
    """One swing between its moments [s]; angles [rad] and lengths [m] as a right-hander's, for `size` 1."""
    return {
        "swing": keyframes_at(at, 0.02, top=-2.22 * size, hit=0.04, finish=2.30 * size, hold=2.25 * size),
        "cock": keyframes_at(at, 0.03, top=-1.45, late=-1.15, hit=0.0, finish=1.30, hold=1.25),
        "load": keyframes_at(at, 0.0, top=1.0, late=0.9, hit=0.0, finish=0.9, hold=0.85),
        "radius": keyframes_at(at, 0.0, top=-0.06, hit=0.015, finish=-0.15, hold=-0.15),
        "in": keyframes_at(at, 0.0, top=0.08, hit=0.0, finish=0.10, hold=0.10),
        "plane": keyframes_at(at, 0.0, top=0.02, hit=0.0, finish=0.05, hold=0.05),
        "raise": keyframes_at(at, 0.0, top=0.06, hit=0.0, finish=0.04, hold=0.04),
        # the hips turn back before the chest has come to the top
        "pelvis": keyframes_at(at, -0.04, top=-0.74 * size, hit=0.60, finish=1.15 * size, hold=1.10 * size),
        "twist": keyframes_at(at, 0.04, top=-0.78 * size, hit=-0.22, finish=0.38 * size, hold=0.34 * size),
        "tilt": keyframes_at(at, 0.0, top=0.0, hit=0.02, finish=-0.26 * size, hold=-0.28),
        "bend": keyframes_at(at, 0.0, top=0.0, hit=-0.05, finish=-0.34 * size, hold=-0.32),
        "side bend": keyframes_at(at, 0.0, top=0.10, hit=-0.08, finish=0.04),
        "drop": keyframes_at(at, 0.0, top=0.05, hit=-0.06, finish=-0.02),
        # the eyes stay on the ball
        "look": keyframes_at(at, 0.06, top=-0.32, hit=0.0, finish=1.25, hold=1.30),
        "nod": keyframes_at(at, 0.06, top=0.0, hit=0.0, finish=-0.68, hold=-0.70),
        "cant": keyframes_at(at, 0.0, top=0.10, hit=0.16, finish=0.05),
        "side": keyframes_at(at, 0.0, top=-0.045, hit=0.09, finish=0.15, hold=0.15),
        "ahead": keyframes_at(at, 0.0, hit=0.02, finish=0.06, hold=0.06),
        "up": keyframes_at(at, 0.0, top=0.0, late=-0.03, hit=0.01, finish=0.03, hold=0.03),
        # the elbow of the arm that crosses the chest points forward
        "lead elbow": keyframes_at(at, 0.0, top=0.8, hit=0.0),
        "trail elbow": keyframes_at(at, 0.0, top=0.0, hit=0.0, finish=1.3, hold=1.3),
        "lead heel": keyframes_at(at, 0.0, top=0.10, hit=0.0),
        "trail heel": keyframes_at(at, 0.0, late=0.0, hit=0.35, finish=0.74 * size, hold=0.72 * size),
        "pivot": keyframes_at(at, 0.0, late=0.0, hit=0.15, finish=1.0, hold=0.95),
        "lead reach": keyframes_at(at, 0.0, top=0.12, hit=0.0, finish=-0.08),
        "trail reach": keyframes_at(at, 0.0, top=-0.08, hit=0.03, finish=0.12),
        "lead lift": keyframes_at(at, 0.0, top=0.10, hit=0.03, finish=0.12),
        "trail lift": keyframes_at(at, 0.0, top=0.14, hit=-0.03, finish=0.08),
    }


def _relax_gesture(rng: np.random.Generator, at_s: float, lasts_s: float) -> Gesture:
    """Stand upright with the club down and look after the ball."""

    def hold(value: float) -> list[tuple[float, float]]:
        return [(0.0, 0.0), (0.9, value), (0.9 + lasts_s, 0.95 * value), (1.9 + lasts_s, 0.0)]

    parts = {"tilt": -0.26, "bend": -0.34, "nod": -0.55, "look": 0.7, "radius": -0.05, "up": 0.03, "ahead": 0.05}
    parts |= {"twist": 0.15, "swing": 0.15, "plane": 0.10}
    return Gesture(at_s, {name: hold(value * rng.uniform(0.6, 1.1)) for name, value in parts.items()})


def _waggle_keyframes(rng: np.random.Generator, lasts_s: float, size: float = 1.0) -> list[tuple[float, float]]:
    times = np.linspace(0.0, 0.9 * lasts_s, 6)
    swing = np.array([0.0, -0.10, 0.02, -0.12, 0.01, 0.0]) * rng.uniform(0.6, 1.3, 6) * size
    return [(float(a), float(b)) for a, b in zip(times, swing, strict=True)]


def _plan_footwork(
    rng: np.random.Generator, start: footwork.StanceShift, begins: list[float]
) -> list[footwork.StanceShift]:
    """Small steps to the next ball, starting at the times `begins` [s]."""
    shifts: list[footwork.StanceShift] = []
    place, yaw = np.array(start.place_m), start.yaw_rad
    for at_s in begins:
        place = 0.5 * place + rng.normal(0.0, 0.05, 2)
        yaw += rng.normal(0.0, 0.08)
        if at_s > 0.0:
            shifts.append(footwork.StanceShift(at_s, (float(place[0]), float(place[1])), yaw, 0.42, 0.10, 0.025))
    return shifts
