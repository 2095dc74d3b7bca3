"""Scales that are estimated on line: those of the readings' noise, of the prior, and of the robust loss.

After each solve the expected squares of the whitened residuals are compared with their number. By expectation
maximisation (Dempster, Laird and Rubin 1977; for a filter: Shumway and Stoffer 1982) the expected square of a residual
is its square at the solution plus the share of the posterior's variance along it. A scale of the noise then moves
towards the ratio by a small power, so that it follows slowly.

The scale of the prior is the ratio of two running means: of the squared distance of the solution from the prior's mean,
and of the information that the readings have about the posture. Its expectation is 1 for a prior that errs as much as
it says, whatever prior was used for the solution. It tells new performers from known ones (`Trust`).

The Lorentzian's scale for positions follows the residuals that a session usually has. A position that is off by 5 to
30 mm for seconds (`Excursion`) has the square's full weight under a scale of 30 mm, and little under one of a few
millimetres. Performers unlike the examples, however, have residuals of that size without any error of the readings. The
scale is therefore a multiple of the running mean of each frame's median distance. The median ignores up to two stations
of six that are off. Huber 1981 (ch. 5 and 7) scales a robust loss by a robust estimate of the residuals' size alike.
"""

import math
from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.reconstruct.solver.kinematic_tree import KinematicState, KinematicTree
from harness.reconstruct.solver.matrix_algebra import invert_positive_definite
from harness.reconstruct.solver.normal_equations import StationTargets, normal_rows
from harness.reconstruct.solver.subspace_minimiser import Subspace, to_subspace, trace_of_product

_MIN_DIAGONAL = 1e-6
"""Added to the diagonal of the normal equations, for a ground frame that no reading determines."""
_MAX_SQUARE = 30.0
"""Limit of a whitened square, so that outliers do not count as noise."""
_NOISE_RATE = 0.1
"""Power of the ratio by which the standard deviations of the noise move in a frame."""
_MIN_NOISE, _MAX_NOISE = 0.1, 0.8
"""Limits of the standard deviations of the noise, as shares of those of the loss."""
_MIN_SCALE, _MAX_SCALE = 0.3, 100.0
"""Limits of the estimated scale of the experts' covariance."""
_INFLATION = 3.0
"""Factor on the experts' covariance over their estimated scale: no reading shows the other directions' errors."""
_SCALE_S, _KIND_S = 0.25, 1.0
"""Time constants of the scale, and of the one that tells known from new performers [s]."""
_FIRST_INFORMATION = 36.0
"""Information that the running means begin with, at a scale of 1."""
_KNOWN, _NEW = 10.0**-0.1, 10.0**0.4
"""Scales up to which a performer is known, and from which on he is new."""
_MULTIPLE = 6.0
"""The scale over the usual median distance."""
_MIN_SCALE_M = 0.005
"""Lower limit of the scale [m]; the loss gives the upper one."""
_MEAN_S = 0.5
"""Time constant of the running mean [s]."""


class Posterior(NamedTuple):
    """Gaussian approximation of the posterior at a solution, and the expected squares that it implies."""

    variance: Floats
    """(P,) variance of each number of the posture."""
    position: float
    """Mean expected whitened square of the measured positions' components."""
    orientation: float
    """Mean expected whitened square of the measured orientations' components."""
    distance: float
    """Squared Mahalanobis distance of the posture from the experts' mean."""
    information: float
    """Trace of the share of the posterior's precision that the readings have: the expectation of `distance` for experts
    that err as much as they say."""


@compiled
def posterior(
    tree: KinematicTree,
    targets: StationTargets,
    state: KinematicState,
    prior: Subspace,
    experts: tuple[Floats, Floats],
    z: Floats,
) -> Posterior:
    """The posterior at a solution z (3 + P,), for which `state` is evaluated: Laplace's approximation.

    The prior is a Gaussian about its mean: its linear term is 0. `experts` are the mean (P,) and the precision (P, P)
    of the part of the prior whose distance is measured.
    """
    count, size = len(tree.station_body), len(z)
    rows, descent = np.empty(tree.ancestors.shape), np.empty(len(tree.depth))
    total = np.empty((size, size))
    normal_rows(tree, state, rows, descent)
    to_subspace(tree, prior, z, rows, total)
    for i in range(size):
        total[i, i] += _MIN_DIAGONAL
    covariance = invert_positive_definite(total)
    kept = state.weight[count:].copy()
    state.weight[count:] = 0.0
    normal_rows(tree, state, rows, descent)
    state.weight[count:] = kept
    by_positions, by_nothing = trace_of_product(tree, z, rows, covariance), 0.0
    by_column = np.zeros(size - 3)
    for i in range(size - 3):
        of_prior, of_posture = prior.curvature[i], covariance[3 + i, 3:]
        for j in range(size - 3):
            by_column[j] += of_prior[j] * of_posture[j]
    for i in range(size):
        by_nothing += _MIN_DIAGONAL * covariance[i, i]
    by_prior = by_column.sum()
    by_orientations = size - by_positions - by_prior - by_nothing
    squares, numbers = np.zeros(2), np.zeros(2)
    for row in range(2 * count):
        inverse = targets.precision[row]
        if inverse > 0.0:
            kind = 0 if row < count else 1
            squares[kind] += min(inverse * state.squared[row], _MAX_SQUARE)
            numbers[kind] += 3.0
    mean, precision = experts
    offset = z[3:] - mean
    distance = np.dot(offset, np.dot(precision, offset))
    variance = np.empty(size - 3)
    for i in range(3, size):
        variance[i - 3] = covariance[i, i]
    return Posterior(
        variance,
        (squares[0] + by_positions) / max(numbers[0], 1.0) if numbers[0] > 0.0 else 1.0,
        (squares[1] + by_orientations) / max(numbers[1], 1.0) if numbers[1] > 0.0 else 1.0,
        distance,
        size - 3 - by_prior,
    )


class SelfCalibration:
    """Standard deviations of the readings of one session."""

    def __init__(self, position_sigma_m: float, orientation_sigma_rad: float) -> None:
        self._nominal = position_sigma_m, orientation_sigma_rad
        self.position_sigma_m, self.orientation_sigma_rad = self._nominal
        """Standard deviations of the readings [m], [rad]."""

    def update(self, found: Posterior) -> None:
        """Take the posterior of one frame."""
        position_m, orientation_rad = self._nominal
        self.position_sigma_m = _moved(self.position_sigma_m, found.position, position_m)
        self.orientation_sigma_rad = _moved(self.orientation_sigma_rad, found.orientation, orientation_rad)


class Trust:
    """How far one session trusts its experts."""

    def __init__(self, rate_hz: float) -> None:
        """`rate_hz` is that of the frames."""
        self._weights = np.minimum(1.0, 1.0 / (np.array([_SCALE_S, _KIND_S]) * rate_hz))
        self._distance, self._information = np.full(2, _FIRST_INFORMATION), np.full(2, _FIRST_INFORMATION)
        self.inflation = _INFLATION
        """Factor on the experts' covariance."""
        self.newness = 0.0
        """Share by which the performer is unlike the examples: 0 known, 1 new."""

    def update(self, found: Posterior) -> None:
        """Take the posterior of one frame, whose experts had the present inflation."""
        self._distance += self._weights * (self.inflation * found.distance - self._distance)
        self._information += self._weights * (max(found.information, 0.0) - self._information)
        scale, kind = np.clip(self._distance / np.maximum(self._information, 1e-3), _MIN_SCALE, _MAX_SCALE)
        self.inflation = _INFLATION * float(scale)
        share = math.log(kind / _KNOWN) / math.log(_NEW / _KNOWN)
        self.newness = min(max(share, 0.0), 1.0)


def _moved(sigma: float, ratio: float, nominal: float) -> float:
    return min(max(sigma * math.pow(max(ratio, 1e-3), _NOISE_RATE), _MIN_NOISE * nominal), _MAX_NOISE * nominal)


class LossScale:
    """The scale of one session. It starts at its upper limit."""

    def __init__(self, position_scale_m: float, rate_hz: float) -> None:
        """`position_scale_m` is the loss's scale, the upper limit [m]; `rate_hz` is that of the frames."""
        self._max_m, self._usual_m = position_scale_m, position_scale_m / _MULTIPLE
        self._weight = min(1.0, 1.0 / (_MEAN_S * rate_hz))

    @property
    def position_m(self) -> float:
        """The Lorentzian's scale for positions [m]."""
        return min(max(_MULTIPLE * self._usual_m, _MIN_SCALE_M), self._max_m)

    def update(self, targets: StationTargets, state: KinematicState) -> None:
        """Take the residuals of one frame's answer; nothing changes when no position was measured."""
        distance_m = median_distance(targets, state)
        if distance_m >= 0.0:
            self._usual_m += self._weight * (min(distance_m, self._max_m) - self._usual_m)


@compiled
def median_distance(targets: StationTargets, state: KinematicState) -> float:
    """Median distance of the measured positions from the modelled ones [m]; -1 when none was measured."""
    squared, measured = np.empty(len(targets.target_m)), 0
    for s in range(len(squared)):
        if targets.precision[s] > 0.0:
            squared[measured] = state.squared[s]
            measured += 1
    if measured == 0:
        return -1.0
    ordered = np.sort(squared[:measured])
    return float(0.5 * (np.sqrt(ordered[(measured - 1) // 2]) + np.sqrt(ordered[measured // 2])))
