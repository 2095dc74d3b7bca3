"""Self-calibration: the scales of the readings' noise and of the prior, estimated on line by maximum likelihood.

After each solve the expected squares of the whitened residuals are compared with their number. By expectation
maximisation (Dempster, Laird and Rubin 1977; for a filter: Shumway and Stoffer 1982) the expected square of a residual
is its square at the solution plus the share of the posterior's variance along it. A scale then moves towards the ratio
by a small power, so that it follows slowly.
"""

import math
from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.reconstruct.solver.kinematic_tree import KinematicState, KinematicTree
from harness.reconstruct.solver.normal_equations import StationTargets, normal_rows
from harness.reconstruct.solver.subspace import invert_positive_definite
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
