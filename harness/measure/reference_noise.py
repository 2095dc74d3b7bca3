"""Errors of a reference in a registration: what more of the same noise would do to it (Cook and Stefanski 1994).

Noise of the reference is in the derivatives as well as in the residuals. It makes estimates smaller, such as the error
along the velocity, which no residual shows. Noise of the stated size is added once more, several times, and the
registration is fitted again, also with twice that variance: a parabola leads back to no noise. The scatter enters the
covariance, and so does the difference from a straight line. The added noise is as quick or slow as what the
registration left, of which that of the reference is a part.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.motion import count_steps
from harness.core.seeds import generator
from harness.measure.gauss_markov import ErrorProcess
from harness.measure.pose_series import TruthPoses, TruthSpline
from harness.measure.registration_fit import (
    FittedRegistration,
    StationNoise,
    refit_residuals,
    refit_steps,
)
from harness.measure.station_grid import StationGrid

DRAWS = 12
"""Number of references with added noise of each size."""
_MOST_NOISE = math.sqrt(2.0)
"""Largest added noise, in standard deviations of what the registration left."""


def correct_for_reference(
    fit: FittedRegistration,
    grids: Sequence[StationGrid],
    truths: Sequence[TruthPoses],
    noise: Sequence[tuple[float, float]],
    fixed: Sequence[int] = (),
    *,
    plain: bool = False,
) -> FittedRegistration:
    """The registration of S stations without the bias by noise of their references, and with its scatter.

    `noise` holds standard deviations of each axis of positions [m] and of rotation vectors [rad]. More than a station's
    residuals have is not added.
    """
    exact = [TruthSpline(truth) for truth in truths]
    start = refit_steps(fit, grids, exact, fixed, plain=plain)
    once, twice = np.zeros((DRAWS, len(start))), np.zeros((DRAWS, len(start)))
    for steps, factor in ((once, 1.0), (twice, math.sqrt(2.0))):
        rng = generator(0, "reference noise")
        for draw in range(DRAWS):
            noisy = [
                TruthSpline(_with_noise(truth, processes, (factor * place_m, factor * turn_rad), rng))
                for truth, processes, (place_m, turn_rad) in zip(truths, fit.noise, noise, strict=True)
            ]
            steps[draw] = refit_steps(fit, grids, noisy, fixed, plain=plain) - start
    state = fit.state.moved(np.mean(twice - 3.0 * once, axis=0))
    scatter = np.cov(once.T) + np.cov((twice - 3.0 * once).T) / DRAWS
    scatter += np.diag(np.mean(twice - 2.0 * once, axis=0) ** 2)
    residuals = refit_residuals(state, grids, exact)
    return replace(fit, state=state, covariance=fit.covariance + scatter, residuals=residuals)


def _with_noise(
    truth: TruthPoses, processes: StationNoise, size: tuple[float, float], rng: np.random.Generator
) -> TruthPoses:
    place, tilt, yaw = processes
    turn_rad = np.concatenate(
        [_draw(tilt, size[1], truth.time_s, 2, rng), _draw(yaw, size[1], truth.time_s, 1, rng)], axis=1
    )
    place_m = truth.position_m + _draw(place, size[0], truth.time_s, 3, rng)
    return TruthPoses(truth.time_s, place_m, rotations.multiply(truth.world_from_body, rotations.exp(turn_rad)))


def _draw(process: ErrorProcess, size: float, time_s: Floats, axes: int, rng: np.random.Generator) -> Floats:
    """Noise (N, axes) at rising times with the standard deviation `size`, or that of the process if it is smaller."""
    from scipy.signal import lfilter

    step_s = float(np.median(np.diff(time_s)))
    count = count_steps(float(time_s[-1] - time_s[0]), step_s, "Times of the reference") + 2
    kept = math.exp(-step_s / process.correlation_s)
    pushes = math.sqrt(1.0 - kept**2) * rng.normal(size=(count, axes))
    pushes[0] /= math.sqrt(1.0 - kept**2)
    even = lfilter([1.0], [1.0, -kept], pushes, axis=0)
    grid_s = time_s[0] + step_s * np.arange(count)
    drift = np.stack([np.interp(time_s, grid_s, column) for column in even.T], axis=1)
    whole = process.drift * drift + process.white * rng.normal(size=(len(time_s), axes))
    factor = min(size / max(math.hypot(process.drift, process.white), 1e-300), _MOST_NOISE)
    out: Floats = factor * whole
    return out
