"""Scales that are estimated on line: those of the readings' noise, of the prior, and of the robust loss.

After each solve the expected squares of the whitened residuals are compared with their number. By expectation
maximisation (Dempster, Laird and Rubin 1977; for a filter: Shumway and Stoffer 1982) the expected square of a residual
is its square at the solution plus the share of the posterior's variance along it. A scale then moves towards the ratio
by a small power, so that it follows slowly.

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
_NOISE_RATE, _PRIOR_RATE = 0.1, 0.1
"""Powers of the ratios by which the standard deviations of the noise and the prior's variance move in a frame."""
_PRIOR_FREEDOM = 36.0
"""Number of directions whose squares the prior's ratio is taken over: a smaller one reacts more."""
_MIN_NOISE, _MAX_NOISE = 0.1, 0.8
"""Limits of the standard deviations of the noise, as shares of those of the loss."""
_MIN_PRIOR, _MAX_PRIOR = 0.5, 100.0
"""Limits of the factor on the prior's covariance."""
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
    prior: float
    """Expected squared Mahalanobis distance from the prior's mean, less its number of directions."""


@compiled
def posterior(
    tree: KinematicTree, targets: StationTargets, state: KinematicState, prior: Subspace, z: Floats
) -> Posterior:
    """The posterior at a solution z (3 + P,), for which `state` is evaluated: Laplace's approximation.

    The prior is a Gaussian about its mean: its linear term is 0.
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
        precision = targets.precision[row]
        if precision > 0.0:
            kind = 0 if row < count else 1
            squares[kind] += min(precision * state.squared[row], _MAX_SQUARE)
            numbers[kind] += 3.0
    offset = z[3:] - prior.mean
    away = np.dot(offset, np.dot(prior.curvature, offset))
    variance = np.empty(size - 3)
    for i in range(3, size):
        variance[i - 3] = covariance[i, i]
    return Posterior(
        variance,
        (squares[0] + by_positions) / max(numbers[0], 1.0) if numbers[0] > 0.0 else 1.0,
        (squares[1] + by_orientations) / max(numbers[1], 1.0) if numbers[1] > 0.0 else 1.0,
        away + by_prior - (size - 3),
    )


class SelfCalibration:
    """Scales of one session."""

    def __init__(self, position_sigma_m: float, orientation_sigma_rad: float) -> None:
        self._nominal = position_sigma_m, orientation_sigma_rad
        self.position_sigma_m, self.orientation_sigma_rad = self._nominal
        """Standard deviations of the readings [m], [rad]."""
        self.prior = 1.0
        """Factor on the prior's covariance."""

    def update(self, found: Posterior) -> None:
        """Take the posterior of one frame."""
        position_m, orientation_rad = self._nominal
        self.position_sigma_m = _moved(self.position_sigma_m, found.position, position_m)
        self.orientation_sigma_rad = _moved(self.orientation_sigma_rad, found.orientation, orientation_rad)
        ratio = max(found.prior / _PRIOR_FREEDOM + 1.0, 1e-3)
        self.prior = min(max(self.prior * math.pow(ratio, _PRIOR_RATE), _MIN_PRIOR), _MAX_PRIOR)


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
