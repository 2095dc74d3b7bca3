"""The filter's samples: shapes, ranges of numbers, and the poses that stations report."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from harness.core import rotations
from harness.errors import BadInput, HarnessError
from harness.stream.codec.samples import DeviceSamples, FilterSamples
from tests.stream.emulator.played import make_samples, with_filter

STATIONS = 4
SAMPLES = with_filter(make_samples(STATIONS, instants=20), seed=3)
SETTINGS = st.tuples(
    arrays(np.int64, STATIONS, elements=st.integers(0, 50)), arrays(np.int64, STATIONS, elements=st.integers(0, 2))
)


def filter_of(samples: DeviceSamples) -> FilterSamples:
    assert samples.filter is not None
    return samples.filter


@given(SETTINGS, st.integers(0, 19))
def test_enhancement_selects_the_pose_and_prediction_moves_it_on(
    settings: tuple[np.ndarray, np.ndarray], instant: int
) -> None:
    """Against a plain loop over stations; a round alone has the bits of the whole take."""
    made, (prediction_ms, enhancement) = filter_of(SAMPLES), settings
    whole_m, whole = made.report_poses(SAMPLES.position_m, SAMPLES.tracker_from_station, prediction_ms, enhancement)
    one_m, one = made.report_poses(
        SAMPLES.position_m[instant], SAMPLES.tracker_from_station[instant], prediction_ms, enhancement, instant
    )
    assert (one_m.tobytes(), one.tobytes()) == (whole_m[instant].tobytes(), whole[instant].tobytes())
    for row, (ms, mode) in enumerate(zip(prediction_ms, enhancement, strict=True)):
        positions_m, turns = SAMPLES.position_m, SAMPLES.tracker_from_station
        if mode:
            positions_m, turns = made.enhanced_position_m[mode - 1], made.enhanced_tracker_from_station[mode - 1]
        ahead_s = ms / 1000.0
        expected_m = positions_m[instant, row] + ahead_s * made.velocity_m_s[instant, row]
        expected = rotations.multiply(rotations.exp(ahead_s * made.turn_rad_s[instant, row]), turns[instant, row])
        np.testing.assert_allclose(one_m[row], expected_m, atol=1e-12)
        np.testing.assert_allclose(one[row], expected, atol=1e-12)


@pytest.mark.parametrize(
    "changed",
    [
        {"ranges_received": np.full((20, STATIONS), 13)},
        {"ranges_rejected": np.full((20, STATIONS), -1)},
        {"prediction_ms": np.array([0, 0, 51, 0])},
        {"enhancement": np.array([0, 3, 0, 0])},
    ],
)
def test_numbers_out_of_range_are_refused(changed: dict[str, Any]) -> None:
    (name,) = changed
    with pytest.raises(BadInput, match=name):
        replace(filter_of(SAMPLES), **changed)


@pytest.mark.parametrize(
    "changed",
    [
        {"velocity_m_s": np.zeros((19, STATIONS, 3))},
        {"turn_rad_s": np.zeros((20, STATIONS, 4))},
        {"enhanced_position_m": np.zeros((3, 20, STATIONS, 3))},
        {"enhanced_tracker_from_station": np.zeros((2, 20, STATIONS, 3))},
        {"ranges_rejected": np.zeros((20, STATIONS + 1))},
        {"prediction_ms": np.zeros(STATIONS + 1)},
    ],
)
def test_wrong_shapes_are_refused(changed: dict[str, Any]) -> None:
    with pytest.raises(HarnessError):
        replace(filter_of(SAMPLES), **changed)


def test_a_filter_of_other_instants_or_stations_does_not_belong_to_the_samples() -> None:
    for other in (make_samples(STATIONS, instants=19), make_samples(3, instants=20)):
        with pytest.raises(HarnessError, match="filter"):
            replace(other, filter=filter_of(SAMPLES))
