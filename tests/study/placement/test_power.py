"""What a number of clips can show: against the sign-flip test itself, and in words that a study announces."""

import math

import numpy as np
import pytest

from harness.compare import SIGNIFICANCE, count_needed, sign_flip_p
from harness.results.findings import CandidatePlace
from harness.study.placement.power import (
    POWER,
    choose_pilot,
    estimate_power,
    smallest_effect,
    units_needed,
)

SETS = [(CandidatePlace(f"place_{n}", "head", 0.5, 0.0),) for n in range(10)]


@pytest.mark.parametrize(("comparisons", "least"), [(1, 6), (9, 9), (164, 13)])
def test_too_few_clips_show_nothing_however_large_the_difference(comparisons: int, least: int) -> None:
    assert count_needed(comparisons) == least
    assert smallest_effect(least - 1, comparisons) == math.inf
    assert smallest_effect(least, comparisons) < 3.0


@pytest.mark.parametrize(("clips", "comparisons"), [(6, 1), (8, 1), (9, 9), (10, 9), (12, 9), (14, 54), (16, 1)])
def test_the_sign_flip_test_finds_the_smallest_effect_with_the_stated_power(
    clips: int, comparisons: int, rng: np.random.Generator
) -> None:
    effect, draws = smallest_effect(clips, comparisons), 250
    found = [
        comparisons * sign_flip_p(rng.normal(size=clips) + effect) <= SIGNIFICANCE * (1.0 + 1e-9) for _ in range(draws)
    ]
    assert np.mean(found) == pytest.approx(POWER, abs=0.1)


@pytest.mark.parametrize("comparisons", [1, 9, 164])
def test_more_clips_show_smaller_differences(comparisons: int) -> None:
    least = count_needed(comparisons)
    effects = [smallest_effect(clips, comparisons) for clips in (least, least + 4, least + 20, least + 100)]
    assert effects == sorted(effects, reverse=True)
    assert effects[-1] < 0.55


def test_the_clips_that_are_needed_are_the_fewest_that_show_it() -> None:
    for effect in (2.5, 1.0, 0.3):
        clips = units_needed(effect, 9)
        assert smallest_effect(clips, 9) <= effect < smallest_effect(clips - 1, 9)
    assert units_needed(1e-9, 9) == 1_000_000


def test_the_pilot_is_spread_evenly() -> None:
    assert choose_pilot(SETS) == [SETS[1], SETS[3], SETS[6], SETS[8]]
    assert choose_pilot(SETS[:3]) == SETS[:3]
    assert choose_pilot([]) == []


def test_spread_is_that_of_paired_differences_and_the_whole_is_scaled_by_it(rng: np.random.Generator) -> None:
    hard = 3.0 * rng.normal(size=400)  # clips differ far more than sets do
    costs = {
        stations: {f"clip_{n}": float(value) for n, value in enumerate(5.0 + hard + 0.1 * rng.normal(size=400))}
        for stations in SETS[:3]
    }
    options = {"sets": 10, "unit": "deg", "cell_s": 0.5, "duration_s": lambda clips: 2.0 * clips}
    power = estimate_power(costs, units=20, **options)  # type: ignore[arg-type]
    assert power.spread == pytest.approx(0.1 * math.sqrt(2.0), rel=0.1)
    assert power.wanted == pytest.approx(0.5, rel=0.1)
    assert power.shown == pytest.approx((power.spread or 0.0) * smallest_effect(20, 9))
    assert (power.least_clips, power.duration_s, power.least_duration_s) == (9, 40.0, 18.0)
    assert power.needed_clips == units_needed((power.wanted or 0.0) / (power.spread or 1.0), 9)
    assert power.needed_duration_s == 2.0 * (power.needed_clips or 0)
    assert estimate_power(costs, units=8, **options).shown is None  # type: ignore[arg-type]


def test_without_a_pilot_only_the_least_number_of_clips_is_known() -> None:
    power = estimate_power({}, units=7, sets=10, unit="deg", cell_s=None, duration_s=lambda clips: None)
    assert (power.least_clips, power.spread, power.shown, power.needed_clips, power.pilot_sets) == (
        *(9, None, None, None, 0),
    )
