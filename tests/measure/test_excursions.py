"""Excursions: the detector on simulated rests and on noise alone."""

import numpy as np
import pytest

from harness.measure.excursions import ExcursionDetector, ExcursionEvent, ExcursionNoise, Innovations
from harness.measure.static_series import StaticSeries
from harness.simulate.components.transient import Excursion
from tests.measure.resting import RATE_HZ, default_noise, rest_series
from tests.measure.static_readings import simulate_static

NOISE = ExcursionNoise(0.00075, 0.0015, 1.0)


def search(series: StaticSeries) -> tuple[list[ExcursionEvent], Innovations]:
    detector = ExcursionDetector(RATE_HZ, NOISE)
    found = detector.search(detector.innovations(series, np.zeros(len(series), bool)), series.station)
    return found.events, found.residual


def test_innovations_of_the_noise_are_white_and_of_unit_size() -> None:
    noise = default_noise(excursion=None, echo=None, dropout=None)
    readings = simulate_static(noise, 1001, rate_hz=RATE_HZ, seconds=600.0, stations=("one",))
    events, residual = search(rest_series(readings)[0])
    assert events == []
    assert residual.values[200:].std() == pytest.approx(1.0, abs=0.02)
    lag1 = np.mean(residual.values[201:] * residual.values[200:-1])
    assert abs(lag1) < 0.02


def test_single_excursions_have_their_place_size_and_duration() -> None:
    excursion = Excursion(onsets_per_min=1.0, size_m=(0.01, 0.03))
    noise = default_noise(excursion=excursion, echo=None, dropout=None)
    matched, errors_m, errors_s, total, extra = 0, [], [], 0, 0
    for seed in range(1001, 1005):
        readings = simulate_static(noise, seed, rate_hz=RATE_HZ, seconds=600.0, stations=("one",))
        events, _ = search(rest_series(readings)[0])
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
    found = 0
    for seed in range(5):
        for series in rest_series(simulate_static(noise, seed, rate_hz=RATE_HZ, seconds=600.0)):
            found += len(search(series)[0])
    assert found <= 2  # five station hours
