"""White noise and first-order Gauss-Markov noise of stations at rest, by maximum likelihood.

Each axis is the sum of white noise, of a Gauss-Markov process (`components.drift`) and of a constant. The likelihood is
exact, by a Kalman filter with one state, so that gaps and masked samples need no filling. The constant is estimated by
generalised least squares, with the correction of restricted maximum likelihood (Patterson & Thompson 1971, Biometrika
58). Intervals come from the observed information of the logarithms.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.compiled import compiled
from harness.errors import BadInput
from harness.measure.measured import NORMAL_QUANTILE, Measured
from harness.measure.static_series import StaticSeries

NOISE_KEYS = (
    "components.white.position_m",
    "components.drift.position_m",
    "components.white.orientation_rad",
    "components.drift.pitch_roll_rad",
    "components.drift.yaw_rad",
    "components.drift.correlation_s",
)
"""Parameters of the fit, in the order of its vector of logarithms."""
_LEAST, _MOST = (
    np.log([1e-7, 1e-7, 1e-8, 1e-8, 1e-8, 0.02]),
    np.log([0.5, 0.5, 0.5, 0.5, 0.5, 300.0]),
)
"""Bounds of the logarithms; a parameter at its lower bound cannot be told from none."""
MOST_SAMPLES = 400_000
"""Samples that the likelihood of all stations uses; of longer recordings pieces are taken, evenly spread."""
_PIECE_S = 60.0
_STEP = 0.02
"""Step of the logarithms in numerical derivatives."""


@dataclass(frozen=True)
class NoiseFit:
    """Parameters by `NOISE_KEYS`, of all stations together and of each."""

    all_stations: Mapping[str, Measured]
    by_station: Mapping[str, Mapping[str, Measured]]
    samples: int
    """Number of samples that the likelihood used."""


@dataclass(frozen=True, eq=False)
class _Piece:
    """Consecutive samples of one station: positions (N, 3), pitch and roll (N, 2), yaw (N, 1), and which count."""

    station: str
    period_s: float
    axes: tuple[Floats, Floats, Floats]
    valid: Bools


def fit_noise(series: Sequence[StaticSeries], left_out: Sequence[Bools], *, by_station: bool = True) -> NoiseFit:
    """Fit the noise of stations at rest; `left_out` masks samples (N,) of each series, such as excursions.

    Without `by_station` only all stations together are fitted. BadInput without any valid sample.
    """
    pieces = _choose_pieces(series, left_out)
    samples = sum(int(piece.valid.sum()) for piece in pieces)
    if samples < 100:
        raise BadInput(
            f"{samples} undisturbed samples at rest cannot show the noise.", "Record a longer static stretch."
        )
    together, logarithms = _fit(pieces, start_values(series, left_out))
    stations = dict.fromkeys(piece.station for piece in pieces) if by_station else {}
    single = {
        station: _fit([piece for piece in pieces if piece.station == station], logarithms)[0] for station in stations
    }
    return NoiseFit(together, single, samples)


def start_values(series: Sequence[StaticSeries], left_out: Sequence[Bools]) -> Floats:
    """Rough logarithms (6,) of the parameters, from medians of differences, which outliers hardly change.

    The variance of differences grows from twice the white noise at a lag of one sample to the sum of both at 4 s.
    """

    def spreads(name: str, *columns: int) -> tuple[float, float]:
        short, long = [], []
        for one, mask in zip(series, left_out, strict=True):
            values = np.where((one.valid & ~mask)[:, None], getattr(one, name)[:, list(columns)], np.nan)
            lag = max(round(4.0 * one.rate_hz), 2)
            short.append(values[1:] - values[:-1])
            long.append(values[lag:] - values[:-lag])
        near, far = (float(np.nanmedian(np.abs(np.concatenate(parts)))) for parts in (short, long))
        return near / 0.6745 / np.sqrt(2.0), far / 0.6745 / np.sqrt(2.0)

    position, tilt, yaw = spreads("position_m", 0, 1, 2), spreads("rotation_rad", 0, 1), spreads("rotation_rad", 2)
    drift = [np.sqrt(max(long**2 - short**2, (0.1 * short) ** 2)) for short, long in (position, tilt, yaw)]
    values = np.array([0.9 * position[0], drift[0], 0.9 * tilt[0], drift[1], drift[2], 1.0])
    out: Floats = np.clip(np.log(np.maximum(values, 1e-12)), _LEAST + 1e-3, _MOST - 1e-3)
    return out


def _choose_pieces(series: Sequence[StaticSeries], left_out: Sequence[Bools]) -> list[_Piece]:
    """All samples, or evenly spread pieces of `_PIECE_S` if there are more than `MOST_SAMPLES`."""
    total = sum(len(one) for one in series)
    stride = max(-(-total // MOST_SAMPLES), 1)
    pieces, number = [], 0
    for one, mask in zip(series, left_out, strict=True):
        size = len(one) if stride == 1 else round(_PIECE_S * one.rate_hz)
        for begin in range(0, len(one), size):
            number += 1
            if (number - 1) % stride:
                continue
            rows = slice(begin, begin + size)
            valid = one.valid[rows] & ~mask[rows]
            place, turn = (np.where(valid[:, None], a[rows], 0.0) for a in (one.position_m, one.rotation_rad))
            axes = place, np.ascontiguousarray(turn[:, :2]), np.ascontiguousarray(turn[:, 2:])
            pieces.append(_Piece(one.station, 1.0 / one.rate_hz, axes, valid))
    return pieces


def _fit(pieces: Sequence[_Piece], start: Floats) -> tuple[dict[str, Measured], Floats]:
    """The parameters with their intervals, and the logarithms (6,) of the maximum."""
    from scipy import optimize

    def cost(logarithms: Floats) -> float:
        return -_log_likelihood(pieces, logarithms)

    found = optimize.minimize(
        cost, start, method="L-BFGS-B", bounds=list(zip(_LEAST, _MOST, strict=True)),
        options={"ftol": 1e-9, "maxiter": 60},
    )  # fmt: skip
    best: Floats = found.x
    free = np.flatnonzero((best > _LEAST + 0.05) & (best < _MOST - 0.05))
    deviation = np.full(len(best), np.inf)
    information = _second_derivatives(cost, best, free)
    covariance = np.linalg.pinv(information)
    deviation[free] = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    samples = sum(int(piece.valid.sum()) for piece in pieces)
    return {key: _measured(float(best[i]), float(deviation[i]), samples) for i, key in enumerate(NOISE_KEYS)}, best


def _measured(logarithm: float, deviation: float, samples: int) -> Measured:
    if not 0.0 < deviation < 1.0:
        return Measured.missing("The noise of this capture does not show it.")
    half = NORMAL_QUANTILE * deviation
    value, low, high = (float(np.exp(logarithm + shift)) for shift in (0.0, -half, half))
    return Measured(value, low, high, samples)


def _second_derivatives(cost: Callable[[Floats], float], at: Floats, free: Ints) -> Floats:
    """Matrix of second derivatives in the free directions, by central differences."""
    count = len(free)
    steps = np.zeros((count, len(at)))
    steps[np.arange(count), free] = _STEP
    out = np.zeros((count, count))
    middle = cost(at)
    ahead, behind = ([cost(at + sign * step) for step in steps] for sign in (1.0, -1.0))
    for i in range(count):
        out[i, i] = (ahead[i] - 2.0 * middle + behind[i]) / _STEP**2
        for j in range(i):
            mixed = cost(at + steps[i] + steps[j]) - ahead[i] - ahead[j] + 2.0 * middle
            mixed += cost(at - steps[i] - steps[j]) - behind[i] - behind[j]
            out[i, j] = out[j, i] = mixed / (2.0 * _STEP**2)
    return out


def _log_likelihood(pieces: Sequence[_Piece], logarithms: Floats) -> float:
    white_m, drift_m, white_rad, tilt_rad, yaw_rad, correlation_s = np.exp(logarithms)
    deviations = ((white_m, drift_m), (white_rad, tilt_rad), (white_rad, yaw_rad))
    total = 0.0
    for piece in pieces:
        correlation = float(np.exp(-piece.period_s / correlation_s))
        for values, (white, drift) in zip(piece.axes, deviations, strict=True):
            total += series_log_likelihood(values, piece.valid, correlation, float(drift**2), float(white**2))
    return total


@compiled
def series_log_likelihood(
    values: Floats, valid: Bools, correlation: float, drift_variance: float, white_variance: float
) -> float:
    """Restricted log-likelihood of A independent axes (N, A) with one constant each, up to a constant.

    `correlation` is that of the Gauss-Markov process from one sample to the next.
    """
    count, axes = values.shape
    variance = drift_variance  # stationary before the first sample
    state, unit = np.zeros(axes), 0.0
    cross, square = np.zeros(axes), np.zeros(axes)
    norm, log_determinant = 0.0, 0.0
    for i in range(count):
        variance = correlation**2 * variance + drift_variance * (1.0 - correlation**2)
        unit *= correlation
        for a in range(axes):
            state[a] *= correlation
        if not valid[i]:
            continue
        innovation_variance = variance + white_variance
        gain = variance / innovation_variance
        unit_innovation = 1.0 - unit
        for a in range(axes):
            innovation = values[i, a] - state[a]
            state[a] += gain * innovation
            square[a] += innovation * innovation / innovation_variance
            cross[a] += innovation * unit_innovation / innovation_variance
        unit += gain * unit_innovation
        norm += unit_innovation * unit_innovation / innovation_variance
        log_determinant += np.log(innovation_variance)
        variance *= 1.0 - gain
    if norm <= 0.0:
        return 0.0
    total = 0.0
    for a in range(axes):
        total -= 0.5 * (square[a] - cross[a] ** 2 / norm + log_determinant + np.log(norm))
    return total
