"""The samples of an emulated device."""

from dataclasses import replace

import numpy as np
import pytest

from tests.stream.emulator.played import make_samples, with_filter


def test_the_reach_is_that_of_reported_positions_of_tracked_stations() -> None:
    """Station 1 is predicted 0.1 m to the left, station 2 enhanced; station 3 is lost and far away."""
    plain = make_samples(stations=3, instants=4)
    assert plain.reach_m == pytest.approx(1.5)
    quality, position_m = plain.quality.copy(), plain.position_m.copy()
    quality[:, 2], position_m[:, 2] = 0.0019, 40.0
    samples = with_filter(replace(plain, position_m=position_m), prediction_ms=(50, 0, 0), quality=quality)
    assert samples.filter is not None
    velocity_m_s = np.zeros((4, 3, 3))
    velocity_m_s[2, 0] = 0.0, 0.0, 2.0
    enhanced_m = np.zeros((2, 4, 3, 3))
    enhanced_m[1, 3, 1] = 0.0, -1.9, 0.0
    made = replace(samples.filter, velocity_m_s=velocity_m_s, enhanced_position_m=enhanced_m)
    assert replace(samples, filter=made).reach_m == pytest.approx(1.6)
    enhanced = replace(made, enhancement=np.array([0, 2, 0]))
    assert replace(samples, filter=enhanced).reach_m == pytest.approx(1.9)
    assert replace(samples, quality=0.0 * quality).reach_m == 0.0
