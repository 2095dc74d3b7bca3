"""Typical and large errors of a station against a reference, with intervals for errors that last."""

from dataclasses import dataclass

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.number_format import Interval
from harness.core.seeds import generator

_BLOCK_S = 5.0
"""Length of the blocks that the bootstrap draws [s]: five correlation times of the drift."""
_FEWEST_BLOCKS = 5
_RESAMPLES = 400


@dataclass(frozen=True)
class ErrorQuantiles:
    """Root mean square, median and 95 % quantile of the size of an error."""

    rms: Interval
    median: Interval
    quantile95: Interval


@dataclass(frozen=True)
class StationAccuracy:
    """Errors of one station against the reference, after the registration."""

    position: ErrorQuantiles
    """Errors of the position [m]."""
    orientation: ErrorQuantiles
    """Errors of the orientation [rad]."""
    readings: int
    """Number of readings that were compared."""
    lost_share: float
    """Share of the readings without a position."""


def error_quantiles(error: Floats, valid: Bools, period_s: float) -> ErrorQuantiles:
    """Summarise errors (N, 3) at records `period_s` apart; `valid` (N,) are those that were measured.

    Intervals are percentiles of a bootstrap over blocks of five seconds (Kunsch 1989, Ann. Statist. 17).
    """
    size = np.linalg.norm(error, axis=1)
    length = max(round(_BLOCK_S / period_s), 1)
    blocks = [size[at : at + length][valid[at : at + length]] for at in range(0, len(size), length)]
    blocks = [block for block in blocks if len(block) >= length // 2]
    if len(blocks) < _FEWEST_BLOCKS:
        missing = Interval.missing(f"{_FEWEST_BLOCKS * _BLOCK_S:g} s of readings are needed.")
        return ErrorQuantiles(missing, missing, missing)
    rng = generator(0, "error quantiles")
    draws = rng.integers(0, len(blocks), (_RESAMPLES, len(blocks)))
    resampled = np.array([_summary(np.concatenate([blocks[i] for i in draw])) for draw in draws])
    values, count = _summary(np.concatenate(blocks)), sum(map(len, blocks))
    low, high = np.quantile(resampled, [0.025, 0.975], axis=0)
    rms, median, large = (
        Interval(value, min(float(a), value), max(float(b), value), count)
        for value, a, b in zip(values, low, high, strict=True)
    )
    return ErrorQuantiles(rms, median, large)


def _summary(size: Floats) -> tuple[float, float, float]:
    return float(np.sqrt(np.mean(size**2))), float(np.median(size)), float(np.quantile(size, 0.95))
