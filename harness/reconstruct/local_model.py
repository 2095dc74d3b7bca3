"""Weighted regression of what follows on what went before, in the principal subspace of a few examples.

Liu et al. 2011, eq. 2 to 8 (docs/methods.md A4): K windows x_k with their successors y_k, weighted by closeness to the
query. With few examples everything is solved in their K x K space: with X the weighted, centred windows and
X X^T = V L V^T, the principal directions of X^T X are U = X^T V L^-1/2, of the same eigenvalues L.
"""

from typing import NamedTuple, TypeVar

import numpy as np
from scipy.linalg import lapack

from harness.core.arrays import Floats, Singles

Real = TypeVar("Real", Floats, Singles)
"""Either precision; the numbers that come out have that of those that went in."""


class Forecast(NamedTuple):
    """Eq. 8: a Gaussian for each of the D numbers that follow."""

    mean: Floats
    """(D,)"""
    variance: Floats
    """(D,) of what the regression leaves unexplained."""


def closeness(squared: Floats, variance: float) -> Floats:
    """Eq. 6 with D_w = 1 / variance for squared distances (K,), ascending; of sum 1.

    The smallest distance is taken out, which changes no ratio and keeps the weights above 0.
    """
    weight = np.exp((squared[0] - squared) * (0.5 / variance))
    out: Floats = weight / weight.sum()
    return out


def forecast(away: Real, after: Real, weight: Floats, kept: float, ridge: float) -> Forecast:
    """What follows the query, from windows minus query (K, N), successors (K, D) and weights (K,) of sum 1.

    Regresses in as many principal directions as hold the share `kept` of the weighted variance, in all of them for
    1, with a `ridge` (a share of that variance, too) added to their eigenvalues.
    """
    if kept >= 1.0 and away.shape[0] > away.shape[1]:
        return _of_many(away, after, weight.astype(away.dtype), ridge)
    share: Real = weight.astype(away.dtype)
    root: Real = np.sqrt(share)[:, None]
    middle, after_middle = share @ away, share @ after
    x: Real = (away - middle) * root  # means taken out, eq. 2; W of eq. 7
    y: Real = (after - after_middle) * root
    inner: Real = x @ x.T
    whole = float(inner.trace())
    asked: Real = x @ middle  # of minus (query - mean): the query is the origin of `away`
    solve = _ridged if kept >= 1.0 else _truncated
    shift, left = solve(inner, asked, y, kept, ridge * whole, whole)
    variance = np.einsum("kd,kd->d", left, left)  # sigma_d^2 of eq. 8
    return Forecast((after_middle - shift).astype(float), variance.astype(float))


def _truncated(inner: Real, asked: Real, y: Real, kept: float, ridge: float, whole: float) -> tuple[Real, Real]:
    """Eq. 5 and 7: (D,) what to take off the mean, and (K, D) residuals."""
    eigenvalue, vector = np.linalg.eigh(inner)
    eigenvalue, vector = eigenvalue[::-1], vector[:, ::-1]
    count = int(np.searchsorted(np.cumsum(eigenvalue), kept * whole)) + 1
    eigenvalue, vector = np.maximum(eigenvalue[:count], 1e-12 * whole + 1e-30), vector[:, :count]
    damped = eigenvalue + ridge
    along = vector.T @ y
    left = y - vector @ ((eigenvalue / damped)[:, None] * along)
    return ((vector.T @ asked) / damped) @ along, left


def _ridged(inner: Real, asked: Real, y: Real, kept: float, ridge: float, whole: float) -> tuple[Real, Real]:
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


def _of_many(away: Real, after: Real, share: Real, ridge: float) -> Forecast:
    """Eq. 4 with a ridge, in the space of the N numbers: cheaper when examples outnumber them.

    One product of all that is known with itself holds X^T X, X^T y and y^T y; residuals need not be worked out.
    """
    count = away.shape[1]
    middle, after_middle = share @ away, share @ after
    known = np.empty((len(share), count + after.shape[1]), away.dtype)
    np.subtract(away, middle, out=known[:, :count])  # means taken out, eq. 2
    np.subtract(after, after_middle, out=known[:, count:])
    known *= np.sqrt(share)[:, None]  # W of eq. 7
    product = known.T @ known
    outer, mixed = product[:count, :count], product[:count, count:]
    least = max(ridge, 1e-6 if product.dtype == np.float32 else 1e-9) * float(outer.trace()) + 1e-30
    damped = outer.astype(float)
    damped.reshape(-1)[:: count + 1] += least
    factor, _ = lapack.dpotrf(damped, lower=1, clean=0, overwrite_a=1)
    slope, _ = lapack.dpotrs(factor, mixed, lower=1)
    explained = np.einsum("nd,nd->d", slope, mixed + least * slope)  # |y|^2 - |y - x slope|^2
    variance = np.maximum(product.diagonal()[count:] - explained, 0.0)  # sigma_d^2 of eq. 8
    return Forecast(after_middle - middle @ slope, variance)
