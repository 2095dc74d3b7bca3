"""Changes that were planted in series are found at their entry, and series without one raise no alarm."""

import numpy as np
import pytest

from harness.compare.margins import margin_of
from harness.compare.timeline.change_points import CHANGE_LEVEL, MetricSeries, find_changes
from harness.core.arrays import Floats
from harness.core.seeds import generator

ENTRIES, METHODS = 50, 3
MARGIN = margin_of("joint_angle_mean_deg")


def planted(
    seed: int, units: int, noise: float, factors: Floats | float = 1.0, walk: float = 0.0
) -> list[MetricSeries]:
    """A series for each method; the first is `factors` (T,) times as large.

    Performers differ by 30 %. Each value has `noise`, a share of it, anew in every entry. One entry in five moves each
    unit by the share `walk`, for good.
    """
    found = []
    for method in range(METHODS):
        rng = generator(seed, "planted timeline", units, method)
        performers = 3.0 * np.exp(0.3 * rng.normal(size=units))
        moved = np.cumsum(walk * rng.normal(size=(ENTRIES, units)) * (rng.random((ENTRIES, 1)) < 0.2), axis=0)
        values = performers * np.exp(moved) * (1.0 + noise * rng.normal(size=(ENTRIES, units)))
        found.append(
            MetricSeries(values * np.broadcast_to(factors, ENTRIES)[:, None] if not method else values, MARGIN)
        )
    return found


def step(at: int, size: float = 0.03) -> Floats:
    return np.where(np.arange(ENTRIES) >= at, 1.0 + size, 1.0)


@pytest.mark.parametrize("units", [1, 3, 7, 12, 24])
@pytest.mark.parametrize("at", [1, 20, 49])
def test_a_step_without_noise_is_found_at_its_entry(units: int, at: int) -> None:
    changed, *others = find_changes(planted(1, units, 0.0, step(at)))
    assert [change.at for change in changed] == [at]
    assert others == [[], []]
    values = planted(1, units, 0.0)[0].values[0]
    assert changed[0].difference == pytest.approx(0.03 * values.mean())


def test_the_interval_contains_the_step_and_p_is_corrected() -> None:
    series = planted(2, 24, 0.01, step(30))
    (change,) = find_changes(series)[0]
    (alone,) = find_changes(series[:1])[0]
    assert change.low is not None
    assert change.high is not None
    planted_difference = 0.03 * planted(2, 24, 0.01)[0].values[30:].mean()
    assert change.low < planted_difference < change.high
    assert change.p == pytest.approx(3 * alone.p)


def test_a_change_within_the_margin_is_none() -> None:
    assert find_changes(planted(3, 24, 0.0, step(20, 0.019))) == [[], [], []]
    assert find_changes(planted(3, 24, 0.0, step(20, 0.021)))[0]


def test_a_short_excursion_and_two_steps_are_found() -> None:
    factors = step(10, 0.05) * step(11, -0.0476190476) * step(30, -0.04)
    assert [change.at for change in find_changes(planted(4, 12, 0.002, factors))[0]] == [10, 11, 30]


def test_few_entries_of_few_units_cannot_show_a_change_and_more_of_either_can() -> None:
    few, many = planted(5, 7, 0.0, step(3)), planted(5, 16, 0.0, step(3))
    assert find_changes([MetricSeries(few[0].values[:7], MARGIN)]) == [[]]
    assert [change.at for change in find_changes([MetricSeries(few[0].values[:8], MARGIN)])[0]] == [3]
    assert [change.at for change in find_changes([MetricSeries(many[0].values[:4], MARGIN)])[0]] == [3]


def test_a_time_needs_two_entries_on_each_side() -> None:
    for at, found in ((48, [48]), (49, [])):
        (series, *_) = planted(6, 7, 0.01, step(at, 0.5))
        changes = find_changes([MetricSeries(series.values, MARGIN, entries_vary=True)])[0]
        assert [change.at for change in changes] == found
        assert all(change.low is None for change in changes)


@pytest.mark.parametrize(("units", "noise", "walk"), [(24, 0.02, 0.0), (24, 0.0, 0.01), (7, 0.01, 0.0)])
def test_series_without_a_step_raise_no_alarm(units: int, noise: float, walk: float) -> None:
    alarms = [any(find_changes(planted(seed, units, noise, walk=walk))) for seed in range(20)]
    assert sum(alarms) == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("units", "noise", "walk"), [(24, 0.01, 0.0), (24, 0.03, 0.0), (24, 0.0, 0.01), (12, 0.02, 0.0), (7, 0.01, 0.0)]
)
def test_rates(units: int, noise: float, walk: float, capsys: pytest.CaptureFixture[str]) -> None:
    """A step of 3 % is found within one entry, and at most one of 100 series of 50 entries has a false alarm."""
    errors, missed, alarms, further = list[int](), 0, 0, 0
    for seed in range(100):
        at = int(generator(seed, "place of the step").integers(2, ENTRIES - 1))
        changed, *others = find_changes(planted(seed, units, noise, step(at), walk))
        nearest = min((abs(change.at - at) for change in changed), default=ENTRIES)
        missed += nearest == ENTRIES
        errors += [nearest] if nearest < ENTRIES else []
        further += len(changed) - 1 + sum(map(len, others)) if changed else 0
        alarms += any(find_changes(planted(1000 + seed, units, noise, walk=walk)))
    within = sum(error <= 1 for error in errors)
    with capsys.disabled():
        print(
            f"\n{units} units, noise {noise:.0%}, walk {walk:.0%}, level {CHANGE_LEVEL:g}: 3 % found within one entry "
            f"in {within} of 100 series, {missed} missed, largest error {max(errors)}, {further} further changes; "
            f"false alarms in {alarms} of 100 series of {ENTRIES}"
        )
    assert alarms <= 1
    assert within >= 90
