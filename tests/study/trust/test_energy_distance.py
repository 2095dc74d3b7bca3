"""Energy distance: closed forms, the correlation time, and the level of the permutation test on correlated noise."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.study.trust import energy_distance
from harness.study.trust.energy_distance import (
    CORRELATION_TIMES,
    compare_errors,
    correlation_samples,
    label_blocks,
)

LEVEL = 0.05


def autoregressive(rng: np.random.Generator, count: int, phi: float, axes: int = 2) -> Floats:
    """A stationary first-order series of unit variance."""
    noise = rng.normal(size=(count, axes)) * np.sqrt(1.0 - phi**2)
    series = np.empty((count, axes))
    series[0] = rng.normal(size=axes)
    for k in range(1, count):
        series[k] = phi * series[k - 1] + noise[k]
    return series


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9])
def test_the_correlation_time_of_a_first_order_series_is_known(phi: float) -> None:
    rng = generator(1, "correlation", str(phi))
    series = [autoregressive(rng, 4000, phi) for _ in range(6)]
    assert correlation_samples(series) == pytest.approx((1.0 + phi) / (1.0 - phi), rel=0.15)


def test_gaps_leave_the_correlation_time_alone() -> None:
    rng = generator(2, "gaps")
    series = [autoregressive(rng, 4000, 0.8) for _ in range(4)]
    whole = correlation_samples(series)
    for each in series:
        each[rng.random(len(each)) < 0.3] = np.nan
    assert correlation_samples(series) == pytest.approx(whole, rel=0.15)


def test_a_slow_part_of_small_variance_counts() -> None:
    rng = generator(3, "slow")
    white = [rng.normal(size=(4000, 1)) for _ in range(6)]
    slow = [np.sqrt(0.15) * autoregressive(rng, 4000, 0.98, 1) for _ in range(6)]
    expected = 1.0 + 2.0 * 0.15 / 1.15 * 0.98 / 0.02
    assert correlation_samples([a + b for a, b in zip(white, slow, strict=True)]) == pytest.approx(expected, rel=0.35)


@pytest.mark.parametrize("series", [[], [np.zeros((1, 2))], [np.ones((50, 2))], [np.full((50, 2), np.nan)]])
def test_series_without_variance_are_refused(series: list[Floats]) -> None:
    with pytest.raises(BadInput, match="variance"):
        correlation_samples(series)


def test_blocks_are_equal_and_never_cross_series() -> None:
    labels = label_blocks([np.zeros((25, 1)), np.zeros((4, 1)), np.zeros((10, 1))], 10)
    assert [np.bincount(each).tolist() for each in (labels[0], labels[1] - 2, labels[2] - 3)] == [[13, 12], [4], [10]]
    with pytest.raises(BadInput):
        label_blocks([np.zeros((5, 1))], 0)


def test_the_distance_of_two_points_is_twice_their_distance() -> None:
    found = compare_errors([np.zeros((20, 1))], [np.full((20, 1), 3.0)], 5)
    assert found.distance == pytest.approx(6.0)
    assert found.split_half == pytest.approx(0.0)
    assert found.blocks == (4, 4)


def test_the_distance_of_shifted_normal_samples_is_known_and_unbiased() -> None:
    """For N(0, 1) and N(d, 1): 2 E|Z sqrt(2) + d| - 4 / sqrt(pi), and 0 where d is 0."""
    rng = generator(4, "normal")
    shift = 1.0
    folded = 2.0 / np.sqrt(np.pi) * np.exp(-(shift**2) / 4.0) + shift * (2.0 * _normal(shift / np.sqrt(2.0)) - 1.0)
    far, near = [], []
    for k in range(60):
        a, b = rng.normal(size=(2, 200, 1))
        far.append(compare_errors([a], [b + shift], 2, seed=k, permutations=9).distance)
        near.append(compare_errors([a], [b], 2, seed=k, permutations=9).distance)
    assert np.mean(far) == pytest.approx(2.0 * folded - 4.0 / np.sqrt(np.pi), rel=0.05)
    assert abs(np.mean(near)) < 3.0 * np.std(near) / np.sqrt(len(near))


def _normal(x: float) -> float:
    from math import erf

    return 0.5 * (1.0 + erf(x / np.sqrt(2.0)))


def test_rows_with_a_gap_are_left_out() -> None:
    rng = generator(5, "missing")
    a, b = rng.normal(size=(2, 100, 3))
    holes = a.copy()
    holes[::3, 1] = np.nan
    kept = [holes[np.isfinite(holes).all(axis=1)]]
    assert compare_errors([holes], [b], 100 // 8).distance == pytest.approx(
        compare_errors(kept, [b], 100 // 8).distance, abs=0.05
    )


def test_too_few_blocks_are_refused() -> None:
    with pytest.raises(BadInput, match="3 blocks"):
        compare_errors([np.zeros((30, 1))], [np.zeros((40, 1))], 10)


def test_many_rows_are_thinned_evenly() -> None:
    rng = generator(6, "thinned")
    a, b = rng.normal(size=(2, 4 * energy_distance.MOST_ROWS, 1))
    a[: 2 * energy_distance.MOST_ROWS] += 2.0  # only half of it, so that the first rows alone would tell another story
    found = compare_errors([a], [b], 200, permutations=99)
    assert found.p == pytest.approx(0.01)
    assert found.blocks == (30, 30)
    assert 0.2 < found.distance < 0.8


@pytest.mark.long
def test_permuting_blocks_keeps_the_level_on_correlated_noise_and_permuting_samples_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(energy_distance, "MOST_ROWS", 500)
    rng = generator(7, "level")
    studies, blocks, samples, louder = 100, 0, 0, 0
    for k in range(studies):
        a, b = ([autoregressive(rng, 150, 0.7) for _ in range(5)] for _ in range(2))
        length = int(np.ceil(CORRELATION_TIMES * max(correlation_samples(a), correlation_samples(b))))
        blocks += compare_errors(a, b, length, seed=k, permutations=199).p <= LEVEL
        samples += compare_errors(a, b, 1, seed=k, permutations=199).p <= LEVEL
        louder += compare_errors(a, [2.0 * each for each in b], length, seed=k, permutations=199).p <= LEVEL
    assert blocks <= 12  # 5 % of 100, and three standard deviations
    assert samples >= 40
    assert louder >= 90
