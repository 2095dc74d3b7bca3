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
from scipy.linalg.lapack import dgesv, dposv, dpotrf, dsyevd

from harness.core.arrays import Floats

_TINY = 1e-12
"""Added to eigenvalues from 0 to 1, so that outputs may lie in fewer dimensions."""


def gaussian(squared: Floats, width: float) -> tuple[Floats, float]:
    """The kernel exp(-d^2 / 2 s^2) of squared distances (m, m), and 1 / 2 s^2; s is `width` RMS distances of two."""
    count = len(squared)
    mean = float(squared.sum()) / max(count * (count - 1), 1)
    sharpness = 0.5 / (width * width * mean) if mean > 0.0 else 0.0
    return np.exp(squared * -sharpness), sharpness


def squared_distances(points: Floats) -> Floats:
    """(m, m) between points (m, n), given near their own middle."""
    gram = points @ points.T
    square = gram.diagonal()
    out: Floats = np.maximum(square + square[:, None] - 2.0 * gram, 0.0)
    return out


def weights(inputs: Floats, outputs: Floats, query: Floats, *, bases: int, kappa: float, held: bool) -> Floats:
    """(m,) what each of m >= 2 outputs counts, from Gram matrices (m, m) of both sides and the query's kernel (m,).

    With `held` the ridge of eq. 3 holds eq. 4 back as well. ArithmeticError when all inputs or outputs are the same.
    """
    basis = _contrasts(len(query))
    h = basis.T @ inputs
    new: Floats = basis.T @ query - h.mean(axis=1)
    solution = _Solution(h @ basis, basis.T @ outputs @ basis, bases, kappa)
    out: Floats = basis @ solution.coefficients(new, held)
    out += 1.0 / len(query)
    return out


def correlations(inputs: Floats, outputs: Floats, *, bases: int, kappa: float) -> Floats:
    """The largest canonical correlations (l,) of two Gram matrices (m, m), falling."""
    basis = _contrasts(len(inputs))
    squared = _Solution(basis.T @ inputs @ basis, basis.T @ outputs @ basis, bases, kappa).squared_correlation
    out: Floats = np.sqrt(np.maximum(squared[::-1], 0.0))
    return out


class _Solution:
    """The l best pairs of bases of centred Gram matrices of n = m - 1 dimensions.

    With R = H (H + kH I)^-1 and the Cholesky factor L of F (F + kF I)^-1, the matrix L^T R L is symmetric, and its
    eigenvectors w give  F y = L w  and, up to length,  x = (H + kH I)^-1 L w.
    """

    def __init__(self, inputs: Floats, outputs: Floats, bases: int, kappa: float) -> None:
        identity = np.eye(len(inputs))
        inverse, kept_x, ridge = _regularised(inputs, kappa, identity)
        _, kept_y, _ = _regularised(outputs, kappa, identity)
        lower, _ = dpotrf(kept_y + _TINY * identity, lower=1, clean=1)
        squared, vectors, _ = dsyevd(lower.T @ kept_x @ lower, lower=1)
        kept = min(bases, len(squared))
        self.squared_correlation: Floats = squared[-kept:]
        self._y = lower @ vectors[:, -kept:]  # F y: the reduced outputs of the examples
        self._x = kept_x @ self._y  # H x: their reduced inputs
        self._bases = inverse @ self._y  # x itself
        self._ridge = ridge

    def coefficients(self, new: Floats, held: bool) -> Floats:
        """(n,) of the centred outputs, for a centred kernel vector (n,)."""
        x, y, bases = self._x, self._y, self._bases
        square = x.T @ x
        if held:
            square += self._ridge * (bases.T @ x)
        reduced_y = (y.T @ x) @ _lu(square, bases.T @ new)  # eq. 4
        out: Floats = y @ _lu(y.T @ y, reduced_y)  # eq. 5
        return out


def _regularised(gram: Floats, kappa: float, identity: Floats) -> tuple[Floats, Floats, float]:
    """(G + k I)^-1, G (G + k I)^-1 and k."""
    ridge = kappa * float(gram.trace()) / len(gram)
    _, inverse, failed = dposv(gram + ridge * identity, identity, lower=1)
    if failed:
        raise ArithmeticError("a Gram matrix is not positive definite: are all examples the same?")
    return inverse, identity - ridge * inverse, ridge


def _lu(matrix: Floats, right: Floats) -> Floats:
    """The solution (l,) of a system (l, l)."""
    _, _, out, failed = dgesv(matrix, right)
    if failed:
        raise ArithmeticError("fewer independent examples than bases")
    solution: Floats = out
    return solution


@lru_cache(maxsize=64)
def _contrasts(count: int) -> Floats:
    """(m, m - 1) orthonormal columns that sum to 0 (Helmert's)."""
    rank = np.arange(1, count)
    upper = np.triu(np.ones((count, count - 1)))
    upper[rank, rank - 1] = -rank
    out: Floats = upper / np.sqrt(rank * (rank + 1.0))
    return out
