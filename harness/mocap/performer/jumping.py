"""Jumping: countermovement, push, ballistic flight, landing; upwards, forwards, sideways, turning, and in series.

Timing after Bobbert and van Ingen Schenau (1988): the push takes 0.25 to 0.35 s, the arms swing up with it. In flight
the root falls with gravity exactly; push and landing join it with the same position, speed and acceleration.
"""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton
from harness.mocap.performer.curves import GRAVITY_M_S2, ease, larger, pulse, quintics, through, wander
from harness.mocap.performer.feet import placed
from harness.mocap.performer.figure import LEFT, SIDES, Figure
from harness.mocap.performer.footwork import highest_root_m, leg_m
from harness.mocap.performer.gestures import Gesture, play
from harness.mocap.performer.manner import manner
from harness.mocap.performer.performers import Habits

_KINDS = ("up", "forward", "side", "turning", "series")


@dataclass(frozen=True)
class Jump:
    """One jump: times [s], how deep it dips, where it goes."""

    down_s: float
    """The countermovement starts."""
    bottom_s: float
    leave_s: float
    land_s: float
    deep_s: float
    """The landing is at its lowest."""
    up_s: float
    dip: float
    """Depth of the countermovement as a share of the leg."""
    give: float
    """Depth of the landing, likewise."""
    way_m: tuple[float, float]
    """How far it goes, in the world."""
    turn_rad: float
    rebound: bool
    """The next jump takes off from the lowest point of this landing."""

    @property
    def flight_s(self) -> float:
        return self.land_s - self.leave_s


def move(skeleton: Skeleton, habits: Habits, rng: np.random.Generator, t: Floats, take: int) -> Figure:
    """One take; each favours one kind of jump."""
    jumps, yaw0 = _plan(rng, t, habits, _KINDS[take % len(_KINDS)])
    leg = leg_m(skeleton)
    width, out = leg * rng.uniform(0.13, 0.19), habits.toes_out_rad + 0.03
    breath = np.sin(2.0 * np.pi * t * rng.uniform(0.35, 0.5) + rng.uniform(0.0, 6.0))

    yaw, place = np.full(len(t), yaw0), np.zeros((len(t), 2))
    foot_place, foot_yaw = np.zeros((len(t), 2)), np.full(len(t), yaw0)
    flight = np.zeros(len(t))
    pitch = np.zeros(len(t))
    for jump in jumps:
        share = (t - jump.leave_s) / jump.flight_s
        air = ease(share)
        foot_place += air[:, None] * jump.way_m
        foot_yaw += jump.turn_rad * air
        yaw += jump.turn_rad * ease((t - jump.leave_s + 0.12) / (jump.flight_s + 0.2))
        place += _glide(t, jump)[:, None] * jump.way_m
        inside = (share > 0.0) & (share < 1.0)
        flight[inside] = share[inside]
        b, leave, land = jump.bottom_s, jump.leave_s, jump.land_s
        push = b + 0.45 * (leave - b)
        pitch += through(
            t, [push, leave, leave + 0.09, land - 0.08, land, land + 0.09], [0.0, 0.62, 1.0, 0.42, 0.32, 0.0]
        )
    place -= 0.5 * (foot_place.min(axis=0) + foot_place.max(axis=0))
    foot_place -= 0.5 * (foot_place.min(axis=0) + foot_place.max(axis=0))
    act = play(t, [gesture for jump in jumps for gesture in _gestures(rng, jump, habits)])

    pelvis = np.stack(
        [
            yaw + wander(rng, t, 2.5, 0.02),
            habits.pelvis_rad + 0.02 + act["pelvis"] + wander(rng, t, 2.5, 0.012),
            wander(rng, t, 3.0, 0.012),
        ],
        axis=-1,
    )
    c, s = np.cos(yaw), np.sin(yaw)
    back = act["back"] * leg - 0.045 + wander(rng, t, 2.0, 0.006)
    aside = wander(rng, t, 2.0, 0.008)
    place = place + np.stack([c * back - s * aside, s * back + c * aside], axis=-1)
    cf, sf = np.cos(foot_yaw), np.sin(foot_yaw)
    middle = foot_place + 0.06 * np.stack([cf, sf], axis=-1)
    balls = {
        side: np.stack(
            [middle[:, 0] - LEFT[side] * width * sf, middle[:, 1] + LEFT[side] * width * cf, np.full(len(t), 0.032)],
            axis=-1,
        )
        for side in SIDES
    }

    def feet_at(lift: Floats) -> dict[str, Floats]:
        up = np.zeros((len(t), 3))
        up[:, 2] = lift
        return {
            side: placed(skeleton, side, balls[side] + up, foot_yaw + LEFT[side] * out, pitch, 0.0, 0.06)
            for side in SIDES
        }

    top = highest_root_m(skeleton, place, pelvis, feet_at(np.zeros(len(t))), 0.99)
    stand = float(np.median(top)) - 0.012
    root = np.concatenate(
        [place, (_height(t, jumps, stand, leg) + wander(rng, t, 2.5, 0.002) * _still(t, jumps))[:, None]], axis=1
    )
    tuck = np.zeros(len(t))
    for jump in jumps:
        share = (t - jump.leave_s) / jump.flight_s
        high = GRAVITY_M_S2 * jump.flight_s**2 / 8.0
        tuck += 0.95 * high * pulse(share)
    lift = larger(tuck, root[:, 2] - top, 0.02)
    feet = feet_at(lift)

    spine = np.stack(
        [
            habits.bend_rad + 0.03 + act["bend"] + 0.012 * breath + wander(rng, t, 2.5, 0.018),
            wander(rng, t, 2.5, 0.025),
            wander(rng, t, 2.5, 0.018),
        ],
        axis=-1,
    )
    gaze = np.stack(
        [
            yaw + act["look"] + wander(rng, t, 2.0, 0.05),
            0.12 + act["nod"] + wander(rng, t, 2.0, 0.03),
            wander(rng, t, 2.0, 0.02),
        ],
        axis=-1,
    )
    shoulders = {
        side: (0.02 * breath + 0.06 * np.tanh(act["swing"]), 0.05 * np.tanh(act["swing"]) + wander(rng, t, 2.0, 0.01))
        for side in SIDES
    }
    figure = Figure(skeleton, root, pelvis, spine, gaze, shoulders, manner(rng, t, habits))
    for side in SIDES:
        figure.leg(side, feet[side])
        own = rng.uniform(0.93, 1.07)
        figure.hang(
            side,
            0.06 + own * act["swing"] + wander(rng, t, 1.8, 0.04),
            habits.spread_rad + 0.05 + act["spread"] + wander(rng, t, 1.8, 0.03),
            0.20 + wander(rng, t, 1.8, 0.05),
            0.42 + own * act["elbow"] + wander(rng, t, 1.8, 0.05),
            0.08 + 0.15 * act["swing"] + wander(rng, t, 1.6, 0.05),
            (-0.20 + 0.06 * act["swing"] + wander(rng, t, 1.4, 0.04), wander(rng, t, 1.4, 0.04)),
        )
    return figure


def _glide(t: Floats, jump: Jump) -> Floats:
    """0 to 1: the root's way over the ground, at an even speed in flight."""
    push, slow = 0.8 * (jump.leave_s - jump.bottom_s), 1.1 * (jump.deep_s - jump.land_s)
    speed = 1.0 / (jump.flight_s + 0.4 * push + 0.4 * slow)
    at = np.array([jump.leave_s - push, jump.leave_s, jump.land_s, jump.land_s + slow])
    value = np.array([0.0, 0.4 * push * speed, 1.0 - 0.4 * slow * speed, 1.0])
    return quintics(t, at, value, np.array([0.0, speed, speed, 0.0]), np.zeros(4))


def _height(t: Floats, jumps: list[Jump], stand: float, leg: float) -> Floats:
    """(T,) the root's height: parabolas in flight, quintics that join them."""
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
        at += [jump.leave_s, jump.land_s, jump.deep_s]
        value += [leave, leave, stand - jump.give * leg]
        slope += [fast, -fast, 0.0]
        bend += [-GRAVITY_M_S2, -GRAVITY_M_S2, 14.0]
        if not jump.rebound:
            at.append(jump.up_s)
            value.append(stand)
            slope.append(0.0)
            bend.append(0.0)
        rebound = jump.rebound
    return quintics(t, *(np.array(x) for x in (at, value, slope, bend)))


def _still(t: Floats, jumps: list[Jump]) -> Floats:
    """(T,) 1 in quiet standing, 0 in jumps."""
    out = np.ones(len(t))
    for jump in jumps:
        out *= 1.0 - ease((t - jump.down_s + 0.3) / 0.3) * ease((jump.up_s + 0.3 - t) / 0.3)
    return out


def _plan(rng: np.random.Generator, t: Floats, habits: Habits, kind: str) -> tuple[list[Jump], float]:
    yaw0 = yaw = float(rng.uniform(-np.pi, np.pi))
    jumps: list[Jump] = []
    now, rebound, left_in_series, way = float(t[0]) + rng.uniform(0.3, 0.9), False, 0, 1.0
    place = np.zeros(2)
    slow = rng.uniform(0.95, 1.1) / habits.pace
    usual = rng.uniform(0.36, 0.50) * habits.size**0.5
    while now < t[-1] - 0.5:
        this = kind if rng.random() < 0.7 or left_in_series else str(rng.choice(_KINDS))
        if this == "series" and not left_in_series:
            left_in_series = int(rng.integers(3, 7))
        flight_s = float(np.clip(usual * rng.uniform(0.9, 1.1), 0.30, 0.56))
        along, aside, turn = 0.0, 0.0, 0.0
        if this == "forward":
            along = rng.uniform(0.35, 0.95) * flight_s / 0.45
        elif this == "side":
            aside, way = way * rng.uniform(0.25, 0.5), -way
        elif this == "turning":
            turn = float(rng.choice([-1.0, 1.0])) * rng.uniform(0.7, 1.6)
        elif this == "series":
            along = rng.uniform(0.0, 0.12)
        if np.hypot(*place) > 1.2 and along > 0.3:
            home = np.arctan2(-place[1], -place[0])
            turn = (home - yaw + np.pi) % (2.0 * np.pi) - np.pi
            turn = float(np.clip(turn, -1.7, 1.7))
            along = 0.15
        c, s = np.cos(yaw), np.sin(yaw)
        bottom_s = now if rebound else now + rng.uniform(0.45, 0.65) * slow
        leave_s = bottom_s + rng.uniform(0.27, 0.33) * slow
        land_s = leave_s + flight_s
        deep_s = land_s + rng.uniform(0.22, 0.30) * slow
        left_in_series = max(left_in_series - 1, 0)
        again = left_in_series > 0
        up_s = deep_s if again else deep_s + rng.uniform(0.5, 0.75) * slow
        give = rng.uniform(0.18, 0.26) if again else rng.uniform(0.14, 0.28)
        dip = jumps[-1].give if rebound else rng.uniform(0.26, 0.38)
        jump_way = (c * along - s * aside, s * along + c * aside)
        jumps.append(
            Jump(
                now if not rebound else bottom_s,
                bottom_s,
                leave_s,
                land_s,
                deep_s,
                up_s,
                dip,
                give,
                jump_way,
                turn,
                again,
            )
        )
        yaw += turn
        place += jump_way
        rebound = again
        now = deep_s if again else up_s + rng.uniform(0.15, 0.9)
    return jumps, yaw0


def _gestures(rng: np.random.Generator, jump: Jump, habits: Habits) -> list[Gesture]:
    """What trunk and arms do in a jump."""
    start = jump.down_s - (0.0 if jump.bottom_s > jump.down_s else 0.3)
    b, leave, land, deep, end = (x - start for x in (jump.bottom_s, jump.leave_s, jump.land_s, jump.deep_s, jump.up_s))
    end = max(end, deep + 0.35)
    top = 0.5 * (leave + land)
    high = rng.uniform(1.6, 2.2) * habits.size * (0.55 if jump.rebound else 1.0)
    dip, give = jump.dip, jump.give
    far = float(np.hypot(*jump.way_m))
    return [
        Gesture(
            start,
            {
                "pelvis": [(0.0, 0.0), (b, 1.5 * dip), (leave, 0.05), (top, -0.03), (land, 0.04), (deep, 1.4 * give), (end, 0.0)],
                "bend": [(0.0, 0.0), (b, 0.9 * dip), (leave, -0.05), (top, 0.02), (land, 0.0), (deep, 0.8 * give), (end, 0.0)],
                "back": [(0.0, 0.0), (b, -0.34 * dip), (leave, 0.02), (land, -0.03 - 0.1 * far), (deep, -0.36 * give), (end, 0.0)],
                "swing": [(0.0, 0.0), (b - 0.04, -0.85), (leave + 0.03, high), (land + 0.02, 0.5 * high), (deep + 0.1, 0.15), (end + 0.15, 0.0)],
                "elbow": [(0.0, 0.0), (b, -0.05), (b + 0.55 * (leave - b), 0.7), (leave + 0.06, 0.35), (land, 0.75), (deep, 0.55), (end + 0.1, 0.0)],
                "spread": [(0.0, 0.0), (b, 0.15), (leave, 0.12), (land, 0.42), (deep, 0.35), (end, 0.0)],
                "nod": [(0.0, 0.0), (b, 0.10), (leave, -0.16), (land, 0.20), (deep, 0.16), (end, 0.0)],
                "look": [(0.0, 0.0), (b, 0.25 * jump.turn_rad), (land, 0.0)],
            },
        ).varied(rng, 1.0, 1.0, 0.04)
    ]  # fmt: skip
