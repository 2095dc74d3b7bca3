"""Device time continues, whatever the clock's stamps do."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.stream.polhemus.codec.clock import ClockUnwrapper, TimeOrder
from tests.stream.wire import RATE_HZ, stamps_s

HOST_S: Floats = stamps_s(50) + 1000.0


def unwrap(stamp_s: Floats, host_s: Floats = HOST_S, chunks: int = 1) -> tuple[Floats, ClockUnwrapper]:
    clock = ClockUnwrapper(1.0 / RATE_HZ)
    columns = stamp_s, host_s, np.arange(len(stamp_s)) % 4
    parts = zip(*(np.array_split(column, chunks) for column in columns), strict=True)
    return np.concatenate([clock.unwrap(*part) for part in parts]), clock


def reset_at(stamp_s: Floats, at: int) -> Floats:
    """Return the stamps of a clock that was set to zero before record `at`."""
    return np.where(np.arange(len(stamp_s)) < at, stamp_s, stamp_s - stamp_s[at] + 0.001)


def test_a_steady_clock_is_unchanged() -> None:
    out, clock = unwrap(stamps_s(50))
    np.testing.assert_array_equal(out, stamps_s(50))
    assert clock.resets == 0


@pytest.mark.parametrize("at", [1, 7, 100, 198])
def test_setting_the_clock_to_zero_costs_one_stamp_and_no_time(at: int) -> None:
    out, clock = unwrap(reset_at(stamps_s(50), at))
    assert np.flatnonzero(np.isnan(out)).tolist() == [at]
    valid = ~np.isnan(out)
    np.testing.assert_allclose(out[valid], stamps_s(50)[valid], atol=1e-9)
    assert clock.resets == 1


def test_a_clock_may_be_set_to_zero_many_times() -> None:
    true_s = stamps_s(400)
    stamp_s = true_s
    for at in (200, 600, 800, 1500):
        stamp_s = reset_at(stamp_s, at)
    out, clock = unwrap(stamp_s, true_s + 1000.0)
    assert np.flatnonzero(np.isnan(out)).tolist() == [200, 600, 800, 1500]
    valid = ~np.isnan(out)
    np.testing.assert_allclose(out[valid], true_s[valid], atol=1e-9)
    assert clock.resets == 4


@pytest.mark.parametrize("wrong_s", [1e30, -3.0, 0.0, 4000.0, np.inf, np.nan, 11.0])
@pytest.mark.parametrize("at", [1, 77, 199])
def test_a_damaged_stamp_costs_only_itself(wrong_s: float, at: int) -> None:
    stamp_s = stamps_s(50)
    stamp_s[at] = wrong_s
    out, clock = unwrap(stamp_s)
    assert np.flatnonzero(np.isnan(out)).tolist() == [at]
    np.testing.assert_array_equal(np.delete(out, at), np.delete(stamps_s(50), at))
    assert clock.resets == 0


@pytest.mark.parametrize("wrong_s", [9e6, 4000.0, np.nan])
def test_time_survives_a_damaged_first_stamp(wrong_s: float) -> None:
    """Whatever the first stamp was, time advances correctly from the third on."""
    stamp_s = stamps_s(50)
    stamp_s[0] = wrong_s
    out, _ = unwrap(stamp_s)
    np.testing.assert_allclose(np.diff(out[3:]), np.diff(stamps_s(50)[3:]), atol=1e-6)


@pytest.mark.parametrize("chunks", [1, 2, 13, 200])
def test_pieces_do_not_matter(chunks: int, rng: np.random.Generator) -> None:
    stamp_s = reset_at(stamps_s(50), 90)
    stamp_s[rng.integers(0, 200, 8)] = rng.uniform(0.0, 1e6, 8)
    np.testing.assert_array_equal(unwrap(stamp_s, chunks=chunks)[0], unwrap(stamp_s)[0])


def test_late_reading_by_the_host_is_no_reason_for_doubt(rng: np.random.Generator) -> None:
    late_s = np.maximum.accumulate(HOST_S + rng.uniform(0.0, 0.2, len(HOST_S)))
    out, clock = unwrap(stamps_s(50), late_s)
    np.testing.assert_array_equal(out, stamps_s(50))
    assert clock.resets == 0


def test_stamps_are_accepted_after_a_long_silence() -> None:
    pause = np.where(np.arange(200) < 80, 0.0, 3600.0)
    out, clock = unwrap(stamps_s(50) + pause, HOST_S + pause)
    np.testing.assert_array_equal(out, stamps_s(50) + pause)
    assert clock.resets == 0


@pytest.mark.parametrize("off_s", [-0.256, -0.249, -0.128, 0.128, 0.249, 0.256])
@pytest.mark.parametrize("at", [1, 77, 198])
def test_a_stamp_near_the_tolerance_shifts_no_other(off_s: float, at: int) -> None:
    """A flipped bit may shift a stamp by 256 ms. Accepted or not, time must not continue from there."""
    stamp_s = stamps_s(50)
    stamp_s[at] += off_s
    for chunks in (1, 7, 200):
        out, clock = unwrap(stamp_s, chunks=chunks)
        np.testing.assert_array_equal(np.delete(out, at), np.delete(stamps_s(50), at))
        assert clock.resets == 0


@pytest.mark.parametrize("step_s", [10.0, -0.4])
def test_stamps_that_all_run_ahead_or_back_are_all_damaged(step_s: float) -> None:
    """After a steady second, two stamps that each differ from the one before by far more than the host's clock."""
    steady_s: Floats = 5.0 + 0.025 * np.arange(40, dtype=np.float64)
    clock, one = ClockUnwrapper(0.025), np.zeros(40, np.int64)
    np.testing.assert_array_equal(clock.unwrap(steady_s, steady_s + 1000.0, one), steady_s)
    received_s: Floats = steady_s[-1] + 1000.0 + 0.025 * np.arange(1, 3)
    wrong_s: Floats = steady_s[-1] + step_s * np.arange(1, 3)
    assert np.isnan(clock.unwrap(wrong_s, received_s, one[:2])).all()
    next_s: Floats = steady_s[-1] + np.array([0.075, 0.1])
    np.testing.assert_array_equal(clock.unwrap(next_s, next_s + 1000.0, one[:2]), next_s)


def test_the_first_stamp_cannot_be_ahead_of_the_time_since_the_clock_was_set_to_zero() -> None:
    """The first record after `MZ` is damaged: it costs itself, and time is that of the device."""
    stamp_s = stamps_s(10, begin_s=0.1)
    received_s, station = stamp_s + 1000.0, np.arange(len(stamp_s)) % 4
    stamp_s[0] += 4.0
    out = ClockUnwrapper(1.0 / RATE_HZ, zeroed_s=1000.0).unwrap(stamp_s, received_s, station)
    assert np.flatnonzero(np.isnan(out)).tolist() == [0]
    np.testing.assert_array_equal(out[1:], stamp_s[1:])


@pytest.mark.parametrize("ahead_s", [0.008, 0.016, 0.032, 0.064, 0.128, 0.2])
def test_a_stamp_that_is_ahead_by_less_than_the_hosts_delays_is_damaged(ahead_s: float) -> None:
    stamp_s = stamps_s(50)
    stamp_s[102] += ahead_s
    out, _ = unwrap(stamp_s)
    assert np.flatnonzero(np.isnan(out)).tolist() == [102]


@pytest.mark.parametrize("chunks", [1, 7, 196])
@pytest.mark.parametrize("late_s", [0.020, 0.2])
@pytest.mark.parametrize("lost", [[98], [100, 101, 102, 103], [97, 102]])
def test_a_lost_record_after_one_that_was_read_late_costs_no_further_stamp(
    lost: list[int], late_s: float, chunks: int
) -> None:
    """The rounds 23 and 24 were read late: a busy host. By the device's clock the next record is two periods after its
    station's last one, and by the host's clock less than one.
    """
    stamp_s = stamps_s(50)
    read_s = np.maximum.accumulate(stamp_s + np.where(np.arange(200) // 4 == 23, late_s, 0.0))
    kept = np.delete(np.arange(200), lost)
    clock = ClockUnwrapper(1.0 / RATE_HZ)
    columns = (np.array_split(column, chunks) for column in (stamp_s[kept], 1000.0 + read_s[kept], kept % 4))
    out = np.concatenate([clock.unwrap(*part) for part in zip(*columns, strict=True)])
    np.testing.assert_array_equal(out, stamp_s[kept])
    assert clock.resets == 0


@pytest.mark.parametrize("rate", [1.0 - 5e-4, 1.0, 1.0 + 5e-4])
def test_a_stamp_ahead_is_damaged_whatever_the_clocks_rates(rate: float) -> None:
    """The host's earliest reading is that of the last seconds, so that a drift of the clocks hides nothing."""
    stamp_s = stamps_s(2400)
    received_s = 1000.0 + rate * stamp_s
    stamp_s[9402] += 0.032
    out, _ = unwrap(stamp_s, received_s)
    assert np.flatnonzero(np.isnan(out)).tolist() == [9402]


def test_times_that_do_not_advance_are_removed() -> None:
    order, nan = TimeOrder(), float("nan")
    times_s, station = np.array([1.0, 1.0, 1.5, 1.2, nan, 1.5]), np.array([0, 1, 2, 3, 0, 1])
    np.testing.assert_array_equal(order.enforce(times_s, station), [1.0, 1.0, 1.5, nan, nan, nan])
    np.testing.assert_array_equal(order.enforce(np.array([1.5, 1.6]), np.array([2, 3])), [nan, 1.6])
    np.testing.assert_array_equal(order.enforce(np.array([1.6]), np.array([0])), [nan])
