"""Series at rest: the grid, the deviations, and rest beside motion."""

from dataclasses import replace

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Ints
from harness.core.seeds import generator
from harness.measure.static_series import StaticSeries, find_rest, static_series
from harness.simulate import DriftNoise, Echo, Excursion, Noise, noise_preset
from harness.stream.recording import StationReadings
from tests.measure.resting_stations import simulate_static, station_readings


def whole_series(readings: StationReadings, rate_hz: float = 40.0) -> StaticSeries:
    return static_series(readings, (0, len(readings)), rate_hz, "one")


def some_rows(readings: StationReadings, rows: Ints) -> StationReadings:
    names = ("received_s", "measured_s", "stamp_s", "position_m", "tracker_from_station", "quality", "suspect")
    return StationReadings(**{name: getattr(readings, name)[rows] for name in names})


def test_records_that_are_missing_and_repeated_keep_their_place() -> None:
    whole = station_readings(simulate_static(noise_preset("noise"), 1, seconds=60.0), 2)
    rng = generator(1, "rows")
    keep = np.sort(np.concatenate([np.flatnonzero(rng.uniform(size=2400) > 0.1), [0, 300, 300, 301, 2399]]))
    series = whole_series(some_rows(whole, keep))
    assert len(series) == 2400
    assert series.duration_s == 60.0
    assert np.array_equal(np.flatnonzero(series.valid), np.unique(keep))
    assert (series.begin_s, series.received_s) == (whole.measured_s[0], whole.received_s[0])
    centred = whole.position_m[np.unique(keep)] - np.median(whole.position_m[np.unique(keep)], axis=0)
    np.testing.assert_allclose(series.position_m[series.valid], centred, atol=1e-12)
    assert np.isnan(series.position_m[~series.valid]).all()
    assert np.isnan(series.quality[~series.valid]).all()


@pytest.mark.parametrize("nominal_hz", [39.5, 40.0, 40.5])
@pytest.mark.parametrize("ppm", [0.0, 500.0, -500.0])
def test_the_grid_follows_coarse_stamps_of_another_rate(nominal_hz: float, ppm: float) -> None:
    whole = station_readings(simulate_static(Noise(), 1, seconds=600.0), 0)
    stamp_s = 0.002 * np.rint((18_000.0 + whole.measured_s * (1.0 + 1e-6 * ppm)) / 0.002)
    series = whole_series(replace(whole, measured_s=stamp_s), nominal_hz)
    assert len(series) == 24_000
    assert series.valid.all()


def test_rotations_are_deviations_in_the_axes_of_the_tracker() -> None:
    drift = DriftNoise(position_m=0.0, pitch_roll_rad=0.0, yaw_rad=0.02)
    readings = simulate_static(Noise(drift=drift), 1, seconds=60.0)
    for row in range(6):
        series = whole_series(station_readings(readings, row))
        assert np.max(np.abs(series.rotation_rad[:, :2])) < 1e-9
        assert 0.01 < np.std(series.rotation_rad[:, 2]) < 0.03
        np.testing.assert_allclose(series.rotation_rad.mean(axis=0), 0.0, atol=1e-5)


def test_lost_suspect_and_damaged_records_are_not_valid() -> None:
    whole = station_readings(simulate_static(noise_preset("default"), 1, seconds=60.0), 0)
    suspect = whole.suspect.copy()
    suspect[100] = True
    measured_s = whole.measured_s.copy()
    measured_s[100] = 1e9
    measured_s[200] = np.nan
    measured_s[210] = measured_s[190]
    series = whole_series(replace(whole, suspect=suspect, measured_s=measured_s))
    expected = whole.quality > 0.0
    expected[[100, 200, 210]] = False
    np.testing.assert_array_equal(series.valid, expected)
    np.testing.assert_array_equal(series.quality == 0.0, whole.quality == 0.0)
    assert np.isnan(series.position_m[~expected]).all()
    assert np.isnan(series.rotation_rad[~expected]).all()


def test_without_stamps_places_are_those_of_the_records() -> None:
    whole = station_readings(simulate_static(Noise(), 1, seconds=10.0), 0)
    series = static_series(replace(whole, measured_s=np.full(400, np.nan)), (40, 400), 40.0, "one")
    assert len(series) == 360
    assert series.valid.all()
    assert series.begin_s == whole.received_s[40]


@pytest.mark.parametrize("seed", range(4))
def test_errors_of_the_device_do_not_end_a_rest(seed: int) -> None:
    noise = replace(noise_preset("default"), echo=Echo(share=0.09), excursion=Excursion(onsets_per_min=3.0))
    readings = simulate_static(noise, seed)
    for row in range(6):
        assert find_rest(station_readings(readings, row), 40.0).tolist() == [[0, 12_000]]


@pytest.mark.parametrize("turns", [False, True])
def test_a_slow_sweep_is_no_rest(turns: bool) -> None:
    plain = station_readings(simulate_static(noise_preset("default"), 1, seconds=90.0), 0)
    time_s = plain.received_s
    path = np.clip(time_s - 30.0, 0.0, 30.0)
    position_m, turn = plain.position_m.copy(), plain.tracker_from_station
    if turns:
        turn = rotations.multiply(rotations.about_z(np.deg2rad(4.0) * path), turn)
    else:
        position_m[:, 0] += 0.06 * path
    runs = find_rest(replace(plain, position_m=position_m, tracker_from_station=turn), 40.0)
    assert len(runs) == 2
    assert runs[0, 0] == 0
    assert runs[1, 1] == 3600
    assert 25 * 40 <= runs[0, 1] <= 31 * 40
    assert 59 * 40 <= runs[1, 0] <= 65 * 40


def test_a_quick_step_ends_a_rest_and_another_begins() -> None:
    plain = station_readings(simulate_static(noise_preset("noise"), 1, seconds=40.0), 0)
    position_m = plain.position_m.copy()
    position_m[810:, 1] += 0.2
    runs = find_rest(replace(plain, position_m=position_m), 40.0)
    assert len(runs) == 2
    assert 680 <= runs[0, 1] <= 810 <= runs[1, 0] <= 960


@pytest.mark.parametrize("first", [0, 7, 20, 33])
def test_a_rest_of_ten_seconds_between_motions_is_found(first: int) -> None:
    """As a probe is carried from one surveyed point to the next, wherever the windows begin."""
    plain = station_readings(simulate_static(noise_preset("noise"), 1, seconds=46.0), 0)
    way_m = np.interp(np.arange(1840) % 460, [0, 400, 460], [0.0, 0.0, 0.3]) + 0.3 * (np.arange(1840) // 460)
    position_m = plain.position_m + way_m[:, None]
    assert len(find_rest(some_rows(replace(plain, position_m=position_m), np.arange(first, 1840)), 40.0)) == 4


def test_a_lost_station_rests_on_but_no_rest_begins_with_it() -> None:
    plain = station_readings(simulate_static(noise_preset("noise"), 1, seconds=40.0), 0)
    lost = np.zeros(1600, bool)
    lost[:100], lost[600:900] = True, True
    position_m = np.where(lost[:, None], np.nan, plain.position_m)
    runs = find_rest(replace(plain, position_m=position_m, quality=np.where(lost, 0.0, 1.0)), 40.0)
    assert runs.tolist() == [[120, 1600]]
    assert find_rest(some_rows(plain, np.arange(190)), 40.0).tolist() == []
    assert find_rest(some_rows(plain, np.arange(30)), 40.0).shape == (0, 2)


def test_a_quick_tremor_is_no_rest() -> None:
    plain = station_readings(simulate_static(noise_preset("noise"), 1, seconds=30.0), 0)
    position_m = plain.position_m.copy()
    position_m[:, 0] += 0.05 * np.sin(2.0 * np.pi * 4.0 * plain.received_s)
    assert len(find_rest(replace(plain, position_m=position_m), 40.0)) == 0
