"""Simulated motion of a performer who holds calibration poses, one after another, with small pose errors.

A calibration defines the world's frame by the performer's position and heading in the first pose, so that pose is held
exactly there. Between poses the feet are set down anew, with small errors of position and heading.
"""

from collections.abc import Sequence

import numpy as np

from harness.body import Body, pose_from_qpos, sole_heights_m
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.errors import BadInput

STEP_M, STEP_RAD = 0.03, float(np.deg2rad(3.0))
"""Change of position and heading from one pose to the next, standard deviations [m, rad] [choice]."""


def hold_poses(
    body: Body,
    configurations: Sequence[Floats],
    *,
    miss_rad: float,
    rng: np.random.Generator,
    hold_s: float = 3.0,
    move_s: float = 1.5,
    rate_hz: float = 120.0,
) -> BodyMotion:
    """A motion in which each configuration (55,) is held for `hold_s` seconds, with `move_s` seconds in between.

    Every hinge and the lean of the body have an error of N(0, `miss_rad`) in each pose; the lower sole is at z = 0.
    `hold_times_s` gives the times of the holds. BadInput without configurations.
    """
    if not configurations:
        raise BadInput("There is no pose to hold.", "Give at least one pose.")
    held, shift_m, yaw_rad = [], np.zeros(2), 0.0
    for number, nominal in enumerate(configurations):
        if number:
            shift_m, yaw_rad = shift_m + rng.normal(0.0, STEP_M, 2), yaw_rad + float(rng.normal(0.0, STEP_RAD))
        held.append(_put_on_floor(body, _with_pose_error(nominal, miss_rad, rng), shift_m, yaw_rad))
    time_s = np.arange(round(rate_hz * (len(held) * (hold_s + move_s) - move_s)) + 1) / rate_hz
    cycle, since_s = np.divmod(time_s, hold_s + move_s)
    which = np.minimum(cycle.astype(int), len(held) - 1)
    share = np.clip((since_s - hold_s) / max(move_s, 1e-9), 0.0, 1.0)
    poses = np.array([*held, held[-1]])
    qpos = minimum_jerk(poses[which], poses[which + 1], np.where(which == len(held) - 1, 0.0, share))
    return BodyMotion("calibration", "", "built-in performer", "calibration", rate_hz, qpos)


def hold_times_s(count: int, hold_s: float = 3.0, move_s: float = 1.5) -> list[tuple[float, float]]:
    """Begin and end of each hold of a `hold_poses` motion [s]."""
    return [(n * (hold_s + move_s), n * (hold_s + move_s) + hold_s) for n in range(count)]


def minimum_jerk(first: Floats, last: Floats, share: Floats) -> Floats:
    """(N, 55) minimum-jerk motion between two configurations, (55,) or (N, 55), at shares (N,) of its duration.

    It is at rest at both ends (Flash & Hogan 1985).
    """
    t = share[:, None]
    progress = t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
    start, stop = first[..., 3:7], last[..., 3:7]
    turn = rotations.log(rotations.multiply(rotations.inverse(start), stop))
    qpos: Floats = first + progress * (last - first)
    qpos[:, 3:7] = rotations.multiply(start, rotations.exp(progress * turn))
    return qpos


def _with_pose_error(nominal: Floats, miss_rad: float, rng: np.random.Generator) -> Floats:
    """The configuration with normal errors of each hinge and of the body's lean."""
    qpos = np.array(nominal)
    lean = np.array([*rng.normal(0.0, miss_rad, 2), 0.0])
    qpos[3:7] = rotations.multiply(rotations.exp(lean), qpos[3:7])
    qpos[7:] += rng.normal(0.0, miss_rad, len(qpos) - 7)
    return qpos


def _put_on_floor(body: Body, qpos: Floats, shift_m: Floats, yaw_rad: float) -> Floats:
    """The configuration rotated about the vertical through its root, shifted, its lower sole on the floor."""
    out = np.array(qpos)
    out[:2] += shift_m
    out[3:7] = rotations.multiply(rotations.about_z(yaw_rad), out[3:7])
    soles_m = sole_heights_m(body.skeleton, pose_from_qpos(body.skeleton, out[None]))
    out[2] -= float(soles_m.min())
    return out
