"""Which jumps a take is made of, and when."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Floats
from harness.core.rotations import wrap_angle
from harness.mocap.synthetic.limb_ik import horizontal_vector
from harness.mocap.synthetic.performers import Habits

JUMP_KINDS = ("up", "forward", "side", "turning", "series")


@dataclass(frozen=True)
class Jump:
    """One jump: times [s], how deep it dips, where it goes."""

    down_s: float
    """The countermovement starts."""
    bottom_s: float
    leave_s: float
    land_s: float
    landing_bottom_s: float
    """The landing is at its lowest."""
    up_s: float
    dip: float
    """Depth of the countermovement as a share of the leg."""
    landing_depth: float
    """Depth of the landing, likewise."""
    displacement_m: tuple[float, float]
    """How far it goes, in the world."""
    turn_rad: float
    rebound: bool
    """The next jump takes off from the lowest point of this landing."""

    @property
    def flight_s(self) -> float:
        return self.land_s - self.leave_s


def plan_jumps(rng: np.random.Generator, t: Floats, habits: Habits, kind: str) -> tuple[list[Jump], float]:
    """The jumps of a take, most of one kind, and the first heading [rad]; far from the middle it turns back."""
    yaw0 = yaw = float(rng.uniform(-np.pi, np.pi))
    jumps: list[Jump] = []
    now, rebound, left_in_series, hand = float(t[0]) + rng.uniform(0.3, 0.9), False, 0, 1.0
    place = np.zeros(2)
    slow = rng.uniform(0.95, 1.1) / habits.pace
    usual = rng.uniform(0.36, 0.50) * habits.size**0.5
    while not jumps or now < t[-1] - 0.5:
        this = kind if rng.random() < 0.7 or left_in_series else str(rng.choice(JUMP_KINDS))
        if this == "series" and not left_in_series:
            left_in_series = int(rng.integers(3, 7))
        flight_s = float(np.clip(usual * rng.uniform(0.9, 1.1), 0.30, 0.56))
        along, aside, turn = 0.0, 0.0, 0.0
        if this == "forward":
            along = rng.uniform(0.35, 0.95) * flight_s / 0.45
        elif this == "side":
            aside, hand = hand * rng.uniform(0.25, 0.5), -hand
        elif this == "turning":
            turn = float(rng.choice([-1.0, 1.0])) * rng.uniform(0.7, 1.5)
        elif this == "series":
            along = rng.uniform(0.0, 0.12)
        if np.hypot(*place) > 1.2 and along > 0.3:
            home = np.arctan2(-place[1], -place[0])
            turn = float(np.clip(wrap_angle(home - yaw), -1.5, 1.5))
            along = 0.15
        bottom_s = now if rebound else now + rng.uniform(0.45, 0.65) * slow
        leave_s = bottom_s + rng.uniform(0.29, 0.36) * slow
        land_s = leave_s + flight_s
        deep_s = land_s + rng.uniform(0.25, 0.34) * slow
        left_in_series = max(left_in_series - 1, 0)
        again = left_in_series > 0
        up_s = deep_s if again else deep_s + rng.uniform(0.5, 0.75) * slow
        give = rng.uniform(0.18, 0.26) if again else rng.uniform(0.14, 0.28)
        dip = jumps[-1].landing_depth if rebound else rng.uniform(0.26, 0.38)
        way_m = horizontal_vector(yaw, along, aside)
        down_s = bottom_s if rebound else now
        way = (float(way_m[0]), float(way_m[1]))
        jumps.append(Jump(down_s, bottom_s, leave_s, land_s, deep_s, up_s, dip, give, way, turn, again))
        yaw += turn
        place += way_m
        rebound = again
        now = deep_s if again else up_s + rng.uniform(0.15, 0.9)
    return jumps, yaw0
