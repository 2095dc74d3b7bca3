"""Times of measurement on the host's clock, from stamps of the device's."""

import numpy as np
import pytest

from harness.stream.host_clock import HostClockEstimator
from tests.live.posing import frame


def test_the_host_time_of_a_measurement_forgets_late_frames(rng: np.random.Generator) -> None:
    clock, true_s, delay_s = HostClockEstimator(), np.arange(4000) / 75.0, 0.005
    held_up_s = rng.exponential(0.004, size=4000)
    drift = 1.0 + 2e-5
    found_s = [
        clock.measured_s(frame(1000.0 + t + delay_s + held, 50.0 + drift * t))
        for t, held in zip(true_s.tolist(), held_up_s.tolist(), strict=True)
    ]
    error_s = np.array(found_s) - (1000.0 + true_s + delay_s)
    assert np.abs(error_s[500:]).max() < 0.002
    assert np.std(held_up_s) > 0.003


def test_a_device_that_sets_its_clock_anew_is_followed() -> None:
    clock = HostClockEstimator()
    clock.measured_s(frame(100.0, 50.0))
    assert clock.measured_s(frame(100.1, 50.1)) == pytest.approx(100.1)
    assert clock.measured_s(frame(100.2, 0.0)) == pytest.approx(100.2)
    assert clock.measured_s(frame(100.3, float("nan"))) == 100.3


def test_a_host_that_stalls_for_seconds_reads_the_true_times_of_what_it_missed() -> None:
    """The stamps of 2.5 s arrive at once; the device's clock goes on."""
    clock, true_s = HostClockEstimator(), np.arange(400) / 40.0
    received_s = np.where((true_s > 3.0) & (true_s < 5.5), 5.5 + 1e-4 * np.arange(400), true_s) + 100.0
    found_s = [clock.measured_s(frame(r, 50.0 + t)) for r, t in zip(received_s.tolist(), true_s.tolist(), strict=True)]
    np.testing.assert_allclose(found_s, 100.0 + true_s, atol=2e-3)


def test_a_clock_that_is_set_anew_to_a_later_stamp_is_followed_within_a_second() -> None:
    """In a pause of 10 s the device restarted: its stamp is 3 s later than before the pause."""
    clock = HostClockEstimator()
    clock.measured_s(frame(100.0, 5.0))
    found_s = [clock.measured_s(frame(110.0 + k / 40.0, 8.0 + k / 40.0)) for k in range(80)]
    assert found_s[39] < 110.0
    np.testing.assert_allclose(found_s[40:], 110.0 + np.arange(40, 80) / 40.0, atol=1e-6)


def test_a_clock_that_jumps_ahead_is_followed_at_once() -> None:
    clock = HostClockEstimator()
    clock.measured_s(frame(100.0, 5.0))
    assert clock.measured_s(frame(100.1, 25.0)) == pytest.approx(100.1)


def test_the_host_time_never_steps_back_when_the_delay_shrinks() -> None:
    """The first frames wait 180 ms in the host; then the wait ends at once."""
    clock = HostClockEstimator()
    delays_s = [0.180] * 5 + [0.005] * 20
    found_s = [clock.measured_s(frame(100.0 + k / 75.0 + late, 50.0 + k / 75.0)) for k, late in enumerate(delays_s)]
    assert (np.diff(found_s) > 0.0).all()
    assert found_s[-1] == pytest.approx(100.0 + 24 / 75.0 + 0.005, abs=1e-3)


def test_without_stamps_the_time_is_that_of_reception() -> None:
    clock = HostClockEstimator()
    assert clock.measured_s(frame(100.0, np.nan)) == 100.0
    assert clock.measured_s(frame(100.025, np.nan)) == 100.025


def test_times_wait_where_a_frame_with_less_delay_corrects_them() -> None:
    clock = HostClockEstimator()
    late_s = clock.measured_s(frame(100.1, 50.0))
    on_time_s = clock.measured_s(frame(100.0251, 50.025))
    assert late_s == 100.1
    assert late_s < on_time_s < late_s + 1e-9
    assert clock.measured_s(frame(100.2, 50.1751)) == pytest.approx(100.1752)
