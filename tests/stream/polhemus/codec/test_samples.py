"""The samples of an emulated device."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput, HarnessError
from harness.stream.polhemus.codec.samples import DeviceSamples, FilterSamples, predict_poses
from tests.stream.is900.emulator.played import make_samples, with_filter

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


VECTORS = arrays(float, (STATIONS, 3), elements=st.floats(-20.0, 20.0))
TURNS = VECTORS.map(rotations.exp)
PREDICTIONS = arrays(np.int64, STATIONS, elements=st.integers(0, 50))


def test_position_moves_along_the_velocity_and_the_station_turns_about_the_trackers_axis() -> None:
    """A station that points to the right turns about the tracker's z, at 1 rad/s for 50 ms: its heading grows."""
    right = rotations.about_z(np.array([np.pi / 2.0]))
    tilted = rotations.multiply(right, rotations.exp(np.array([[0.7, 0.0, 0.0]])))
    position_m, turned = predict_poses(
        np.array([[1.0, 2.0, 3.0]]), tilted, np.array([[2.0, 0.0, -4.0]]), np.array([[0.0, 0.0, 1.0]]), np.array([50])
    )
    np.testing.assert_allclose(position_m, [[1.1, 2.0, 2.8]], atol=1e-12)
    np.testing.assert_allclose(turned, rotations.multiply(rotations.about_z(0.05), tilted), atol=1e-12)


@given(VECTORS, TURNS, VECTORS, VECTORS, PREDICTIONS)
def test_a_prediction_is_a_rigid_motion_and_none_changes_nothing(
    position_m: Floats, turn: Floats, velocity_m_s: Floats, turn_rad_s: Floats, prediction_ms: np.ndarray
) -> None:
    there_m, turned = predict_poses(position_m, turn, velocity_m_s, turn_rad_s, prediction_ms)
    still = prediction_ms == 0
    assert there_m[still].tobytes() == position_m[still].tobytes()
    assert turned[still].tobytes() == turn[still].tobytes()
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), 1.0, atol=1e-12)
    back_m, back = predict_poses(there_m, turned, -velocity_m_s, -turn_rad_s, prediction_ms)
    np.testing.assert_allclose(back_m, position_m, atol=1e-12)
    np.testing.assert_allclose(back, turn, atol=1e-12)


def test_without_prediction_not_even_the_sign_of_zero_changes() -> None:
    zero = np.full((2, 3), -0.0)
    position_m, turn = predict_poses(zero, np.array([[1.0, -0.0, 0.0, -0.0]]), -zero, zero, np.array([0, 1]))
    assert np.signbit(position_m).tolist() == [[True] * 3, [False] * 3]
    assert np.signbit(turn[0]).tolist() == [False, True, False, True]


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
