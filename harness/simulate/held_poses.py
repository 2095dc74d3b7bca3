"""A performer who holds poses, one after another, and misses each of them a little: what calibration is made from.

Which way the performer faces in the first pose, and where, is what a calibration takes for the world's frame: it is
held where it is said to be. From then on feet are set down anew between two poses.
"""

from collections.abc import Sequence

import numpy as np

from harness.body import ground, kinematics
from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import BodyMotion
from harness.errors import BadInput

STEP_M, STEP_RAD = 0.03, float(np.deg2rad(3.0))
"""How far the performer stands and faces from where the pose before was held, standard deviations [choice]."""


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
    """A take in which each configuration (55,) is held for `hold_s`, with `move_s` from one to the next.

    Every hinge and the lean of the body miss each pose by N(0, `miss_rad`), drawn anew; the lower sole stands on z = 0.
    `hold_times_s` says when the holds are. BadInput without any configuration.
    """
    if not configurations:
        raise BadInput("Nothing to hold.", "Give one pose at least.")
    held, beside_m, turned_rad = [], np.zeros(2), 0.0
    for number, meant in enumerate(configurations):
        if number:
            beside_m, turned_rad = beside_m + rng.normal(0.0, STEP_M, 2), turned_rad + float(rng.normal(0.0, STEP_RAD))
        held.append(_put_on_floor(body, _with_pose_error(meant, miss_rad, rng), beside_m, turned_rad))
    time_s = np.arange(round(rate_hz * (len(held) * (hold_s + move_s) - move_s)) + 1) / rate_hz
    cycle, since_s = np.divmod(time_s, hold_s + move_s)
    which = np.minimum(cycle.astype(int), len(held) - 1)
    share = np.clip((since_s - hold_s) / max(move_s, 1e-9), 0.0, 1.0)
    poses = np.array([*held, held[-1]])
    qpos = minimum_jerk(poses[which], poses[which + 1], np.where(which == len(held) - 1, 0.0, share))
    return BodyMotion("calibration", "", "built-in performer", "calibration", rate_hz, qpos)


def hold_times_s(count: int, hold_s: float = 3.0, move_s: float = 1.5) -> list[tuple[float, float]]:
    """Begin and end of each hold of such a take [s]."""
    return [(n * (hold_s + move_s), n * (hold_s + move_s) + hold_s) for n in range(count)]


def minimum_jerk(first: Floats, last: Floats, share: Floats) -> Floats:
    """(N, 55) from one configuration to another, (55,) or (N, 55), at shares (N,) of the time that it takes.

    A minimum-jerk course, at rest at both ends (Flash & Hogan 1985).
    """
    t = share[:, None]
    course = t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
    start, stop = first[..., 3:7], last[..., 3:7]
    turn = rotations.log(rotations.multiply(rotations.inverse(start), stop))
    qpos: Floats = first + course * (last - first)
    qpos[:, 3:7] = rotations.multiply(start, rotations.exp(course * turn))
    return qpos


def _with_pose_error(meant: Floats, miss_rad: float, rng: np.random.Generator) -> Floats:
    """The configuration with each hinge off by a little, and the body leaning."""
    qpos = np.array(meant)
    lean = np.array([*rng.normal(0.0, miss_rad, 2), 0.0])
    qpos[3:7] = rotations.multiply(rotations.exp(lean), qpos[3:7])
    qpos[7:] += rng.normal(0.0, miss_rad, len(qpos) - 7)
    return qpos


def _put_on_floor(body: Body, qpos: Floats, beside_m: Floats, turned_rad: float) -> Floats:
    """The configuration turned about the vertical through its root, set beside, its lower sole on the floor."""
    out = np.array(qpos)
    out[:2] += beside_m
    out[3:7] = rotations.multiply(rotations.about_z(turned_rad), out[3:7])
    soles_m = ground.sole_heights_m(body.skeleton, kinematics.pose_from_qpos(body.skeleton, out[None]))
    out[2] -= float(soles_m.min())
    return out
