"""Errors of a reference in a registration: what more of the same noise would do to it (Cook and Stefanski 1994).

Noise of the reference is in the derivatives as well as in the residuals. It makes estimates smaller, such as the error
along the velocity, which no residual shows. Noise of the stated size is added once more, several times, and the
registration is fitted again. The mean change is taken back, and the scatter enters the covariance. The added noise is
as quick or slow as what the registration left, of which that of the reference is a part.
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
    StationGrid,
    StationNoise,
    refit_residuals,
    refit_steps,
)

DRAWS = 12
"""Number of references with added noise."""


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
    rng = generator(0, "reference noise")
    exact = [TruthSpline(truth) for truth in truths]
    start, steps = refit_steps(fit, grids, exact, fixed, plain=plain), []
    for _ in range(DRAWS):
        noisy = [
            TruthSpline(_with_noise(truth, processes, own, rng))
            for truth, processes, own in zip(truths, fit.noise, noise, strict=True)
        ]
        steps.append(refit_steps(fit, grids, noisy, fixed, plain=plain) - start)
    state = fit.state.moved(-np.mean(steps, axis=0))
    scatter = np.cov(np.array(steps).T) * (1.0 + 1.0 / DRAWS)
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
    factor = min(size / max(math.hypot(process.drift, process.white), 1e-300), 1.0)
    out: Floats = factor * whole
    return out
