"""Kernel canonical correlation analysis on a handful of pairs, as a regression: Kim et al. 2012, eq. 3 to 5.

Of m pairs only Gram matrices are needed: H of the inputs, F of the outputs, and the kernel between a new input and
those m. The answer is linear in the outputs, so what comes out is one weight for each of them; weights sum to 1.

With full rank eq. 3 is 1 in every direction. So Gram matrices are centred, and regularised as docs/methods.md E says:
(H + kH I)^-1 F (F + kF I)^-1 H x = rho^2 x, with kH = kappa times H's mean eigenvalue. Centring is done by an
orthonormal basis of what sums to 0, which leaves m - 1 dimensions and nothing singular. Eq. 4 may be held
back by the same ridge, x^T H (H + kH I) x in place of x^T H^2 x: as it is written, the last bases follow noise.
"""

from functools import lru_cache

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled

_TINY = 1e-12
"""Added to eigenvalues from 0 to 1, so that outputs may lie in fewer dimensions."""


def weights(inputs: Floats, outputs: Floats, query: Floats, *, bases: int, kappa: float, held: bool) -> Floats:
    """(m,) what each of m >= 2 outputs counts, from Gram matrices (m, m) of both sides and the query's kernel (m,).

    With `held` the ridge of eq. 3 holds eq. 4 back as well. ArithmeticError when all inputs or outputs are the same.
    """
    return _weights(inputs, outputs, query, contrasts(len(query)), bases, kappa, held)


def correlations(inputs: Floats, outputs: Floats, *, bases: int, kappa: float) -> Floats:
    """The largest canonical correlations (l,) of two Gram matrices (m, m), falling."""
    basis = contrasts(len(inputs))
    squared, _, _, _ = _solution(_centred(inputs, basis), _centred(outputs, basis), bases, kappa)
    out: Floats = np.sqrt(np.maximum(squared[::-1], 0.0))
    return out


@compiled
def regressed(
    inputs: Floats, query: Floats, outputs: Floats, basis: Floats, width: float, bases: int, kappa: float, held: bool
) -> Floats:
    """`weights` (m,) with Gaussian kernels, of inputs (m, n), a query (n,) and outputs (m, d); `basis` of `contrasts`.

    Kernels are `width` root mean square distances of two examples wide. When inputs or outputs are all the same, they
    count the same.
    """
    between, across = squared_distances(inputs), squared_distances(outputs)
    count = len(query)
    if between.sum() <= 0.0 or across.sum() <= 0.0:
        return np.full(len(inputs), 1.0 / len(inputs))
    sharpness = _sharpness(between, width)
    near = np.empty(len(inputs))
    for i in range(len(inputs)):
        far = 0.0
        for k in range(count):
            far += (inputs[i, k] - query[k]) ** 2
        near[i] = np.exp(-sharpness * far)
    kernel_x, kernel_y = np.exp(between * -sharpness), np.exp(across * -_sharpness(across, width))
    return _weights(kernel_x, kernel_y, near, basis, bases, kappa, held)


@compiled
def squared_distances(points: Floats) -> Floats:
    """(m, m) between points (m, n), exactly 0 between equal ones when all are."""
    away = points - points[0]
    gram = away @ np.ascontiguousarray(away.T)
    out: Floats = np.zeros_like(gram)
    for i in range(len(gram)):
        for j in range(i):
            out[i, j] = out[j, i] = max(gram[i, i] + gram[j, j] - 2.0 * gram[i, j], 0.0)
    return out


@compiled
def _sharpness(squared: Floats, width: float) -> float:
    """1 / 2 s^2 of a Gaussian exp(-d^2 / 2 s^2) that is `width` RMS distances wide, from squared distances (m, m)."""
    count = len(squared)
    return float(0.5 * count * (count - 1) / (width * width * squared.sum()))


@compiled
def _weights(
    inputs: Floats, outputs: Floats, query: Floats, basis: Floats, bases: int, kappa: float, held: bool
) -> Floats:
    middled = _centred(inputs, basis)
    squared, x, y, inverse = _solution(middled, _centred(outputs, basis), bases, kappa)
    new = np.ascontiguousarray(basis.T) @ (query - inputs.sum(axis=1) / len(query))
    y_across = np.ascontiguousarray(y.T)
    reduced = y_across @ (inverse @ new)  # eq. 4, held: H (H + kH I) and F y make the same diagonal of squares
    if not held:
        reduced = squared * np.linalg.solve(np.ascontiguousarray(x.T) @ x, reduced)
    reduced = np.linalg.solve(y_across @ y, reduced)  # eq. 5
    return basis @ (y @ reduced) + 1.0 / len(query)


@compiled
def _solution(inputs: Floats, outputs: Floats, bases: int, kappa: float) -> tuple[Floats, Floats, Floats, Floats]:
    """The l best pairs of bases of centred Gram matrices of n = m - 1 dimensions.

    With R = H (H + kH I)^-1 and the Cholesky factor L of F (F + kF I)^-1, the matrix L^T R L is symmetric, and its
    eigenvectors w give  F y = L w  and, up to length,  x = (H + kH I)^-1 L w. Returned are squared correlations (l,),
    rising, then H x and F y (n, l), the examples' reduced inputs and outputs, and (H + kH I)^-1 (n, n).
    """
    identity = np.eye(len(inputs))
    ridge_x, ridge_y = _ridge(inputs, kappa), _ridge(outputs, kappa)
    if ridge_x <= 0.0 or ridge_y <= 0.0:
        raise ArithmeticError("a Gram matrix is not positive definite: are all examples the same?")
    inverse = _inverse(inputs + ridge_x * identity)
    kept_x = identity - ridge_x * inverse
    kept_y = identity - ridge_y * _inverse(outputs + ridge_y * identity)
    lower = np.linalg.cholesky(0.5 * (kept_y + kept_y.T) + _TINY * identity)
    squared, vectors = np.linalg.eigh(np.ascontiguousarray(lower.T) @ (kept_x @ lower))
    first = max(len(squared) - bases, 0)
    y = lower @ np.ascontiguousarray(vectors[:, first:])
    return squared[first:], kept_x @ y, y, inverse


@compiled
def _inverse(gram: Floats) -> Floats:
    """Of a positive definite matrix (n, n), by that of its Cholesky factor."""
    lower = np.linalg.cholesky(0.5 * (gram + gram.T))
    out = np.zeros_like(lower)
    for i in range(len(lower)):
        out[i, i] = 1.0 / lower[i, i]
        for j in range(i):
            for k in range(j, i):
                out[i, j] -= lower[i, k] * out[k, j]
            out[i, j] /= lower[i, i]
    return np.ascontiguousarray(out.T) @ out


@compiled
def _ridge(gram: Floats, kappa: float) -> float:
    return float(kappa * np.trace(gram) / len(gram))


@compiled
def _centred(gram: Floats, basis: Floats) -> Floats:
    """(n, n) Gram matrix (m, m) about the mean of its m vectors."""
    return np.ascontiguousarray(basis.T) @ (gram @ basis)


@lru_cache(maxsize=64)
def contrasts(count: int) -> Floats:
    """(m, m - 1) orthonormal columns that sum to 0 (Helmert's)."""
    rank = np.arange(1, count)
    upper = np.triu(np.ones((count, count - 1)))
    upper[rank, rank - 1] = -rank
    out: Floats = upper / np.sqrt(rank * (rank + 1.0))
    return out
