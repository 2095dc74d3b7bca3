"""Weighted regression of successors on windows, in the principal subspace of a few examples.

Liu et al. 2011, eq. 2 to 8 (docs/papers.md A4): K windows x_k with successors y_k, weighted by closeness to the query.
The result is a Gaussian prediction of the query's successor,
with the residuals' full covariance. With few examples the regression is solved in their K x K
space: if X holds the weighted, centred windows and X X^T = V L V^T, then X^T X has the principal directions
U = X^T V L^-1/2 and the same eigenvalues L. With more examples than columns it is solved in the space of the columns.
"""

from typing import NamedTuple, TypeVar

import numpy as np
from scipy.linalg import lapack

from harness.core.arrays import Floats, Singles
from harness.core.compiled import compiled

Real = TypeVar("Real", Floats, Singles)
"""Single or double precision; results have the precision of the arguments."""


class Forecast(NamedTuple):
    """A Gaussian of the D numbers of the successor. Eq. 8 uses the diagonal of its covariance alone."""

    mean: Floats
    """(D,) predicted successor."""
    covariance: Floats
    """(D, D) residual covariance of the regression."""


def neighbour_weights(squared: Floats | Singles, variance: float) -> Floats:
    """(K,) weights of eq. 6 with D_w = 1 / variance, for squared distances (K,) in ascending order; of sum 1.

    The smallest distance is subtracted, which changes no ratio and avoids underflow.
    """
    weight = np.exp((squared[0] - squared) * (0.5 / variance))
    out: Floats = weight / weight.sum()
    return out


def forecast(offsets: Real, after: Real, weight: Floats, variance_kept: float, ridge: float) -> Forecast:
    """Prediction of the query's successor from windows minus query (K, N), successors (K, D), weights (K,) of sum 1.

    The regression uses the principal directions that hold the share `variance_kept` of the weighted variance; 1 uses
    all of them. `ridge`, a share of that variance, is added to their eigenvalues.
    """
    if variance_kept >= 1.0 and offsets.shape[0] > offsets.shape[1]:
        return _primal_ridge_regression(offsets, after, weight.astype(offsets.dtype), ridge)
    share: Real = weight.astype(offsets.dtype)
    root: Real = np.sqrt(share)[:, None]
    middle, after_middle = share @ offsets, share @ after
    x: Real = (offsets - middle) * root  # centred, eq. 2; W of eq. 7
    y: Real = (after - after_middle) * root
    inner: Real = x @ x.T
    total = float(inner.trace())
    query_row: Real = x @ middle  # minus (query - mean): the query is the origin of `offsets`
    solve = _dual_ridge_regression if variance_kept >= 1.0 else _principal_component_regression
    shift, residual = solve(inner, query_row, y, variance_kept, ridge * total, total)
    covariance = residual.T @ residual  # its diagonal is sigma_d^2 of eq. 8
    return Forecast((after_middle - shift).astype(float), covariance.astype(float))


def _principal_component_regression(
    inner: Real, query_row: Real, y: Real, variance_kept: float, ridge: float, total: float
) -> tuple[Real, Real]:
    """Eq. 5 and 7 with the leading directions: (D,) shift to subtract from the mean, and (K, D) residuals."""
    eigenvalue, vector = np.linalg.eigh(inner)
    eigenvalue, vector = eigenvalue[::-1], vector[:, ::-1]
    count = int(np.searchsorted(np.cumsum(eigenvalue), variance_kept * total)) + 1
    eigenvalue, vector = np.maximum(eigenvalue[:count], 1e-12 * total + 1e-30), vector[:, :count]
    damped = eigenvalue + ridge
    along = vector.T @ y
    residual = y - vector @ ((eigenvalue / damped)[:, None] * along)
    return ((vector.T @ query_row) / damped) @ along, residual


def _dual_ridge_regression(
    inner: Real, query_row: Real, y: Real, variance_kept: float, ridge: float, total: float
) -> tuple[Real, Real]:
    """Eq. 7 with all directions: Lambda^-1 becomes (Lambda + ridge)^-1, and no eigenvectors are needed.

    Returns (D,) the shift to subtract from the mean, and (K, D) residuals.
    """
    single = inner.dtype == np.float32
    factorise, invert = (lapack.spotrf, lapack.strtri) if single else (lapack.dpotrf, lapack.dtrtri)
    inner = inner.copy()
    inner.reshape(-1)[:: len(inner) + 1] += max(ridge, (1e-6 if single else 1e-13) * total) + 1e-30
    factor, _ = factorise(inner, lower=1, clean=1, overwrite_a=1)
    inverse, _ = invert(factor, lower=1, overwrite_c=1)  # of L in X X^T + ridge = L L^T
    whitened = inverse @ y
    shift = (inverse @ query_row) @ whitened
    return shift, ridge * (inverse.T @ whitened)


def _primal_ridge_regression(offsets: Real, after: Real, share: Real, ridge: float) -> Forecast:
    """Eq. 4 with a ridge, in the space of the N columns: cheaper when there are more examples than columns.

    The Gram matrix of the columns X, y and 1, times the roots of the weights, holds all second moments and the means.
    """
    root: Real = np.sqrt(share)
    columns = _weighted_columns(offsets, after, root)
    least = max(ridge, 1e-6 if offsets.dtype == np.float32 else 1e-9)
    shift, covariance = _solve_primal(columns.T @ columns, offsets[0], least)  # numpy sees the symmetry: half the work
    return Forecast(after[0] + shift, covariance)


@compiled
def _weighted_columns(offsets: Real, after: Real, root: Real) -> Real:
    """X, y and 1 (K, N + D + 1), each row times its `root` (K,).

    X and y are relative to the nearest example's, which keeps single precision accurate for distant queries.
    """
    size, following = offsets.shape[1], after.shape[1]
    columns = np.empty((len(offsets), size + following + 1), offsets.dtype)
    for k in range(len(offsets)):
        x, y, scale = columns[k, :size], columns[k, size:], root[k]
        for i in range(size):
            x[i] = scale * (offsets[k, i] - offsets[0, i])
        for i in range(following):
            y[i] = scale * (after[k, i] - after[0, i])
        y[following] = scale
    return columns


@compiled
def _solve_primal(product: Real, first: Real, ridge: float) -> tuple[Floats, Floats]:
    """Mean (D,) relative to the nearest example's y, and covariance (D, D), of eq. 8; x is relative to `first` (N,)."""
    size, both = len(first), len(product) - 1
    following, trace = both - size, 0.0
    middle = product[both].astype(np.float64)
    rows, covariance = np.empty((size, both)), np.empty((following, following))
    for i in range(size):  # centred, eq. 2
        for j in range(following):
            rows[i, j] = product[i, size + j] - middle[i] * middle[size + j]
        for j in range(i + 1):
            rows[i, following + j] = product[i, j] - middle[i] * middle[j]
        trace += rows[i, following + i]
    for i in range(following):
        for j in range(following):
            covariance[i, j] = product[size + i, size + j] - middle[size + i] * middle[size + j]
    mixed, least = rows[:, :following].copy(), ridge * trace + 1e-30
    for i in range(size):
        rows[i, following + i] += least
    _solve_rows(rows)
    slope = rows[:, :following].copy()
    mean = middle[size:both] - np.dot(first.astype(np.float64) + middle[:size], slope)
    covariance -= np.dot(slope.T, mixed + least * slope)  # of y - x slope
    for i in range(following):
        covariance[i, i] = max(covariance[i, i], 0.0)
    return mean, covariance


@compiled
def _solve_rows(rows: Floats) -> None:
    """Solve A X = B in place, for rows [B A] (N, D + N), of which the lower triangle of positive definite A is used.

    X replaces B. The rows of A become those of its factor L^T D L, from the last one.
    """
    count, width = len(rows), rows.shape[1] - len(rows)
    for k in range(count - 1, -1, -1):
        pivot, scale = rows[k], 1.0 / rows[k, width + k]
        for i in range(k):
            row, share = rows[i], pivot[width + i] * scale
            for j in range(width + i + 1):
                row[j] -= share * pivot[j]
    for k in range(count):
        solution, scale = rows[k, :width], 1.0 / rows[k, width + k]
        for i in range(k):
            known, share = rows[i], rows[k, width + i]
            for j in range(width):
                solution[j] -= share * known[j]
        for j in range(width):
            solution[j] *= scale
