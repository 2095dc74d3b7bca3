"""Prediction of poses."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from harness.core import rotations
from harness.core.arrays import Floats
from harness.stream.codec.samples import predict_poses

STATIONS = 3
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


def test_the_bits_do_not_depend_on_the_number_of_instants(rng: np.random.Generator) -> None:
    """A simulation predicts a whole take, the emulator one round."""
    position_m, velocity_m_s, turn_rad_s = rng.normal(size=(3, 257, STATIONS, 3))
    turn = rotations.exp(rng.normal(size=(257, STATIONS, 3)))
    prediction_ms = np.array([0, 17, 50])
    whole_m, whole = predict_poses(position_m, turn, velocity_m_s, turn_rad_s, prediction_ms)
    for at in (0, 100, 256):
        one_m, one = predict_poses(position_m[at], turn[at], velocity_m_s[at], turn_rad_s[at], prediction_ms)
        assert (one_m.tobytes(), one.tobytes()) == (whole_m[at].tobytes(), whole[at].tobytes())
