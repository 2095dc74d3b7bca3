"""What can be wrong with recorded motion, found in the positions of its joints.

Thresholds were set on the 163 AMC clips of CMU's library at hand, at 120 frames a second. They find the five clips
whose glitches are known (05_13, 16_01, 16_15, 16_23, 16_28), and three more: in 13_17 the right shoulder jumps by
0.14 m at frame 716 and stays there; in 16_17 the whole body is 0.09 m off in frame 475 and back in the next; 49_04
has runs of identical frames. The largest jump in any other clip is 11.2 m/s, the largest twitch 16.0 m/s.
"""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.hinges import equivalent_euler_angles
from harness.core.humanoid24 import BONES, limits_rad, standard_skeleton
from harness.core.rotations import wrap_angle
from harness.core.skeleton import Skeleton

JUMP_M_S = 12.0
"""A joint's speed over one frame may differ so much from the median of the two frames before and after [m/s]."""
TWITCH_M_S = 18.0
"""A joint's speed may change so much from one frame to the next [m/s]."""
FROZEN_TOLERANCE_M = 1e-7
"""Two frames are the same when no joint moves further [m]; in recorded motion something always does."""
FROZEN_FRAMES = 3
"""As many equal frames in a row are a frozen recording."""
CONTACT_M = 0.05
"""A foot is on the floor when its lowest point is so near to it [m]."""


@dataclass(frozen=True)
class Spike:
    """A joint that moves as no body can."""

    frame: int
    """Counted from 1, as in AMC files: the one that it jumps to, or is alone in being off."""
    joint: str
    speed_m_s: float
    """By how much its speed is off [m/s]."""


def find_spikes(names: tuple[str, ...], position_m: Floats, rate_hz: float) -> tuple[Spike, ...]:
    """The worst joint of every run of frames with a jump or a twitch, for positions (T, P, 3); NaN is not seen."""
    if len(position_m) < 3:
        return ()
    step = np.diff(position_m, axis=0) * rate_hz
    around = np.pad(step, ((2, 2), (0, 0), (0, 0)), mode="edge")
    middle = np.median(np.stack([around[:-4], around[1:-3], around[3:-1], around[4:]]), axis=0)
    jump = np.nan_to_num(_norm(step - middle))
    twitch = np.zeros_like(jump)
    twitch[:-1] = np.nan_to_num(_norm(np.diff(step, axis=0)))
    excess = np.maximum(jump / JUMP_M_S, twitch / TWITCH_M_S)
    found = []
    for first, last in find_runs(excess.max(axis=1) > 1.0):
        t = first - 1 + int(jump[first - 1 : last].max(axis=1).argmax())
        joint = int(excess[t].argmax())
        found.append(Spike(t + 2, names[joint], float(max(jump[t, joint], twitch[t, joint]))))
    return tuple(found)


def find_frozen_frames(position_m: Floats) -> tuple[tuple[int, int], ...]:
    """First and last frame, counted from 1, of every run of equal frames."""
    still = np.nan_to_num(_norm(np.diff(position_m, axis=0))).max(axis=1, initial=0.0) < FROZEN_TOLERANCE_M
    return tuple((first, last + 1) for first, last in find_runs(still) if last + 2 - first >= FROZEN_FRAMES)


def find_runs(where: Bools) -> list[tuple[int, int]]:
    """First and last place, counted from 1, of every unbroken run of True."""
    edges = np.diff(np.concatenate([[False], where, [False]]).astype(int))
    firsts, ends = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
    return [(int(first) + 1, int(end)) for first, end in zip(firsts, ends, strict=True)]


def estimate_floor(position_m: Floats, feet: Ints) -> tuple[float, float]:
    """Height of the floor (2nd percentile of the lowest foot point) [m] and the share of frames with a foot on it."""
    lowest = np.nan_to_num(position_m[:, feet, 2], nan=np.inf).min(axis=1)
    height = float(np.percentile(lowest[np.isfinite(lowest)], 2.0))
    return height, float(np.mean(lowest < height + CONTACT_M))


def find_fastest_joint(names: tuple[str, ...], position_m: Floats, rate_hz: float) -> tuple[float, str, int]:
    """The highest speed of any joint [m/s], the joint, and the frame, counted from 1, that it reaches so."""
    speed = np.nan_to_num(_norm(np.diff(position_m, axis=0))) * rate_hz
    if speed.size == 0:
        return 0.0, names[0], 1
    frame, joint = np.unravel_index(int(speed.argmax()), speed.shape)
    return float(speed[frame, joint]), names[int(joint)], int(frame) + 2


def has_standard_hinges(skeleton: Skeleton) -> bool:
    """Whether the skeleton has the 24 bones with just their hinges, so that the model's limits apply."""
    return set(BONES) <= set(skeleton.names) and skeleton.subset(BONES)[0].dof_names == standard_skeleton().dof_names


def measure_limit_violations(skeleton: Skeleton, angles_rad: Floats) -> tuple[float, float, str]:
    """Share of frames with a hinge outside the model's limits, the most by which one is [rad], and its name.

    The limits are those of core.humanoid24, for angles in principal form, of a skeleton that `has_standard_hinges`.
    """
    body, dofs = skeleton.subset(BONES)
    angles = principal_angles(body, angles_rad[:, dofs])
    limits = limits_rad()
    excess = np.maximum(limits[:, 0] - angles, angles - limits[:, 1])
    most = excess.max(axis=0)
    share = float(np.mean(excess.max(axis=1) > 1e-9))
    return share, float(most.max()), body.dof_names[int(most.argmax())]


def principal_angles(skeleton: Skeleton, angles_rad: Floats) -> Floats:
    """The same rotations (T, D) with every angle in [-pi, pi) and the middle one of three in [-pi/2, pi/2]."""
    out = wrap_angle(np.array(angles_rad, dtype=float))
    for where in skeleton.dof_of_bone:
        if where.stop - where.start == 3:
            over = np.abs(out[:, where.start + 1]) > 0.5 * np.pi
            out[over, where] = wrap_angle(equivalent_euler_angles(out[over, where]))
    return out


def _norm(vectors: Floats) -> Floats:
    out: Floats = np.sqrt(np.sum(vectors**2, axis=-1))
    return out
