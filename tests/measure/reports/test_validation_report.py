"""Sizes of errors, and their intervals for errors that last."""

import numpy as np
import pytest
from scipy import signal

from harness.core.arrays import Floats
from harness.measure.reports.validation_report import error_quantiles

PERIOD_S = 1.0 / 40.0


def lasting(rng: np.random.Generator, seconds: float, correlation_s: float = 1.0) -> Floats:
    """Unit Gauss-Markov errors (N, 3)."""
    count, keep = round(seconds / PERIOD_S), np.exp(-PERIOD_S / correlation_s)
    steps = np.sqrt(1.0 - keep**2) * rng.normal(size=(count, 3))
    steps[0] = rng.normal(size=3)
    out: Floats = signal.lfilter([1.0], [1.0, -keep], steps, axis=0)
    return out


def test_quantiles_are_those_of_the_errors_size(rng: np.random.Generator) -> None:
    error = rng.normal(size=(8000, 3)) * 0.002
    found = error_quantiles(error, np.ones(8000, bool), PERIOD_S)
    size = np.linalg.norm(error, axis=1)
    assert found.rms.value == pytest.approx(np.sqrt(np.mean(size**2)))
    assert found.median.value == pytest.approx(np.median(size))
    assert found.quantile95.value == pytest.approx(np.quantile(size, 0.95))
    assert found.rms.count == 8000


def test_readings_that_are_not_valid_do_not_count(rng: np.random.Generator) -> None:
    error, valid = rng.normal(size=(8000, 3)), np.arange(8000) % 3 > 0
    spoilt = np.where(valid[:, None], error, 1e6)
    found = error_quantiles(spoilt, valid, PERIOD_S)
    assert found.rms.value == pytest.approx(np.sqrt(3.0), rel=0.05)
    assert found.rms.count == valid.sum()


def test_little_time_has_a_reason(rng: np.random.Generator) -> None:
    found = error_quantiles(rng.normal(size=(800, 3)), np.ones(800, bool), PERIOD_S)
    assert not found.rms.is_measured
    assert "25 s" in found.median.reason


@pytest.mark.long
def test_intervals_allow_for_errors_that_last() -> None:
    """Independent records would give intervals a fifth as wide, which contain the truth in a third of the captures."""
    contained = 0
    for seed in range(20):
        error = lasting(np.random.default_rng(seed), 120.0)
        found = error_quantiles(error, np.ones(len(error), bool), PERIOD_S)
        contained += found.rms.contains(np.sqrt(3.0))
    assert 16 <= contained <= 20
