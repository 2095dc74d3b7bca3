"""The blend of three frames by which Kim et al. 2012 bridge short losses: eq. 6.

y = y_t + ((y_t-1 + (y_t-2 - y_t-1)^alpha) - y_t)^beta, where the difference of two rotations is a turn, its power a
share of that turn, and y_t-1, y_t-2 are poses that were already output. On a single hinge, as on a plain vector, turns
about one axis add up, and the blend is a weighted sum: 0.60, 0.28 and 0.12 with the paper's alpha 0.3 and beta 0.4.
"""

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.compiled import compiled


def slerp(start: Floats, stop: Floats, share: float) -> Floats:
    """The unit quaternions (..., 4) a share of the way from one to the other, the shorter way round."""
    turn = rotations.log(rotations.multiply(rotations.inverse(start), stop))
    return rotations.multiply(start, rotations.exp(share * turn))


def smooth_rotation(now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
    """Eq. 6 of quaternions (..., 4) at t, t-1 and t-2."""
    return slerp(now, slerp(before, earlier, alpha), beta)


def smooth(now: Floats, before: Floats, earlier: Floats, alpha: float, beta: float) -> Floats:
    """Eq. 6 of vectors (n,) at t, t-1 and t-2."""
    return _weighted_sum(now, before, earlier, *smoothing_weights(alpha, beta))


def smoothing_weights(alpha: float, beta: float) -> tuple[float, float, float]:
    """What t, t-1 and t-2 count in eq. 6 of a vector: angles of hinges, coordinates of a point."""
    return 1.0 - beta, beta * (1.0 - alpha), beta * alpha


@compiled
def _weighted_sum(
    now: Floats, before: Floats, earlier: Floats, share: float, share_before: float, share_earlier: float
) -> Floats:
    return share * now + share_before * before + share_earlier * earlier
