"""Timing against simulated lines: rate, losses, repeats, stamps, and the clock behind delays of the host."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.core.number_format import Interval
from harness.core.seeds import generator
from harness.measure.timing import TIMING_KEYS, TimingAccumulator, TimingMeasurement, count_share, robust_slope
from harness.simulate import Clock, Noise, gauss_markov, noise_preset
from harness.stream.polhemus.codec import WireFormat
from harness.stream.recording import CaptureBlock, StationReadings
from tests.measure.resting_stations import simulate_static, station_readings

STATIONS = ("one", "two", "three", "four", "five", "six")
Delay = Callable[[np.random.Generator, int], Floats]


def capture(
    seed: int,
    seconds: float,
    *,
    ppm: float = 20.0,
    age_s: float = 0.0,
    delay: Delay | None = None,
    rate_hz: float = 40.0,
    noise: Noise | None = None,
) -> CaptureBlock:
    """A capture whose stamps are 32-bit milliseconds; the host receives each record after a delay."""
    noise = replace(noise or Noise(), clock=Clock(offset_s=age_s, drift_ppm=ppm))
    simulated = simulate_static(noise, seed, seconds=seconds, rate_hz=rate_hz)
    rng = generator(seed, "line")
    late_s = delay(rng, simulated.time_s.size) if delay else np.zeros(simulated.time_s.size)
    arrives_s = np.maximum.accumulate(simulated.time_s.ravel() + late_s).reshape(simulated.time_s.shape) + 100.0
    stations = {}
    for row, station in enumerate(STATIONS):
        plain = station_readings(simulated, row)
        stamp_s = 1e-3 * (1e3 * plain.measured_s).astype(np.float32).astype(float)
        stations[station] = replace(plain, received_s=arrives_s[:, row], measured_s=stamp_s, stamp_s=stamp_s)
    return CaptureBlock("static", 0, WireFormat(STATIONS, rate_hz), 100.0, stations, 0)


def exponential(rng: np.random.Generator, count: int) -> Floats:
    return rng.exponential(0.002, count)


def host(rng: np.random.Generator, count: int) -> Floats:
    """Scheduling of a busy host: a wandering delay, short waits, and stalls of 20 ms twice a second."""
    wander = np.abs(np.cumsum(rng.normal(0.0, 2e-5, count)) % 0.002 - 0.001)
    stalls = np.zeros(count)
    for begin in np.flatnonzero(rng.uniform(size=count) < 2.0 / 240.0):
        stalls[begin : begin + 5] = 0.02
    return wander + rng.exponential(0.0005, count) + stalls


def measure(*blocks: CaptureBlock, rate_hz: float = 40.0) -> TimingMeasurement:
    timing = TimingAccumulator(rate_hz)
    for block in blocks:
        timing.add(block)
    return timing.measure()


def rows_of(block: CaptureBlock, rows: np.ndarray) -> CaptureBlock:
    names = StationReadings.__dataclass_fields__
    stations = {
        name: StationReadings(*(getattr(readings, field)[rows] for field in names))
        for name, readings in block.stations.items()
    }
    return replace(block, stations=stations)


def test_a_punctual_line_gives_rate_clock_and_no_jitter() -> None:
    found = measure(capture(1, 120.0, ppm=80.0))
    numbers = found.all_stations
    assert set(numbers) == set(TIMING_KEYS)
    assert numbers["components.clock.drift_ppm"].value == pytest.approx(80.0, abs=1.0)
    assert numbers["timing.rate_hz"].value == pytest.approx(40.0 / (1.0 + 80e-6), rel=2e-6)
    assert numbers["timing.rate_hz"].contains(40.0 / (1.0 + 80e-6))
    assert numbers["timing.jitter_s"].value < 2e-5
    assert numbers["timing.lost_share"].value == numbers["timing.duplicate_share"].value == 0.0
    assert numbers["timing.delay_s"].value < 1e-4
    assert set(found.by_station) == set(STATIONS)


@pytest.mark.parametrize(("nominal_hz", "rate_hz"), [(40.0, 40.2), (120.0, 119.0)])
def test_the_rate_is_that_of_the_records(nominal_hz: float, rate_hz: float) -> None:
    found = measure(capture(2, 60.0, rate_hz=rate_hz, ppm=0.0), rate_hz=nominal_hz)
    assert found.all_stations["timing.rate_hz"].value == pytest.approx(rate_hz, rel=1e-5)


def test_jitter_is_the_spread_of_the_stamps_periods() -> None:
    block = capture(3, 120.0, ppm=0.0)
    rng = generator(3, "jitter")
    shaken = {
        name: replace(readings, measured_s=readings.measured_s + rng.normal(0.0, 0.001, len(readings)))
        for name, readings in block.stations.items()
    }
    found = measure(replace(block, stations=shaken)).all_stations["timing.jitter_s"]
    assert found.value == pytest.approx(0.001 * np.sqrt(2.0), rel=0.02)


def test_holes_between_stamps_are_lost_records() -> None:
    block = capture(4, 300.0, noise=noise_preset("noise"))
    keep = generator(4, "lost").uniform(size=12_000) > 0.03
    keep[[0, -1]] = True
    found = measure(rows_of(block, np.flatnonzero(keep))).all_stations["timing.lost_share"]
    share = float(1.0 - keep.mean())
    assert found.value == pytest.approx(share, rel=1e-3)
    assert found.count == 6 * int(np.sum(~keep))


def test_repeated_records_count_and_are_no_time_step() -> None:
    block = capture(5, 300.0, noise=noise_preset("noise"))
    rng = generator(5, "twice")
    rows = np.sort(np.concatenate([np.arange(12_000), np.flatnonzero(rng.uniform(size=12_000) < 0.01)]))
    found = measure(rows_of(block, rows)).all_stations
    twice = len(rows) - 12_000
    assert found["timing.duplicate_share"].count == 6 * twice
    assert found["timing.duplicate_share"].value == pytest.approx(twice / len(rows))
    assert found["timing.duplicate_share"].contains(0.01)
    assert found["timing.lost_share"].value == 0.0
    assert found["timing.rate_hz"].value == pytest.approx(40.0, rel=1e-4)


def test_blocks_join_without_a_seam() -> None:
    block = capture(6, 120.0, delay=host, noise=noise_preset("noise"))
    rows = np.sort(np.concatenate([np.arange(4800), [2399]]))
    whole = measure(rows_of(block, rows)).all_stations
    parts = measure(rows_of(block, rows[:2400]), rows_of(block, rows[2400:])).all_stations
    assert parts["timing.duplicate_share"].count == 6
    for key in ("timing.rate_hz", "timing.lost_share", "timing.duplicate_share", "components.clock.drift_ppm"):
        assert parts[key].value == pytest.approx(whole[key].value, rel=1e-9), key
    other = replace(block, session=1)
    twice = measure(block, other).all_stations
    assert twice["timing.lost_share"].value == 0.0
    assert twice["components.clock.drift_ppm"].value == measure(block).all_stations["components.clock.drift_ppm"].value


def test_stamps_after_five_hours_are_coarse_and_old() -> None:
    young, old = (measure(capture(7, 60.0, age_s=age_s, ppm=20.0)) for age_s in (0.0, 18_000.0))
    assert young.all_stations["timing.stamp_resolution_s"].value == young.expected_resolution_s
    assert old.all_stations["timing.stamp_resolution_s"].value == pytest.approx(0.002)
    assert old.all_stations["timing.clock_age_s"].contains(18_000.0)
    assert young.all_stations["timing.clock_age_s"].contains(0.0)


def test_delay_is_the_mean_beyond_the_most_punctual_record_of_a_second() -> None:
    found = measure(capture(8, 120.0, ppm=0.0, delay=exponential)).all_stations["timing.delay_s"]
    assert found.value == pytest.approx(0.0021, rel=0.1)  # a record also waits for those before it
    assert found.low > 0.0019


def test_records_without_stamps_show_no_time() -> None:
    block = capture(9, 20.0)
    none = np.full(800, np.nan)
    bare = {name: replace(one, measured_s=none, stamp_s=none) for name, one in block.stations.items()}
    numbers = measure(replace(block, stations=bare)).all_stations
    timed = set(TIMING_KEYS) - {"timing.duplicate_share"}
    assert not any(numbers[key].is_measured for key in timed)


def test_a_few_seconds_do_not_compare_clocks() -> None:
    assert not measure(capture(10, 6.0)).all_stations["components.clock.drift_ppm"].is_measured


@pytest.mark.parametrize(("count", "total", "low", "high"), [(0, 100, 0.0, 0.036217), (5, 100, 0.016432, 0.112835)])
def test_shares_have_the_interval_of_clopper_and_pearson(count: int, total: int, low: float, high: float) -> None:
    found = count_share(count, total)
    assert found.low == pytest.approx(low, abs=1e-5)
    assert found.high == pytest.approx(high, abs=1e-5)
    assert count_share(total, total).high == 1.0
    assert not count_share(0, 0).is_measured


def clocks(rounds: int, seconds: float, delay: Delay, *, ppm: float, age_s: float = 0.0) -> list[Interval]:
    return [
        measure(capture(100 + seed, seconds, delay=delay, ppm=ppm, age_s=age_s)).all_stations[
            "components.clock.drift_ppm"
        ]
        for seed in range(rounds)
    ]


@pytest.mark.long
@pytest.mark.parametrize("delay", [exponential, host])
def test_the_clock_s_interval_contains_the_truth_behind_a_busy_host(delay: Delay) -> None:
    found = clocks(25, 300.0, delay, ppm=80.0)
    assert np.mean([one.contains(80.0) for one in found]) >= 0.88, [one.value for one in found]
    assert not any(one.contains(20.0) for one in found)


@pytest.mark.long
def test_the_clock_s_interval_contains_the_truth_with_coarse_stamps() -> None:
    found = clocks(20, 300.0, exponential, ppm=80.0, age_s=18_000.0)
    assert np.mean([one.contains(80.0) for one in found]) >= 0.88
    assert not any(one.contains(20.0) for one in found)


def test_a_line_has_its_slope_and_no_width() -> None:
    at = np.arange(40.0)
    assert robust_slope(at, 3.0 - 0.25 * at) == pytest.approx((-0.25, -0.25, -0.25))


def test_outliers_of_one_side_do_not_turn_the_line() -> None:
    at = np.arange(60.0)
    late = np.where(generator(1, "late").uniform(size=60) < 0.15, 20.0, 0.0)
    slope, low, high = robust_slope(at, 0.1 * at + late)
    assert slope == pytest.approx(0.1, abs=1e-9)
    assert low <= 0.1 <= high


def test_a_few_values_have_the_interval_of_sen() -> None:
    from scipy import stats

    at, values = np.arange(7.0), np.array([0.0, 1.2, 1.9, 3.1, 3.8, 5.3, 6.0])
    expected = stats.theilslopes(values, at, 0.95)
    assert robust_slope(at, values) == pytest.approx((expected[0], expected[2], expected[3]))


@pytest.mark.long
@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_intervals_contain_the_slope_with_correlated_errors(correlation: float) -> None:
    at, rounds = np.arange(60.0), 50
    inside = 0
    for seed in range(rounds):
        errors = gauss_markov(generator(seed, "errors").normal(size=(60, 1)), correlation)[:, 0]
        _, low, high = robust_slope(at, 0.5 * at + errors)
        inside += low <= 0.5 <= high
    assert inside >= 44
