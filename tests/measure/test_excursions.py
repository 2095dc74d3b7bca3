"""Excursions: the detector on simulated rests and on noise alone."""

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.measure.excursions import THRESHOLD, ExcursionDetector, ExcursionEvent
from harness.measure.gauss_markov import ErrorProcess
from harness.measure.static_series import StaticSeries
from harness.simulate import Excursion
from tests.measure.resting_stations import (
    QUIET,
    RATE_HZ,
    at_rest,
    default_noise,
    planted_series,
    rest_series,
    simulate_static,
)

NOISE = ErrorProcess(0.00075, 0.0015, 1.0)


def search(series: StaticSeries) -> list[ExcursionEvent]:
    detector = ExcursionDetector(series.rate_hz, NOISE)
    return detector.search(detector.innovations(series, np.zeros(len(series), bool)), "chest")[0]


def test_single_excursions_have_their_place_size_and_duration() -> None:
    excursion = Excursion(onsets_per_min=1.0, size_m=(0.01, 0.03))
    noise = default_noise(excursion=excursion, echo=None, dropout=None)
    matched, errors_m, errors_s, total, extra = 0, [], [], 0, 0
    for seed in (1001, 1002):
        readings = simulate_static(noise, seed, rate_hz=RATE_HZ, seconds=600.0, stations=("one",))
        events = search(rest_series(readings)[0])
        true = [e for e in excursion.events(readings.take_rng("excursion", "one"), 600.0) if 0.5 < e[0] < 590.0]
        total += len(true)
        extra += len(events) - len(true)
        for begin_s, stay_s, offset_m in true:
            near = min(events, key=lambda event: abs(event.begin_s - begin_s))
            if abs(near.begin_s - begin_s) < 0.1:
                matched += 1
                errors_m.append(near.size_m - float(np.linalg.norm(offset_m)))
                errors_s.append(near.stay_s - stay_s)
    assert matched >= 0.85 * total
    assert abs(extra) <= 0.2 * total
    assert np.median(np.abs(errors_m)) < 0.001
    assert abs(np.median(errors_m)) < 0.0004
    assert np.median(np.abs(errors_s)) < 0.03


@pytest.mark.long
def test_noise_alone_has_no_excursions() -> None:
    noise = default_noise(excursion=None, echo=None, dropout=None)
    rests = rest_series(simulate_static(noise, 0, rate_hz=RATE_HZ, seconds=600.0))
    assert [search(series) for series in rests] == [[]] * len(rests)  # one station hour


def displacement(count: int, begin_s: float, stay_s: float, size_m: tuple[float, ...], rate_hz: float) -> np.ndarray:
    since_s = np.arange(count) / rate_hz - begin_s
    share = np.clip(np.minimum(since_s, stay_s + 0.2 - since_s) / 0.2, 0.0, 1.0)
    return np.asarray(share[:, None] * np.array(size_m))


def planted(
    seed: int,
    *events: tuple[float, float, tuple[float, ...]],
    lost: tuple[float, float] = (0.0, 0.0),
    rate: float = 40.0,
) -> StaticSeries:
    (quiet,) = at_rest(QUIET, seed, rate_hz=rate)
    place_m = quiet.position_m + sum((displacement(len(quiet), *event, rate) for event in events), np.zeros(3))
    quality = np.ones(len(quiet))
    quality[round(lost[0] * rate) : round(lost[1] * rate)] = 0.0
    return planted_series(place_m, quality, rate)


@pytest.mark.parametrize("rate", [40.0, 120.0])
def test_a_planted_excursion_is_found_with_its_onset_duration_and_size(rate: float) -> None:
    (event,) = search(planted(1, (31.37, 2.83, (0.006, -0.008, 0.005)), rate=rate))
    assert event.begin_s == pytest.approx(31.37, abs=0.04)
    assert event.stay_s == pytest.approx(2.83, abs=0.05)
    assert event.size_m == pytest.approx(np.sqrt(125e-6), abs=0.0015)
    assert event.station == "chest"
    assert event.is_whole
    assert event.is_timed


def test_two_that_overlap_are_two() -> None:
    events = search(planted(3, (40.0, 3.0, (0.02, 0.0, 0.0)), (41.5, 4.0, (0.0, 0.015, 0.0))))
    assert [round(event.begin_s, 1) for event in events] == [40.0, 41.5]
    assert [event.stay_s for event in events] == pytest.approx([3.0, 4.0], abs=0.1)
    assert [event.size_m for event in events] == pytest.approx([0.02, 0.015], abs=0.002)


def test_one_whose_rise_is_in_a_gap_is_one_of_uncertain_duration() -> None:
    (event,) = search(planted(4, (50.2, 3.0, (0.0, 0.0, 0.02)), lost=(50.0, 50.6)))
    assert event.begin_s == pytest.approx(50.2, abs=0.6)
    assert event.begin_s + event.stay_s == pytest.approx(53.2, abs=0.05)
    assert event.size_m == pytest.approx(0.02, abs=0.003)
    assert not event.is_timed


def test_a_gap_within_one_does_not_part_it() -> None:
    (event,) = search(planted(5, (60.0, 4.0, (0.0, 0.012, 0.0)), lost=(61.5, 62.2)))
    assert event.stay_s == pytest.approx(4.0, abs=0.06)
    assert event.is_timed


@pytest.mark.parametrize(("begin_s", "stay_s"), [(-1.0, 3.0), (118.0, 5.0)])
def test_one_that_the_ends_of_the_series_cut_is_not_whole(begin_s: float, stay_s: float) -> None:
    (event,) = search(planted(6, (begin_s, stay_s, (0.02, 0.0, 0.0))))
    assert not event.is_whole


def test_the_score_is_above_the_threshold_and_grows_with_the_square_of_the_size() -> None:
    (small,), (large,) = (search(planted(7, (30.0, 3.0, (size_m, 0.0, 0.0)))) for size_m in (0.01, 0.03))
    assert small.score > THRESHOLD
    assert large.score / small.score == pytest.approx(9.0, rel=0.2)


def test_innovations_are_white_also_across_gaps() -> None:
    (series,) = at_rest(QUIET, 8, seconds=1200.0)
    left_out = generator(8, "left out").uniform(size=len(series)) < 0.05
    left_out[4000:4100] = True
    found = ExcursionDetector(40.0, NOISE).innovations(series, left_out)
    values = found.values[found.valid]
    assert not found.values[left_out].any()
    assert values.var(axis=0) == pytest.approx(np.ones(3), abs=0.03)
    for lag in (1, 2, 5, 40):
        assert np.abs(np.mean(values[lag:] * values[:-lag], axis=0)).max() < 0.02


def test_innovations_of_a_displacement_add_to_those_of_the_series() -> None:
    (series,) = at_rest(QUIET, 10)
    added_m = displacement(len(series), 20.0, 2.0, (0.01, 0.0, 0.0), 40.0)
    detector, nothing = ExcursionDetector(40.0, NOISE), np.zeros(len(series), bool)
    before = detector.innovations(series, nothing)
    after = detector.innovations(planted_series(series.position_m + added_m, series.quality), nothing)
    difference = detector.displaced(before, added_m).values - after.values
    assert np.abs(difference).max() < 0.2  # the median of the positions moves a little
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(before.values, after.values, atol=1.0)
