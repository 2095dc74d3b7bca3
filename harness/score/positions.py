"""Errors of joint centres (docs/metrics.md, part D). Each metric maps a `Pair` to one number per frame.

Nothing is aligned unless the name says so.
"""

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.score.pair import Pair, bones_named

LOWER = tuple(side + bone for side in "lr" for bone in ("hipjoint", "femur", "tibia", "foot"))
HANDS = ("lhand", "rhand")
FEET = ("lfoot", "rfoot")


def joint_errors_mm(pair: Pair) -> Floats:
    """(F, 25) distance of every joint centre from its true position."""
    return _distance_mm(pair.estimate.joints_m, pair.truth.joints_m)


def mpjpe_mm(pair: Pair) -> Floats:
    """(F,) mean joint distance without alignment."""
    out: Floats = joint_errors_mm(pair).mean(axis=1)
    return out


def mpjpe_root_mm(pair: Pair) -> Floats:
    """(F,) mean joint distance after subtracting both root positions; orientations are not aligned."""
    truth, estimate = (p.joints_m - p.root_m[:, None] for p in (pair.truth, pair.estimate))
    out: Floats = _distance_mm(estimate, truth).mean(axis=1)
    return out


def mpjpe_pa_mm(pair: Pair) -> Floats:
    """(F,) mean joint distance after the best rotation and translation of each frame, without scale (Kabsch 1976)."""
    truth, estimate = (p.joints_m - p.joints_m.mean(axis=1, keepdims=True) for p in (pair.truth, pair.estimate))
    turn = rotations.nearest_rotation(np.swapaxes(estimate, 1, 2) @ truth)
    out: Floats = _distance_mm(estimate @ turn, truth).mean(axis=1)
    return out


def root_position_mm(pair: Pair) -> Floats:
    """(F,) distance of the root from its true position."""
    return _distance_mm(pair.estimate.root_m, pair.truth.root_m)


def upper_position_mm(pair: Pair) -> Floats:
    """(F,) mean joint distance of spine, neck, head and arms (16 far ends)."""
    return _mean_of(pair, tuple(name for name in pair.skeleton.names if name not in LOWER))


def lower_position_mm(pair: Pair) -> Floats:
    """(F,) mean joint distance of hip joints and legs (8 far ends)."""
    return _mean_of(pair, LOWER)


def hands_position_mm(pair: Pair) -> Floats:
    """(F,) mean distance of the far ends of both hands."""
    return _mean_of(pair, HANDS)


def feet_position_mm(pair: Pair) -> Floats:
    """(F,) mean distance of the far ends of both feet."""
    return _mean_of(pair, FEET)


def root_drift_mm_s(pair: Pair) -> float:
    """Growth rate of the root error: norm of the slope of its least-squares line over time [mm/s]."""
    time_s = pair.frame_index / pair.rate_hz
    if len(time_s) < 2:
        return float("nan")
    centred_s = time_s - time_s.mean()
    error_mm = 1e3 * (pair.estimate.root_m - pair.truth.root_m)
    return float(np.linalg.norm(centred_s @ error_mm / (centred_s @ centred_s)))


def _mean_of(pair: Pair, bones: tuple[str, ...]) -> Floats:
    out: Floats = joint_errors_mm(pair)[:, 1 + bones_named(pair.skeleton, bones)].mean(axis=1)
    return out


def _distance_mm(a_m: Floats, b_m: Floats) -> Floats:
    out: Floats = 1e3 * np.sqrt(np.sum((a_m - b_m) ** 2, axis=-1))
    return out
