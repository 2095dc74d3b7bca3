"""Jumping: countermovement, push, ballistic flight, landing; upwards, forwards, sideways, turning, and in series.

Timing follows Bobbert and van Ingen Schenau (1988): the push takes 0.25 to 0.35 s, and the arms swing up with it. In
flight the root accelerates with gravity exactly; push and landing match its position, speed and acceleration.
"""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.rotations import wrap_angle
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic.articulated_figure import SIDE_SIGN, SIDES, ArticulatedFigure, FootTarget
from harness.mocap.synthetic.curves import (
    GRAVITY_M_S2,
    Gesture,
    interpolate_keys,
    keyframes_at,
    minimum_jerk,
    pulse,
    quintic_spline,
    smooth_maximum,
    smooth_minimum,
    smooth_noise,
    sum_gestures,
)
from harness.mocap.synthetic.footwork import BALL_M, highest_root_m, leg_length_m, pose_foot
from harness.mocap.synthetic.limb_ik import horizontal_vector, stack_columns
from harness.mocap.synthetic.performers import Habits, sample_posture_offsets

JUMP_KINDS = ("up", "forward", "side", "turning", "series")


@dataclass(frozen=True)
class Jump:
    """One jump: its times [s], the depth of its crouches, and where it goes."""

    down_s: float
    """Start of the countermovement."""
    bottom_s: float
    """Lowest point of the countermovement."""
    leave_s: float
    land_s: float
    landing_bottom_s: float
    """Lowest point of the landing."""
    up_s: float
    """End of the landing, standing upright."""
    dip: float
    """Depth of the countermovement as a share of the leg."""
    landing_depth: float
    """Depth of the landing as a share of the leg."""
    displacement_m: tuple[float, float]
    """Horizontal displacement in the world [m]."""
    turn_rad: float
    rebound: bool
    """Whether the next jump starts from the lowest point of this landing."""

    @property
    def flight_s(self) -> float:
        return self.land_s - self.leave_s


def plan_jumps(rng: np.random.Generator, t: Floats, habits: Habits, kind: str) -> tuple[list[Jump], float]:
    """The jumps of a take, most of them of one kind, and the first heading [rad].

    A performer who is far from the origin turns back towards it.
    """
    yaw0 = yaw = float(rng.uniform(-np.pi, np.pi))
    jumps: list[Jump] = []
    now, rebound, left_in_series, hand = float(t[0]) + rng.uniform(0.3, 0.9), False, 0, 1.0
    place = np.zeros(2)
    slow = rng.uniform(0.95, 1.1) / habits.pace
    mean_flight_s = rng.uniform(0.36, 0.50) * habits.size**0.5
    while not jumps or now < t[-1] - 0.5:
        jump_kind = kind if rng.random() < 0.7 or left_in_series else str(rng.choice(JUMP_KINDS))
        if jump_kind == "series" and not left_in_series:
            left_in_series = int(rng.integers(3, 7))
        flight_s = float(np.clip(mean_flight_s * rng.uniform(0.9, 1.1), 0.30, 0.56))
        along, aside, turn = 0.0, 0.0, 0.0
        if jump_kind == "forward":
            along = rng.uniform(0.35, 0.95) * flight_s / 0.45
        elif jump_kind == "side":
            aside, hand = hand * rng.uniform(0.25, 0.5), -hand
        elif jump_kind == "turning":
            turn = float(rng.choice([-1.0, 1.0])) * rng.uniform(0.7, 1.5)
        elif jump_kind == "series":
            along = rng.uniform(0.0, 0.12)
        if np.hypot(*place) > 1.2 and along > 0.3:
            home = np.arctan2(-place[1], -place[0])
            turn = float(np.clip(wrap_angle(home - yaw), -1.5, 1.5))
            along = 0.15
        bottom_s = now if rebound else now + rng.uniform(0.45, 0.65) * slow
        leave_s = bottom_s + rng.uniform(0.29, 0.36) * slow
        land_s = leave_s + flight_s
        landing_bottom_s = land_s + rng.uniform(0.25, 0.34) * slow
        left_in_series = max(left_in_series - 1, 0)
        again = left_in_series > 0
        up_s = landing_bottom_s if again else landing_bottom_s + rng.uniform(0.5, 0.75) * slow
        landing_depth = rng.uniform(0.18, 0.26) if again else rng.uniform(0.14, 0.28)
        dip = jumps[-1].landing_depth if rebound else rng.uniform(0.26, 0.38)
        move_m = horizontal_vector(yaw, along, aside)
        down_s = bottom_s if rebound else now
        displacement = (float(move_m[0]), float(move_m[1]))
        jumps.append(
            Jump(
                down_s, bottom_s, leave_s, land_s, landing_bottom_s, up_s, dip, landing_depth, displacement, turn, again
            )
        )
        yaw += turn
        place += move_m
        rebound = again
        now = landing_bottom_s if again else up_s + rng.uniform(0.15, 0.9)
    return jumps, yaw0


def synthesize(skeleton: Skeleton, habits: Habits, rng: np.random.Generator, t: Floats, take: int) -> ArticulatedFigure:
    """Generate one take at times `t` (T,) [s]; the take's number decides its most frequent kind of jump."""
    jumps, yaw0 = plan_jumps(rng, t, habits, JUMP_KINDS[take % len(JUMP_KINDS)])
    leg, style = leg_length_m(skeleton), habits.style
    act = sum_gestures(t, [_jump_gesture(rng, jump, habits) for jump in jumps])
    breath = np.sin(2.0 * np.pi * t * rng.uniform(0.35, 0.5) + rng.uniform(0.0, 6.0))

    yaw, foot_yaw = np.full(len(t), yaw0), np.full(len(t), yaw0)
    place, foot_place = np.zeros((len(t), 2)), np.zeros((len(t), 2))
    tuck, pitch = np.zeros(len(t)), np.zeros(len(t))
    for jump in jumps:
        share = (t - jump.leave_s) / jump.flight_s
        aloft = minimum_jerk((share - 0.1) / 0.8)
        foot_place += aloft[:, None] * jump.displacement_m
        foot_yaw += jump.turn_rad * aloft
        yaw += jump.turn_rad * minimum_jerk((t - jump.leave_s + 0.12) / (jump.flight_s + 0.2))
        place += _ground_travel(t, jump)[:, None] * jump.displacement_m
        tuck += 0.95 * GRAVITY_M_S2 * jump.flight_s**2 / 8.0 * pulse(share)
        leave, land = jump.leave_s, jump.land_s
        heels_up = [0.45 * leave + 0.55 * jump.bottom_s, leave, leave + 0.09, land - 0.08, land, land + 0.09]
        pitch += interpolate_keys(t, heels_up, [0.0, 0.60, 0.88, 0.42, 0.32, 0.0])
    middle = 0.5 * (foot_place.min(axis=0) + foot_place.max(axis=0))
    pelvis = stack_columns(
        yaw + smooth_noise(rng, t, 2.5, 0.02),
        habits.pelvis_rad + 0.02 + act["pelvis"] + smooth_noise(rng, t, 2.5, 0.012),
        smooth_noise(rng, t, 3.0, 0.012),
    )
    back = act["back"] * leg - 0.045 + smooth_noise(rng, t, 2.0, 0.006)
    place += horizontal_vector(yaw, back, smooth_noise(rng, t, 2.0, 0.008)) - middle
    foot_place += horizontal_vector(foot_yaw, 0.06, 0.0) - middle

    half, out = leg * style.width * float(rng.uniform(0.12, 0.20)), habits.toes_out_rad + 0.03

    def feet_at(lift: float | Floats) -> dict[str, FootTarget]:
        feet: dict[str, FootTarget] = {}
        for side in SIDES:
            ball = stack_columns(
                *(foot_place + horizontal_vector(foot_yaw, 0.0, SIDE_SIGN[side] * half)).T, BALL_M + lift
            )
            feet[side] = pose_foot(
                skeleton, side, ball, foot_yaw + SIDE_SIGN[side] * out, pitch, 0.0, 0.06 + style.knees_out_rad
            )
        return feet

    top = highest_root_m(skeleton, place, pelvis, feet_at(0.0), 0.99)
    stand = (
        float(np.quantile(top[pitch < 0.01], 0.8)) - 0.012 - style.crouch * leg
        if np.any(pitch < 0.01)
        else float(np.min(top))
    )
    air = _flight_weight(t, jumps)
    root = stack_columns(*place.T, smooth_minimum(_root_height(t, jumps, stand, leg), top + 0.5 * air, 0.02))
    # in flight the feet rise with the body, and a little more: a tuck
    feet = feet_at(air * smooth_maximum(tuck, root[:, 2] - top, 0.015))
    spine = stack_columns(
        habits.bend_rad + 0.03 + act["bend"] + 0.012 * breath + smooth_noise(rng, t, 2.5, 0.018),
        smooth_noise(rng, t, 2.5, 0.025),
        smooth_noise(rng, t, 2.5, 0.018),
    )
    gaze = stack_columns(
        yaw + act["look"] + smooth_noise(rng, t, 2.0, 0.05),
        0.12 + style.nod_rad + act["nod"] + smooth_noise(rng, t, 2.0, 0.03),
        smooth_noise(rng, t, 2.0, 0.02),
    )
    up = np.tanh(act["swing"])
    lift, reach = style.shoulder_rad
    shoulders = {
        side: (lift + 0.02 * breath + 0.06 * up, reach + 0.05 * up + smooth_noise(rng, t, 2.0, 0.01)) for side in SIDES
    }
    figure = ArticulatedFigure(skeleton, root, pelvis, spine, gaze, shoulders, sample_posture_offsets(rng, t, habits))
    for side in SIDES:
        figure.pose_leg(side, feet[side])
        amplitude = float(rng.uniform(0.95, 1.05))
        figure.pose_hanging_arm(
            side,
            0.06 + style.arm_forward_rad + amplitude * act["swing"] + smooth_noise(rng, t, 1.8, 0.04),
            habits.spread_rad + 0.05 + act["spread"] + smooth_noise(rng, t, 1.8, 0.03),
            0.20 + style.arm_twist_rad + smooth_noise(rng, t, 1.8, 0.04),
            habits.elbow_rad + amplitude * style.elbow_swing * act["elbow"] + smooth_noise(rng, t, 1.8, 0.04),
            0.08 + style.pronation_rad + 0.15 * act["swing"] + smooth_noise(rng, t, 1.6, 0.04),
            (-0.20 + 0.06 * act["swing"], np.zeros(len(t))),
        )
    return figure


def _ground_travel(t: Floats, jump: Jump) -> Floats:
    """(T,) share of the jump's displacement that the root has covered, at constant speed in flight."""
    push, slow = 0.8 * (jump.leave_s - jump.bottom_s), 1.1 * (jump.landing_bottom_s - jump.land_s)
    speed = 1.0 / (jump.flight_s + 0.4 * push + 0.4 * slow)
    at = np.array([jump.leave_s - push, jump.leave_s, jump.land_s, jump.land_s + slow])
    value = np.array([0.0, 0.4 * push * speed, 1.0 - 0.4 * slow * speed, 1.0])
    return quintic_spline(t, at, value, np.array([0.0, speed, speed, 0.0]), np.zeros(4))


def _root_height(t: Floats, jumps: list[Jump], stand: float, leg: float) -> Floats:
    """(T,) height of the root: parabolas in flight, joined by quintics [m]."""
    at, value, slope, bend = [t[0] - 10.0], [stand], [0.0], [0.0]
    rebound = False
    for jump in jumps:
        fast = 0.5 * GRAVITY_M_S2 * jump.flight_s
        leave = stand + 0.035 * leg
        if not rebound:
            at.append(jump.down_s)
            value.append(stand)
            slope.append(0.0)
            bend.append(0.0)
            at.append(jump.bottom_s)
            value.append(stand - jump.dip * leg)
            slope.append(0.0)
            bend.append(14.0)
        at += [jump.leave_s, jump.land_s, jump.landing_bottom_s]
        value += [leave, leave, stand - jump.landing_depth * leg]
        slope += [fast, -fast, 0.0]
        bend += [-GRAVITY_M_S2, -GRAVITY_M_S2, 14.0]
        if not jump.rebound:
            at.append(jump.up_s)
            value.append(stand)
            slope.append(0.0)
            bend.append(0.0)
        rebound = jump.rebound
    return quintic_spline(t, *(np.array(x) for x in (at, value, slope, bend)))


def _flight_weight(t: Floats, jumps: list[Jump]) -> Floats:
    """(T,) 1 in flight and 0 on the floor, with smooth transitions of 80 ms before and after."""
    out = np.zeros(len(t))
    for jump in jumps:
        out += minimum_jerk((t - jump.leave_s + 0.08) / 0.08) * minimum_jerk((jump.land_s + 0.08 - t) / 0.08)
    return out


def _jump_gesture(rng: np.random.Generator, jump: Jump, habits: Habits) -> Gesture:
    """Motion of trunk and arms in a jump."""
    start_s = jump.down_s - (0.3 if jump.bottom_s == jump.down_s else 0.0)
    at = {
        "start": 0.0,
        "back": 0.6 * (jump.bottom_s - start_s),
        "bottom": jump.bottom_s - start_s,
        "drive": 0.45 * jump.bottom_s + 0.55 * jump.leave_s - start_s,
        "leave": jump.leave_s - start_s,
        "top": 0.5 * (jump.leave_s + jump.land_s) - start_s,
        "land": jump.land_s - start_s,
        "deep": jump.landing_bottom_s - start_s,
        "end": max(jump.up_s, jump.landing_bottom_s + 0.45) - start_s,
    }
    high = min(float(rng.uniform(1.2, 1.9)) * habits.size * habits.style.swing**0.5, 2.0) * (
        0.55 if jump.rebound else 1.0
    )
    dip, give, far = jump.dip, jump.landing_depth, float(np.hypot(*jump.displacement_m))
    parts = {
        "pelvis": keyframes_at(at, bottom=1.5 * dip, leave=0.05, top=-0.03, land=0.04, deep=1.4 * give),
        "bend": keyframes_at(at, bottom=0.9 * dip, leave=-0.05, top=0.02, land=0.0, deep=0.8 * give),
        "back": keyframes_at(at, bottom=-0.34 * dip, leave=0.02, land=-0.03 - 0.1 * far, deep=-0.36 * give),
        "swing": keyframes_at(at, back=-0.70, leave=high, land=0.5 * high, deep=0.15),
        "elbow": keyframes_at(at, bottom=-0.05, drive=0.7, leave=0.35, land=0.75, deep=0.55),
        "spread": keyframes_at(at, bottom=0.15, leave=0.12, land=0.42, deep=0.35),
        "nod": keyframes_at(at, bottom=0.10, leave=-0.16, land=0.20, deep=0.16),
        "look": keyframes_at(at, bottom=0.25 * jump.turn_rad, land=0.0),
    }
    return Gesture(start_s, parts).vary(rng, 1.0, 1.0, 0.04)
