"""Weighted regression of what follows on what went before, in the principal subspace of a few examples.

Liu et al. 2011, eq. 2 to 8 (docs/methods.md A4): K windows x_k with their successors y_k, weighted by closeness to the
query. Everything is solved in the K x K space of the examples: with X the weighted, centred windows and
X X^T = V L V^T, the principal directions of X^T X are U = X^T V L^-1/2, of the same eigenvalues.
"""

from typing import NamedTuple

import numpy as np

from harness.core.arrays import Floats


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
    weight = np.exp(-0.5 / variance * (squared - squared[0]))
    out: Floats = weight / weight.sum()
    return out


def forecast(away: Floats, after: Floats, weight: Floats, kept: float, ridge: float) -> Forecast:
    """What follows the query, from windows minus query (K, N), successors (K, D) and weights (K,) of sum 1.

    Regresses in as many principal directions as hold the share `kept` of the weighted variance, and with a `ridge`
    (in the same shares) on their eigenvalues.
    """
    root = np.sqrt(weight)[:, None]
    middle, after_middle = weight @ away, weight @ after
    x, y = (away - middle) * root, (after - after_middle) * root  # means taken out, eq. 2; W of eq. 7
    eigenvalue, vector = np.linalg.eigh(x @ x.T)
    eigenvalue, vector = eigenvalue[::-1], vector[:, ::-1]
    whole = float(eigenvalue.sum())
    count = int(np.searchsorted(np.cumsum(eigenvalue), kept * whole)) + 1
    eigenvalue, vector = np.maximum(eigenvalue[:count], 1e-12 * whole + 1e-300), vector[:, :count]
    damped = eigenvalue + ridge * whole
    along = vector.T @ y
    # beta_w^T (Q - mean x), eq. 7: the query itself is the origin of `away`
    mean = after_middle - ((vector.T @ (x @ middle)) / damped) @ along
    left = y - vector @ ((eigenvalue / damped)[:, None] * along)
    effective = 1.0 / float(weight @ weight)  # number of examples that the weights leave
    spent = min(float(count + 1), effective - 1.0)
    return Forecast(mean, np.vecdot(left.T, left.T) * effective / (effective - spent))
