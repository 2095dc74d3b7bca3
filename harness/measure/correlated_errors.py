"""Least squares with errors that are white noise plus a Gauss-Markov process.

A Kalman filter turns such errors into independent ones of unit variance. The same linear filter is applied to the
derivatives, so that ordinary least squares of both is generalised least squares; samples that are left out need no
filling.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.measure.gauss_markov import series_log_likelihood
from harness.measure.whitening import kalman_gains, whiten

_LEAST, _MOST = np.log([1e-9, 1e-9, 0.05]), np.log([10.0, 10.0, 30.0])


@dataclass(frozen=True)
class ErrorProcess:
    """Standard deviations of white noise and of a Gauss-Markov process, and its correlation time."""

    white: float
    drift: float
    correlation_s: float

    def whiten(self, values: Floats, valid: Bools, period_s: float) -> Floats:
        """Filter the columns (N, C) of one axis, sampled every `period_s` [s]; rows that are not valid become zero."""
        correlation = float(np.exp(-period_s / self.correlation_s))
        gain, deviation = kalman_gains(valid, correlation, self.drift**2, self.white**2)
        return whiten(np.ascontiguousarray(values), valid, gain, deviation, correlation)


def fit_process(errors: Floats, valid: Bools, period_s: float) -> ErrorProcess:
    """Fit the process to errors (N, A) of A axes by maximum likelihood."""
    from scipy import optimize

    known = np.where(valid[:, None], errors, 0.0)
    spread = float(np.sqrt(np.mean(known[valid] ** 2))) if valid.any() else 0.0
    both = valid[1:] & valid[:-1]
    step = float(np.sqrt(np.mean((errors[1:] - errors[:-1])[both] ** 2) / 2.0)) if both.any() else spread

    def cost(logarithms: Floats) -> float:
        bounded = np.clip(logarithms, _LEAST, _MOST)
        white, drift, correlation_s = np.exp(bounded)
        correlation = float(np.exp(-period_s / correlation_s))
        fit = series_log_likelihood(known, valid, correlation, float(drift**2), float(white**2))
        return float(np.sum((logarithms - bounded) ** 2)) - float(fit) / max(int(valid.sum()), 1)

    start: Floats = np.log(np.maximum([0.7 * min(step, spread), spread, 1.0], 1e-8))
    corners = np.concatenate([start[None], start + np.diag([-0.5, 0.5, 0.5])])
    options: dict[str, Any] = {"initial_simplex": corners, "xatol": 0.01, "fatol": 1e-5, "maxiter": 300}
    found: Any = optimize.minimize(cost, start, method="Nelder-Mead", options=options)  # type: ignore[call-overload]  # its stubs know no simplex
    white, drift, correlation_s = np.exp(np.clip(found.x, _LEAST, _MOST)).tolist()
    return ErrorProcess(white, drift, correlation_s)
