"""The fit of noise at rest: at the maximum of an independent likelihood, its limits, and the coverage of intervals."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Bools
from harness.errors import BadInput
from harness.measure.gauss_markov import NOISE_KEYS
from harness.measure.noise_fit import fit_noise, start_values
from harness.measure.static_series import StaticSeries, static_series
from harness.simulate import DriftNoise, Echo, Excursion, Noise, WhiteNoise, noise_preset
from tests.measure.resting_stations import STATIONS, simulate_static, station_readings
from tests.measure.test_gauss_markov import dense_covariance, dense_log_likelihood

PRESET = noise_preset("noise")
COLUMNS = (("position_m", slice(0, 3), 0, 1), ("rotation_rad", slice(0, 2), 2, 3), ("rotation_rad", slice(2, 3), 2, 4))
"""Field, axes, and rows of white noise and drift in `NOISE_KEYS`."""


def truth(noise: Noise) -> dict[str, float]:
    return {key: float(getattr(getattr(noise, key.split(".")[1]), key.split(".")[2])) for key in NOISE_KEYS}


def series_and_masks(
    noise: Noise, seed: int, seconds: float, stations: Sequence[str] = STATIONS
) -> tuple[list[StaticSeries], list[Bools]]:
    """Series at rest, and the readings that an episode or a loss changed."""
    readings = simulate_static(noise, seed, seconds=seconds, stations=tuple(stations))
    series = [
        static_series(station_readings(readings, row), (0, len(readings.time_s)), 40.0, station)
        for row, station in enumerate(stations)
    ]
    changed = np.zeros((len(readings.time_s), len(stations)), bool)
    for name in ("excursion", "echo", "coast"):
        changed |= readings.affected.get(name, changed)
    return series, [np.asarray(changed[:, row]) for row in range(len(stations))]


def nothing(series: Sequence[StaticSeries]) -> list[Bools]:
    return [np.zeros(len(one), bool) for one in series]


def test_the_estimate_is_the_maximum_of_a_dense_likelihood() -> None:
    series, _ = series_and_masks(PRESET, 1, 12.0, STATIONS[:2])
    left_out = nothing(series)
    left_out[0][100:130], left_out[1][::7] = True, True
    found = fit_noise(series, left_out).all_stations
    best = np.log([found[key].value for key in NOISE_KEYS])

    def height(logarithms: np.ndarray) -> float:
        values = np.exp(logarithms)
        return sum(
            dense_log_likelihood(
                getattr(one, name)[:, axes], ~mask, dense_covariance(~mask, 40.0, values[w], values[d], values[5])
            )
            for one, mask in zip(series, left_out, strict=True)
            for name, axes, w, d in COLUMNS
        )

    top = height(best)
    for row in range(6):
        ahead, behind = (height(best + step * np.eye(6)[row]) for step in (0.02, -0.02))
        assert max(ahead, behind) < top
        curvature = (2.0 * top - ahead - behind) / 0.02**2
        assert abs(ahead - behind) / 0.04 < 0.05 * np.sqrt(curvature), NOISE_KEYS[row]


def test_readings_that_are_left_out_count_for_nothing() -> None:
    series, left_out = series_and_masks(noise_preset("default"), 2, 60.0, STATIONS[:3])
    moved = []
    for one, mask in zip(series, left_out, strict=True):
        position_m = np.where((one.valid & mask)[:, None], 5.0, one.position_m)
        moved.append(replace(one, position_m=position_m))
    assert fit_noise(moved, left_out) == fit_noise(series, left_out)


def test_each_station_has_its_own_numbers() -> None:
    quiet, _ = series_and_masks(PRESET, 3, 60.0, ("one",))
    loud, _ = series_and_masks(replace(PRESET, white=WhiteNoise(position_m=0.003)), 3, 60.0, ("two",))
    both = quiet + loud
    found = fit_noise(both, nothing(both))
    key = "components.white.position_m"
    assert found.by_station["one"][key].value == pytest.approx(0.00075, rel=0.05)
    assert found.by_station["two"][key].value == pytest.approx(0.003, rel=0.05)
    assert found.all_stations[key].value == pytest.approx(np.sqrt((0.00075**2 + 0.003**2) / 2.0), rel=0.2)
    assert not fit_noise(both, nothing(both), by_station=False).by_station
    short = replace(loud[0], valid=np.arange(2400) < 50)
    numbers = fit_noise([quiet[0], short], nothing(both)).by_station["two"]
    assert not any(number.is_measured for number in numbers.values())


def test_white_noise_twice_the_preset_s_is_sized() -> None:
    noise = replace(PRESET, white=WhiteNoise(0.0015, 2.0 * WhiteNoise().orientation_rad))
    series, _ = series_and_masks(noise, 4, 60.0)
    found = fit_noise(series, nothing(series), by_station=False).all_stations
    for key in ("components.white.position_m", "components.white.orientation_rad"):
        assert found[key].value == pytest.approx(truth(noise)[key], rel=0.05)
        assert found[key].low > 1.8 * truth(PRESET)[key]


def test_a_unit_without_noise_has_none() -> None:
    series, _ = series_and_masks(Noise(), 5, 60.0)
    found = fit_noise(series, nothing(series)).all_stations
    assert [found[key].value for key in NOISE_KEYS[:5]] == [0.0] * 5
    assert found[NOISE_KEYS[0]].high == 0.0
    assert not found["components.drift.correlation_s"].is_measured


@pytest.mark.parametrize("white", [0.0, 1e-5])
def test_white_noise_far_below_the_drift_has_an_upper_limit(white: float) -> None:
    series, _ = series_and_masks(Noise(drift=DriftNoise(), white=WhiteNoise(white, white)), 1, 60.0)
    found = fit_noise(series, nothing(series), by_station=False).all_stations
    for key in ("components.white.position_m", "components.white.orientation_rad"):
        assert found[key].low == 0.0
        assert white < found[key].high < 0.0002
    assert found["components.drift.position_m"].contains(0.0015)


def test_no_drift_about_one_axis_leaves_the_others() -> None:
    noise = replace(PRESET, drift=DriftNoise(yaw_rad=0.0))
    series, _ = series_and_masks(noise, 1, 60.0)
    found = fit_noise(series, nothing(series), by_station=False).all_stations
    assert found["components.drift.yaw_rad"].low == 0.0
    assert found["components.drift.yaw_rad"].high < 0.0003
    assert found["components.drift.pitch_roll_rad"].contains(noise.drift.pitch_roll_rad if noise.drift else 0.0)


def test_without_drift_its_time_is_not_measured_or_wide() -> None:
    series, _ = series_and_masks(Noise(white=WhiteNoise()), 2, 60.0)
    found = fit_noise(series, nothing(series), by_station=False).all_stations
    time_s = found["components.drift.correlation_s"]
    assert not time_s.is_measured or time_s.high > 3.0 * time_s.low
    assert found["components.white.position_m"].contains(0.00075)
    assert found["components.drift.position_m"].high < 0.0003


def test_few_readings_are_refused() -> None:
    series, _ = series_and_masks(PRESET, 6, 60.0, ("one",))
    left_out = [np.arange(2400) >= 99]
    for function in (fit_noise, start_values):
        with pytest.raises(BadInput, match="99 undisturbed readings"):
            function(series, left_out)


@pytest.mark.parametrize("correlation_s", [0.1, 1.0, 10.0])
def test_the_start_is_near_without_masks(correlation_s: float) -> None:
    noise = replace(
        noise_preset("default"),
        drift=DriftNoise(correlation_s=correlation_s),
        echo=Echo(share=0.09),
        excursion=Excursion(onsets_per_min=3.0),
    )
    series, _ = series_and_masks(noise, 7, 300.0)
    found = np.exp(start_values(series, nothing(series)))
    ratio = found / np.array([truth(noise)[key] for key in NOISE_KEYS])
    assert np.all((ratio[[0, 3, 4]] > 0.8) & (ratio[[0, 3, 4]] < 1.25)), ratio
    assert 0.8 < ratio[2] < (1.25 if correlation_s >= 1.0 else 2.0)  # short drift hides small white noise
    assert 0.7 < ratio[1] < 1.5
    assert 0.5 < ratio[5] < 2.0


def covered(rounds: int, seconds: float) -> np.ndarray:
    expected = truth(PRESET)
    inside = np.zeros((2, 6))
    for seed in range(rounds):
        series, left_out = series_and_masks(noise_preset("default"), 1000 + seed, seconds)
        found = fit_noise(series, left_out)
        for row, numbers in enumerate((found.all_stations, found.by_station["three"])):
            inside[row] += [numbers[key].contains(expected[key]) for key in NOISE_KEYS]
    return inside / rounds


@pytest.mark.long
def test_intervals_of_short_captures_contain_the_truth() -> None:
    assert np.all(covered(20, 60.0) >= 0.8)  # of 20 rounds at 95 %, fewer than 16 are seen once in 400


@pytest.mark.slow
def test_intervals_contain_the_truth_in_90_to_99_percent_of_200_captures() -> None:
    share = covered(200, 300.0)
    assert np.all((share >= 0.9) & (share <= 0.99)), share
