"""Weighted regression of what follows on what went before, in the principal subspace of a few examples.

Liu et al. 2011, eq. 2 to 8 (docs/methods.md A4): K windows x_k with their successors y_k, weighted by closeness to the
query. With few examples everything is solved in their K x K space: with X the weighted, centred windows and
X X^T = V L V^T, the principal directions of X^T X are U = X^T V L^-1/2, of the same eigenvalues L.
"""

from typing import NamedTuple, TypeVar

import numpy as np
from scipy.linalg import lapack

from harness.core.arrays import Floats, Singles
from harness.core.compiled import compiled

Real = TypeVar("Real", Floats, Singles)
"""Either precision; the numbers that come out have that of those that went in."""


class Forecast(NamedTuple):
    """Eq. 8: a Gaussian for each of the D numbers that follow."""

    mean: Floats
    """(D,)"""
    variance: Floats
    """(D,) of what the regression leaves unexplained."""


def neighbour_weights(squared: Floats | Singles, variance: float) -> Floats:
    """Eq. 6 with D_w = 1 / variance for squared distances (K,), ascending; of sum 1.

    The smallest distance is taken out, which changes no ratio and keeps the weights above 0.
    """
    weight = np.exp((squared[0] - squared) * (0.5 / variance))
    out: Floats = weight / weight.sum()
    return out


def forecast(away: Real, after: Real, weight: Floats, variance_kept: float, ridge: float) -> Forecast:
    """What follows the query, from windows minus query (K, N), successors (K, D) and weights (K,) of sum 1.

    Regresses in as many principal directions as hold the share `variance_kept` of the weighted variance, in all of them for
    1, with a `ridge` (a share of that variance, too) added to their eigenvalues.
    """
    if variance_kept >= 1.0 and away.shape[0] > away.shape[1]:
        return _primal_ridge_regression(away, after, weight.astype(away.dtype), ridge)
    share: Real = weight.astype(away.dtype)
    root: Real = np.sqrt(share)[:, None]
    middle, after_middle = share @ away, share @ after
    x: Real = (away - middle) * root  # means taken out, eq. 2; W of eq. 7
    y: Real = (after - after_middle) * root
    inner: Real = x @ x.T
    whole = float(inner.trace())
    asked: Real = x @ middle  # of minus (query - mean): the query is the origin of `away`
    solve = _dual_ridge_regression if variance_kept >= 1.0 else _principal_component_regression
    shift, left = solve(inner, asked, y, variance_kept, ridge * whole, whole)
    variance = np.einsum("kd,kd->d", left, left)  # sigma_d^2 of eq. 8
    return Forecast((after_middle - shift).astype(float), variance.astype(float))


def _principal_component_regression(
    inner: Real, asked: Real, y: Real, variance_kept: float, ridge: float, whole: float
) -> tuple[Real, Real]:
    """Eq. 5 and 7: (D,) what to take off the mean, and (K, D) residuals."""
    eigenvalue, vector = np.linalg.eigh(inner)
    eigenvalue, vector = eigenvalue[::-1], vector[:, ::-1]
    count = int(np.searchsorted(np.cumsum(eigenvalue), variance_kept * whole)) + 1
    eigenvalue, vector = np.maximum(eigenvalue[:count], 1e-12 * whole + 1e-30), vector[:, :count]
    damped = eigenvalue + ridge
    along = vector.T @ y
    left = y - vector @ ((eigenvalue / damped)[:, None] * along)
    return ((vector.T @ asked) / damped) @ along, left


def _dual_ridge_regression(
    inner: Real, asked: Real, y: Real, variance_kept: float, ridge: float, whole: float
) -> tuple[Real, Real]:
    """The same with all directions: Lambda^-1 becomes (Lambda + ridge)^-1, and no eigenvectors are needed."""
    single = inner.dtype == np.float32
    factorise, invert = (lapack.spotrf, lapack.strtri) if single else (lapack.dpotrf, lapack.dtrtri)
    inner = inner.copy()
    inner.reshape(-1)[:: len(inner) + 1] += max(ridge, (1e-6 if single else 1e-13) * whole) + 1e-30
    factor, _ = factorise(inner, lower=1, clean=1, overwrite_a=1)
    inverse, _ = invert(factor, lower=1, overwrite_c=1)  # of L in X X^T + ridge = L L^T
    turned = inverse @ y
    shift = (inverse @ asked) @ turned
    return shift, ridge * (inverse.T @ turned)


def _primal_ridge_regression(away: Real, after: Real, share: Real, ridge: float) -> Forecast:
    """Eq. 4 with a ridge, in the space of the N numbers: cheaper when examples outnumber them.

    The product of W X (K, N) with all that is known, X, y and 1 (K, N + D + 1), holds X^T W X, X^T W y and the mean.
    """
    weighed, known, after_middle, squares = _weighted_moments(away, after, share)
    least = max(ridge, 1e-6 if away.dtype == np.float32 else 1e-9)
    shift, variance = _solve_primal(known.T @ weighed, after_middle, squares, away[0], least)
    return Forecast(after[0] + shift, variance)


@compiled
def _weighted_moments(away: Real, after: Real, share: Real) -> tuple[Real, Real, Real, Real]:
    """W X (K, N); X, y and 1 (K, N + D + 1); weighted mean (D,) of y and of its squares (D,).

    Both are taken about the nearest example's, so that single precision loses little however far off the query is.
    """
    count, size, following = len(away), away.shape[1], after.shape[1]
    weighed, known = np.empty_like(away), np.empty((count, size + following + 1), away.dtype)
    middle, squares = np.zeros((2, following), away.dtype)
    for k in range(count):
        row = known[k]
        for i in range(size):
            row[i] = away[k, i] - away[0, i]
            weighed[k, i] = share[k] * row[i]
        for i in range(following):
            value = after[k, i] - after[0, i]
            row[size + i] = value
            middle[i] += share[k] * value
            squares[i] += share[k] * value * value
        row[size + following] = 1.0
    return weighed, known, middle, squares


@compiled
def _solve_primal(product: Real, after_middle: Real, squares: Real, first: Real, ridge: float) -> tuple[Floats, Floats]:
    """Eq. 8's mean (D,), about the nearest example's y, and variance (D,); x is about the nearest's `first` (N,)."""
    size, following = product.shape[1], len(squares)
    middle = product[size + following].astype(np.float64)
    outer, slope = np.empty((size, size)), np.empty((size, following))
    for i in range(size):  # means taken out, eq. 2
        for j in range(size):
            outer[i, j] = product[i, j] - middle[i] * middle[j]
        for j in range(following):
            slope[i, j] = product[size + j, i] - middle[i] * after_middle[j]
    mixed, least = slope.copy(), ridge * np.trace(outer) + 1e-30
    for i in range(size):
        outer[i, i] += least
    _cholesky_solve(outer, slope)
    mean, variance = np.empty(following), np.empty(following)
    for j in range(following):
        mean[j], variance[j] = after_middle[j], squares[j] - np.float64(after_middle[j]) ** 2
    for i in range(size):
        for j in range(following):
            mean[j] -= (first[i] + middle[i]) * slope[i, j]
            variance[j] -= slope[i, j] * (mixed[i, j] + least * slope[i, j])  # |y|^2 - |y - x slope|^2
    return mean, np.maximum(variance, 0.0)  # sigma_d^2 of eq. 8


@compiled
def _cholesky_solve(matrix: Floats, rows: Floats) -> None:
    """Puts A^-1 B in the place of B (N, D), and Cholesky's factor in that of A (N, N), positive definite."""
    count, width = rows.shape
    for i in range(count):
        for k in range(i):
            share = matrix[i, k] * matrix[k, k]  # the diagonal holds the factor's reciprocals
            matrix[i, k] = share
            for j in range(k + 1, i + 1):
                matrix[i, j] -= share * matrix[j, k]
            for j in range(width):
                rows[i, j] -= share * rows[k, j]
        matrix[i, i] = 1.0 / np.sqrt(matrix[i, i])
        for j in range(width):
            rows[i, j] *= matrix[i, i]
    for i in range(count - 1, -1, -1):
        for j in range(width):
            rows[i, j] *= matrix[i, i]
        for k in range(i):
            for j in range(width):
                rows[k, j] -= matrix[i, k] * rows[i, j]
