"""Contact of the feet with the ground, and smoothness. Each metric maps a `Pair` to one number per frame.

Differences over time are taken only between consecutive frames without a gap. The value is assigned to the last frame
of a difference and is NaN elsewhere. Contact is determined from the truth alone.
"""

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.score.pair import Pair, PoseSequence, bones_named

FOOT_POINTS = ("ltibia", "lfoot", "rtibia", "rfoot")
"""Bones whose far ends are ankle and toe, left and right."""
CONTACT_HEIGHT_M = 0.05
"""Height above the ground below which a point can be in contact [m] (choice)."""
CONTACT_SPEED_M_S = 0.15
"""Speed below which a point can be in contact [m/s] (choice)."""


def sole_heights_m(motion: PoseSequence) -> Floats:
    """(T, 4) height of the toes, and of the ankles minus their height over the toe in the rest pose [m]."""
    toe_drop_m = motion.skeleton.bone_m[bones_named(motion.skeleton, ("lfoot", "lfoot", "rfoot", "rfoot")), 2]
    out: Floats = _foot_points_m(motion)[..., 2] + np.where([True, False, True, False], toe_drop_m, 0.0)
    return out


def ground_m(truth: PoseSequence) -> float:
    """Ground height under the true feet [m]: the median over the take of the lowest sole point (choice).

    Joint centres lie inside the feet, and the floor of a recording need not be at zero. In CMU's clips, true toes are
    30 to 50 mm high; with the ground at zero the share of frames in contact would depend on the session.
    """
    return float(np.median(sole_heights_m(truth).min(axis=1)))


def mpjve_mm_s(pair: Pair) -> Floats:
    """(F,) mean difference of the joint centres' velocities."""
    error_m = pair.estimate.joints_m - pair.truth.joints_m
    return pair.over_gaps(1e3 * pair.rate_hz * _length(np.diff(error_m, axis=0)).mean(axis=1), steps=1)


def jitter_m_s3(pair: Pair) -> Floats:
    """(F,) mean jerk of the estimate's joint centres, |p(t) - 3 p(t-1) + 3 p(t-2) - p(t-3)| rate^3."""
    return _jerk(pair, pair.estimate)


def jitter_true_m_s3(pair: Pair) -> Floats:
    """(F,) mean jerk of the true joint centres [m/s^3]."""
    return _jerk(pair, pair.truth)


def foot_skate_mm_s(pair: Pair) -> Floats:
    """(F,) mean horizontal speed of the ankles and toes that are in contact in the truth; NaN when none is [mm/s]."""
    return _skate(pair, pair.estimate)


def foot_skate_true_mm_s(pair: Pair) -> Floats:
    """(F,) foot skate of the true motion [mm/s]."""
    return _skate(pair, pair.truth)


def penetration_mm(pair: Pair) -> Floats:
    """(F,) depth of the lowest ankle or toe below the ground while any is in contact in the truth, else NaN [mm]."""
    return np.maximum(-_lowest_mm(pair, pair.estimate), 0.0)


def penetration_true_mm(pair: Pair) -> Floats:
    """(F,) penetration of the true motion [mm]."""
    return np.maximum(-_lowest_mm(pair, pair.truth), 0.0)


def float_mm(pair: Pair) -> Floats:
    """(F,) height of the lowest ankle or toe above the ground while any is in contact in the truth, else NaN [mm]."""
    return np.maximum(_lowest_mm(pair, pair.estimate), 0.0)


def float_true_mm(pair: Pair) -> Floats:
    """(F,) float of the true motion [mm]."""
    return np.maximum(_lowest_mm(pair, pair.truth), 0.0)


def in_contact(pair: Pair) -> Bools:
    """(F, 4) which ankles and toes are in contact in the truth."""
    low = sole_heights_m(pair.truth) - pair.ground_m < CONTACT_HEIGHT_M
    slow = np.zeros_like(low)
    slow[1:] = pair.rate_hz * _length(np.diff(_foot_points_m(pair.truth), axis=0)) < CONTACT_SPEED_M_S
    out: Bools = low & slow & pair.unbroken(1)[:, None]
    return out


def _skate(pair: Pair, motion: PoseSequence) -> Floats:
    contact = in_contact(pair)
    speed_mm_s = np.zeros(contact.shape)
    speed_mm_s[1:] = 1e3 * pair.rate_hz * _length(np.diff(_foot_points_m(motion)[..., :2], axis=0))
    touching = contact.sum(axis=1)
    out: Floats = np.where(touching > 0, (speed_mm_s * contact).sum(axis=1) / np.maximum(touching, 1), np.nan)
    return out


def _lowest_mm(pair: Pair, motion: PoseSequence) -> Floats:
    lowest_mm = 1e3 * (sole_heights_m(motion).min(axis=1) - pair.ground_m)
    out: Floats = np.where(in_contact(pair).any(axis=1), lowest_mm, np.nan)
    return out


def _jerk(pair: Pair, motion: PoseSequence) -> Floats:
    return pair.over_gaps(pair.rate_hz**3 * _length(np.diff(motion.joints_m, n=3, axis=0)).mean(axis=1), steps=3)


def _foot_points_m(motion: PoseSequence) -> Floats:
    out: Floats = motion.joints_m[:, 1 + bones_named(motion.skeleton, FOOT_POINTS)]
    return out


def _length(vectors: Floats) -> Floats:
    out: Floats = np.sqrt(np.sum(vectors**2, axis=-1))
    return out
