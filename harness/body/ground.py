"""Contact of the feet with the floor: heights of the soles, detection of stance, and height of the floor."""

import numpy as np
from scipy.ndimage import binary_opening, gaussian_filter1d, minimum_filter1d

from harness.body import anatomy
from harness.core.arrays import Bools, Floats
from harness.core.skeleton import Pose, Skeleton

SLOW_M_S, STANCE_S = 0.5, 0.06
"""A foot in stance is slower than this speed for at least this time."""
LOW_WITHIN_M, LOW_WITHIN_S = 0.03, 0.3
"""A foot in stance is within this distance of its lowest height within this time, which excludes the top of a jump."""
FLOOR_WITHIN_M = 0.08
"""The floor of a clip is searched for within this distance of z = 0 [m]; CMU's floors are within 6 cm."""
SMOOTHING_S = 0.5
"""Standard deviation of the window over which a height correction is smoothed."""


def sole_heights_m(skeleton: Skeleton, pose: Pose) -> Floats:
    """(T, 2) height of the lowest point, heel or ball, of the left and right sole [m]."""
    heights = []
    for bone, points_m in zip(("lfoot", "rfoot"), anatomy.sole_points_m(skeleton), strict=True):
        b = skeleton.index(bone)
        heights.append(np.min(pose.start_m[:, b, 2, None] + pose.world_from_bone[:, b, 2] @ points_m.T, axis=1))
    return np.stack(heights, axis=1)


def detect_stance(skeleton: Skeleton, pose: Pose, rate_hz: float) -> Bools:
    """(T, 2) whether the left and right foot is in stance: the lower foot, while it is slow and low."""
    if len(pose.end_m) < 2:
        return np.zeros((len(pose.end_m), 2), dtype=bool)
    heights_m = sole_heights_m(skeleton, pose)
    lower = heights_m <= np.min(heights_m, axis=1, keepdims=True) + 0.01
    around = minimum_filter1d(heights_m, 2 * round(LOW_WITHIN_S * rate_hz) + 1, axis=0)
    low = heights_m <= around + LOW_WITHIN_M
    balls_m = pose.end_m[:, [skeleton.index("lfoot"), skeleton.index("rfoot")]]
    slow = np.linalg.norm(np.gradient(balls_m, 1.0 / rate_hz, axis=0), axis=2) < SLOW_M_S
    out: Bools = binary_opening(lower & low & slow, np.ones((max(1, round(STANCE_S * rate_hz)), 1), dtype=bool))
    return out


def floor_m(heights_m: Floats, stance: Bools) -> float:
    """Height of a clip's floor: the median of sole heights (T, 2) in stance near z = 0; 0 without stance [m]."""
    near = heights_m[stance & (np.abs(heights_m) < FLOOR_WITHIN_M)]
    return float(np.median(near)) if near.size else 0.0


def smooth_sole_error(error_m: Floats, stance: Bools, rate_hz: float) -> Floats:
    """(T,) slowly varying mean of a sole error (T, 2) over frames in stance; 0 without stance [m]."""
    share = np.sum(stance, axis=1).astype(float)
    if not share.any():
        return np.zeros(len(share))
    total = np.sum(np.where(stance, error_m, 0.0), axis=1)
    mean = float(np.sum(total) / np.sum(share))
    width = SMOOTHING_S * rate_hz
    near_total, near_share = (gaussian_filter1d(x, width, mode="constant") for x in (total - mean * share, share))
    out: Floats = mean + near_total / (near_share + 1e-3)
    return out
