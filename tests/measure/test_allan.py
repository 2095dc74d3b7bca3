"""The Allan deviation against allantools, against closed forms, with gaps, and the coverage of its intervals."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.errors import BadInput
from harness.measure.allan import AllanDeviation, equivalent_freedom, expected_allan, measure_allan, pool_allan
from harness.simulate.components.stationary import gauss_markov


def noise(seed: int, count: int, axes: int, white: float, drift: float, correlation_s: float) -> np.ndarray:
    rng = generator(seed, "allan")
    wander = gauss_markov(rng.normal(size=(count, axes)), float(np.exp(-1.0 / (40.0 * correlation_s))))
    return drift * wander + white * rng.normal(size=(count, axes))


def test_without_gaps_it_is_that_of_allantools() -> None:
    allantools = pytest.importorskip("allantools")
    values = noise(1, 3001, 1, 0.75, 1.5, 1.0)
    found = measure_allan(values, np.ones(3001, bool), 40.0, longest_s=30.0)
    tau_s, deviation, _, pairs = allantools.oadev(values[:, 0], rate=40.0, data_type="freq", taus=found.tau_s)
    assert found.tau_s.tolist() == (2.0 ** np.arange(11) / 40.0).tolist()
    np.testing.assert_allclose(tau_s, found.tau_s)
    np.testing.assert_allclose(found.deviation, deviation, rtol=1e-9)
    np.testing.assert_array_equal(found.pairs, pairs)


@pytest.mark.parametrize("length", [1, 4, 64, 500])
def test_degrees_of_freedom_are_the_smaller_of_two_of_allantools(length: int) -> None:
    allantools = pytest.importorskip("allantools")
    both = [allantools.edf_simple(3002, length, alpha) for alpha in (0, -2)]
    assert equivalent_freedom(3002, length) == pytest.approx(max(min(both), 1.0), rel=1e-9)


def test_gaps_change_nothing_but_the_number_of_pairs() -> None:
    values = noise(2, 40_000, 3, 0.75, 1.5, 1.0)
    used = generator(2, "gaps").uniform(size=40_000) > 0.1
    used[5000:9000] = False
    holed = np.where(used[:, None], values, np.nan)
    whole, found = (measure_allan(v, u, 40.0, longest_s=60.0) for v, u in ((values, used | True), (holed, used)))
    assert np.all(found.pairs < whole.pairs)
    assert np.all(found.freedom < whole.freedom)
    np.testing.assert_allclose(found.deviation[:9], whole.deviation[:9], rtol=0.04)
    assert np.max(np.abs(found.deviation / expected_allan(found.tau_s, 40.0, 0.75, 1.5, 1.0) - 1.0)[:8]) < 0.1


def test_an_average_needs_three_quarters_of_its_readings() -> None:
    values = np.array([[0.0], [0.0], [0.0], [0.0], [1.0], [5.0], [1.0], [1.0]])
    used = np.array([True, True, True, True, True, False, True, True])
    found = measure_allan(values, used, 1.0, longest_s=4.0)
    assert found.pairs.tolist() == [5, 2, 1]
    assert found.squares.tolist() == [1.0, 0.25, 1.0]
    used[4] = False
    assert measure_allan(values, used, 1.0, longest_s=4.0).pairs.tolist() == [4, 1, 0]


def test_the_closed_form_is_that_of_a_plain_double_sum() -> None:
    phi = np.exp(-1.0 / 40.0)
    for count in (1, 2, 7, 64):
        weight = np.concatenate([np.full(count, -1.0), np.ones(count)]) / count
        apart = np.abs(np.arange(2 * count)[:, None] - np.arange(2 * count))
        variance = 0.5 * weight @ (1.5**2 * phi**apart + 0.75**2 * np.eye(2 * count)) @ weight
        found = expected_allan(np.array([count / 40.0]), 40.0, 0.75, 1.5, 1.0)
        assert found[0] == pytest.approx(np.sqrt(variance), rel=1e-9)


@pytest.mark.long
def test_intervals_contain_the_closed_form() -> None:
    rounds = 200
    inside = np.zeros(12)
    for seed in range(rounds):
        found = measure_allan(noise(seed, 12_000, 3, 0.75, 1.5, 1.0), np.ones(12_000, bool), 40.0, longest_s=60.0)
        truth = expected_allan(found.tau_s, 40.0, 0.75, 1.5, 1.0)
        inside += (found.interval[:, 0] <= truth) & (truth <= found.interval[:, 1])
    assert np.all(inside >= 0.9 * rounds), inside


def test_pooled_deviations_weigh_by_their_pairs() -> None:
    one = AllanDeviation(np.array([1.0, 2.0]), np.array([8.0, 4.0]), np.array([4, 2]), np.array([3.0, 1.0]))
    other = replace(one, squares=np.array([0.0, 0.0]), pairs=np.array([12, 0]), freedom=np.array([9.0, 0.0]))
    pooled = pool_allan([one, other])
    assert pooled.deviation.tolist() == [0.5, 1.0]
    assert pooled.freedom.tolist() == [12.0, 1.0]
    assert np.isnan(pool_allan([replace(one, pairs=np.array([4, 0]))]).interval[1]).all()
    for parts in ([], [one, replace(one, tau_s=np.array([1.0, 2.1]))]):
        with pytest.raises(BadInput, match="pooled"):
            pool_allan(parts)


@pytest.mark.parametrize(("rate_hz", "longest_s"), [(0.0, 1.0), (float("nan"), 1.0), (40.0, 0.01)])
def test_rates_and_lengths_that_cannot_be_are_refused(rate_hz: float, longest_s: float) -> None:
    with pytest.raises(BadInput, match="above a period"):
        measure_allan(np.zeros((10, 1)), np.ones(10, bool), rate_hz, longest_s=longest_s)
