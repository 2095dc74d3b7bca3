"""Walking: footsteps along a path in a room, a pelvis that moves over them, and arms that swing opposite to the legs.

Timing and amplitudes follow Perry, Gait Analysis (1992): stance of 62 % of the cycle, pelvic rotation and list of about
5 deg, and step length and cadence that grow with speed.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.synthetic.articulated_figure import SIDE_SIGN, SIDES, ArticulatedFigure
from harness.mocap.synthetic.curves import (
    GRAVITY_M_S2,
    Gesture,
    gaussian_smooth,
    minimum_jerk,
    smooth_minimum,
    smooth_noise,
    sum_gestures,
)
from harness.mocap.synthetic.footwork import FootContact, highest_root_m, leg_length_m, plan_foot
from harness.mocap.synthetic.limb_ik import horizontal_vector, stack_columns
from harness.mocap.synthetic.performers import Habits, sample_posture_offsets

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


STANCE_SHARE = 0.59
"""Share of the gait cycle at which the ball of the foot starts to leave the floor; it has left at 0.62."""
_PASSING_SHARE = 0.53
"""Time from heel strike until the pelvis passes the ankle [steps]."""
_PAD_S = 3.0
"""Time that is planned before and after a take [s]."""


@dataclass(frozen=True)
class Gait:
    """Gait parameters of one take."""

    effort: float
    """Speed relative to 1.3 m/s."""
    swing: float
    """Relative amplitude of the arm swing, about 1."""
    elbow_rad: float
    stoop_rad: float
    crouch: float
    """Lowering of the pelvis, as a share of the leg."""
    land_rad: float
    push_rad: float
    lift_m: float
    half_width_m: float


def synthesize(skeleton: Skeleton, habits: Habits, rng: np.random.Generator, t: Floats, take: int) -> ArticulatedFigure:
    """Generate one take along one of six kinds of path, at times `t` (T,) [s]."""
    step_s = float(t[1] - t[0])
    pad = int(_PAD_S / step_s)
    padded_t = (np.arange(len(t) + 2 * pad) - pad) * step_s + t[0]
    style = habits.style
    path = sample_walking_path(rng, padded_t, take, style.speed, style.variety)
    gait = _sample_gait(rng, habits, float(path.speed_m_s.mean()), take)
    # cadence: step length grows as speed to the power 0.55
    rhythm = 1.88 * habits.pace * rng.uniform(0.97, 1.03) * (path.speed_m_s / 1.3) ** 0.45
    rhythm *= 1.0 + smooth_noise(rng, padded_t, 1.5, 0.012)
    steps = np.concatenate([[0.0], np.cumsum(0.5 * (rhythm[1:] + rhythm[:-1]) * step_s)]) + rng.uniform(0.0, 2.0)
    plants = _plan_footsteps(rng, skeleton, habits, gait, padded_t, path, steps)
    feet = {side: plan_foot(t, skeleton, side, plants[side], 0.03 + style.knees_out_rad) for side in SIDES}

    inside = slice(pad, pad + len(t))
    stride = np.pi * steps[inside]
    """Phase of the gait cycle [rad]: 0 at left heel strike, pi at right heel strike."""
    yaw = path.yaw_rad[inside]
    lean = np.clip(np.gradient(yaw, step_s) * path.speed_m_s[inside] / GRAVITY_M_S2, -0.3, 0.3)
    pelvis = stack_columns(
        yaw - 0.085 * style.pelvis_turn * gait.effort * np.cos(stride + 0.15) + smooth_noise(rng, t, 2.5, 0.012),
        habits.pelvis_rad
        + 0.05
        + 0.3 * gait.stoop_rad
        + 0.012 * np.cos(2.0 * stride - 0.8)
        + smooth_noise(rng, t, 3.0, 0.008),
        0.055 * style.pelvis_list * np.cos(stride - 0.4 * np.pi) - 0.5 * lean + smooth_noise(rng, t, 3.0, 0.008),
    )
    sway = style.pelvis_list * rng.uniform(0.016, 0.026) * np.cos(stride - 0.6 * np.pi) + smooth_noise(
        rng, t, 2.0, 0.004
    )
    place = path.place_m[inside] + horizontal_vector(yaw, -0.03, sway)
    top = highest_root_m(skeleton, place, pelvis, feet, 0.994)
    root = stack_columns(
        *place.T,
        smooth_minimum(top, gaussian_smooth(top, 1.2 / step_s) + 0.004 - gait.crouch * leg_length_m(skeleton), 0.03),
    )

    breath = np.sin(2.0 * np.pi * t * rng.uniform(0.25, 0.33) + rng.uniform(0.0, 6.0))
    bob = 0.02 * np.cos(2.0 * stride + 0.6) + 0.008 * breath
    spine = stack_columns(
        habits.bend_rad + 0.7 * gait.stoop_rad + 0.02 * gait.effort + bob + smooth_noise(rng, t, 4.0, 0.012),
        0.15 * style.trunk_turn * gait.swing * gait.effort * np.cos(stride) + smooth_noise(rng, t, 3.0, 0.015),
        -0.065 * style.pelvis_list * np.cos(stride - 0.4 * np.pi) + 0.2 * lean + smooth_noise(rng, t, 3.0, 0.012),
    )
    look = sum_gestures(t, _sample_glances(rng, t))
    bearing = np.clip(1.1 * (np.interp(t + 0.35, padded_t, path.yaw_rad) - yaw), -0.7, 0.7)
    gaze = stack_columns(
        yaw + np.tanh(bearing + look["yaw"]) + smooth_noise(rng, t, 2.5, 0.05),
        0.06 + style.nod_rad + rng.uniform(-0.04, 0.12) + look["pitch"] + smooth_noise(rng, t, 2.5, 0.03),
        -0.15 * lean + smooth_noise(rng, t, 3.0, 0.012),
    )
    arms = stride - 0.1 - style.swing_lag_rad
    forward = {"l": -np.cos(arms), "r": np.cos(arms)}
    lift, reach = style.shoulder_rad
    shoulders = {
        s: (lift + 0.02 * breath + smooth_noise(rng, t, 3.0, 0.01), reach + 0.04 * gait.swing * forward[s])
        for s in SIDES
    }
    figure = ArticulatedFigure(skeleton, root, pelvis, spine, gaze, shoulders, sample_posture_offsets(rng, t, habits))
    for side in SIDES:
        figure.pose_leg(side, feet[side])
        _swing_arm(figure, side, rng, t, habits, gait, forward[side])
    return figure


def _sample_gait(rng: np.random.Generator, habits: Habits, speed_m_s: float, take: int) -> Gait:
    """Gait of a take: easy, brisk, tired or marching, by the take's number."""
    effort = float(np.clip(speed_m_s / 1.3, 0.6, 1.4))
    style = ("easy", "brisk", "tired", "marching")[(take - 1) % 4]
    swing, elbow, stoop, crouch, lift = {
        "easy": ((0.8, 1.3), (-0.1, 0.15), (0.0, 0.10), (0.0, 0.01), (0.04, 0.07)),
        "brisk": ((1.3, 1.7), (0.5, 0.95), (0.02, 0.12), (0.0, 0.015), (0.04, 0.07)),
        "tired": ((0.4, 0.8), (-0.15, 0.2), (0.12, 0.28), (0.01, 0.035), (0.035, 0.06)),
        "marching": ((1.5, 1.9), (-0.1, 0.3), (-0.05, 0.03), (0.0, 0.01), (0.10, 0.15)),
    }[style]
    own = habits.style

    def sample(limits: tuple[float, float], easy: float) -> float:
        """A draw, and nearer to `easy` the less the performer's takes vary."""
        drawn = float(rng.uniform(*limits))
        return drawn + (own.variety - 1.0) * (drawn - easy)

    return Gait(
        effort=effort,
        swing=habits.size * own.swing * sample(swing, 1.05),
        elbow_rad=habits.elbow_rad + sample(elbow, 0.03),
        stoop_rad=sample(stoop, 0.05),
        crouch=own.crouch + sample(crouch, 0.005),
        land_rad=own.push * float(rng.uniform(0.28, 0.40)) * effort**0.5,
        push_rad=own.push * float(rng.uniform(0.90, 1.05)),
        lift_m=sample(lift, 0.055),
        half_width_m=own.width * float(rng.uniform(0.045, 0.075)),
    )


def _plan_footsteps(
    rng: np.random.Generator,
    skeleton: Skeleton,
    habits: Habits,
    gait: Gait,
    t: Floats,
    path: WalkingPath,
    steps: Floats,
) -> Mapping[str, list[FootContact]]:
    """A contact for each whole number of `steps` (T,), the count of steps made by time t; by side."""

    def at(step: float, curve: Floats) -> float:
        return float(np.interp(step, steps, curve))

    plants: dict[str, list[FootContact]] = {side: [] for side in SIDES}
    ahead_m = 0.92 * float(skeleton.length_m[skeleton.index("lfoot")])
    stance_share = STANCE_SHARE + habits.style.stance_share
    for k in range(int(np.ceil(steps[0])), int(steps[-1] - 2.0 * stance_share)):
        side = SIDES[k % 2]
        yaw = at(k + stance_share, path.yaw_rad)
        toes = yaw + SIDE_SIGN[side] * habits.toes_out_rad + float(rng.normal(0.0, 0.02))
        ankle = np.array([at(k + _PASSING_SHARE, path.place_m[:, 0]), at(k + _PASSING_SHARE, path.place_m[:, 1])])
        ankle += horizontal_vector(
            yaw, rng.normal(0.0, 0.008), SIDE_SIGN[side] * gait.half_width_m + rng.normal(0.0, 0.006)
        )
        ball = ankle + horizontal_vector(toes, ahead_m, 0.0)
        plants[side].append(
            FootContact(
                on_s=at(k, t),
                off_s=at(k + 2.0 * stance_share, t),
                ball_m=(float(ball[0]), float(ball[1])),
                yaw_rad=toes,
                land_rad=gait.land_rad * float(rng.uniform(0.92, 1.08)),
                push_rad=gait.push_rad * float(rng.uniform(0.95, 1.05)),
                lift_m=gait.lift_m * float(rng.uniform(0.9, 1.1)),
                lift_peak=0.33 if gait.lift_m < 0.1 else 0.42,
            )
        )
    return plants


def _sample_glances(rng: np.random.Generator, t: Floats) -> list[Gesture]:
    """Glances to the side or to the floor at random times."""
    glances: list[Gesture] = []
    now = float(t[0]) - rng.uniform(0.0, 3.0)
    while now < t[-1]:
        hold_s, yaw, pitch = rng.uniform(0.5, 1.6), rng.uniform(-0.9, 0.9), rng.uniform(-0.1, 0.3)
        keys = (0.0, 0.0), (0.45, 1.0), (0.45 + hold_s, 0.95), (1.0 + hold_s, 0.0)
        parts = {"yaw": [(s, yaw * v) for s, v in keys], "pitch": [(s, pitch * v) for s, v in keys]}
        glances.append(Gesture(now, parts))
        now += 1.0 + hold_s + rng.uniform(0.5, 5.0)
    return glances


def _swing_arm(
    figure: ArticulatedFigure,
    side: str,
    rng: np.random.Generator,
    t: Floats,
    habits: Habits,
    gait: Gait,
    forward: Floats,
) -> None:
    """Pose a swinging arm; `forward` (T,) is 1 where it is farthest forward, -1 where it is farthest back."""
    style, flexion = habits.style, gait.elbow_rad
    size = gait.swing * gait.effort * float(rng.uniform(0.9, 1.1))
    size *= 1.0 + (style.uneven if side == habits.hand else -style.uneven)
    figure.pose_hanging_arm(
        side,
        0.26 * size * forward - 0.08 + style.arm_forward_rad + 0.10 * flexion + smooth_noise(rng, t, 2.5, 0.03),
        habits.spread_rad + 0.02 * forward + smooth_noise(rng, t, 2.5, 0.02),
        0.20 + style.arm_twist_rad + 0.15 * flexion + 0.08 * forward + smooth_noise(rng, t, 2.5, 0.03),
        flexion + 0.20 * style.elbow_swing * size * forward + 0.05 * forward**2 + smooth_noise(rng, t, 2.0, 0.03),
        0.05 + style.pronation_rad + 0.08 * forward + smooth_noise(rng, t, 2.0, 0.04),
        (-0.22 + 0.08 * forward + smooth_noise(rng, t, 1.5, 0.02), smooth_noise(rng, t, 1.5, 0.02)),
    )
