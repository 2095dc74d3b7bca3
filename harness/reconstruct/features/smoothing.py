"""Smoothing over three frames by which Kim et al. 2012 bridge short losses: eq. 6.

y = y_t + ((y_t-1 + (y_t-2 - y_t-1)^alpha) - y_t)^beta, where the difference of two rotations is a rotation, its power
is a share of its angle, and y_t-1, y_t-2 are earlier outputs. For hinge angles and plain vectors this is a weighted
sum: 0.60, 0.28 and 0.12 with the paper's alpha 0.3 and beta 0.4.
"""

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.compiled import compiled


def slerp(start: Floats, stop: Floats, share: float) -> Floats:
    """Spherical interpolation of unit quaternions (..., 4) by a share, along the shorter arc."""
    turn = rotations.log(rotations.multiply(rotations.inverse(start), stop))
    return rotations.multiply(start, rotations.exp(share * turn))


def smooth_rotation(now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
    """Eq. 6 for quaternions (..., 4) at t, t-1 and t-2."""
    return slerp(now, slerp(before, earlier, alpha), beta)


def smooth(now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
    """Eq. 6 for vectors (n,) at t, t-1 and t-2."""
    return _weighted_sum(now, before, earlier, *smoothing_weights(alpha, beta))


def smoothing_weights(alpha: float, beta: float) -> tuple[float, float, float]:
    """Weights of t, t-1 and t-2 in eq. 6 for a vector, such as hinge angles."""
    return 1.0 - beta, beta * (1.0 - alpha), beta * alpha


@compiled
def _weighted_sum(
    now: Floats, before: Floats, earlier: Floats, share: float, share_before: float, share_earlier: float
) -> Floats:
    return share * now + share_before * before + share_earlier * earlier
