"""The level law and the noise that follows from it."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.simulate.physics.sound import NOISE_AT_M, level_db, noise_factor, threshold_db

ABSORPTION = 1.3
distances = st.floats(0.05, 10.0)
cosines = st.floats(0.0, 1.0)


def test_a_level_by_hand() -> None:
    assert level_db(1.0, 1.0, 1.0, ABSORPTION) == 0.0
    assert level_db(2.0, 1.0, 1.0, ABSORPTION) == pytest.approx(-20.0 * math.log10(2.0) - 1.3)
    assert level_db(1.0, 0.5, 1.0, ABSORPTION) == pytest.approx(20.0 * math.log10(0.5))
    assert level_db(1.0, 1.0, 0.0, ABSORPTION) == pytest.approx(20.0 * math.log10(0.5))
    assert level_db(1.0, 1.0, -0.5, ABSORPTION) == pytest.approx(20.0 * math.log10(0.25))


def test_behind_a_microphone_is_silence_and_no_error() -> None:
    assert -200.0 < level_db(1.0, 1.0, -1.0, ABSORPTION) < -100.0
    assert math.isfinite(level_db(0.0, 0.0, -1.0, ABSORPTION))


def test_the_threshold_is_the_level_at_the_corner_of_the_coverage() -> None:
    cone = math.radians(70.0)
    expected = 20.0 * math.log10(math.cos(cone) / 4.0) - 3.0 * ABSORPTION
    assert threshold_db(4.0, cone, ABSORPTION) == pytest.approx(expected)


@settings(deadline=None)
@given(distances, cosines, cosines)
def test_noise_is_inverse_to_the_amplitude_within_limits(distance_m: float, emitter: float, station: float) -> None:
    loss_db = level_db(NOISE_AT_M, 1.0, 1.0, ABSORPTION) - level_db(distance_m, emitter, station, ABSORPTION)
    factor = noise_factor(level_db(distance_m, emitter, station, ABSORPTION), ABSORPTION)
    assert 0.5 <= factor <= 4.0
    if 0.5 < factor < 4.0:
        assert 20.0 * math.log10(factor) == pytest.approx(loss_db, abs=1e-9)


def test_the_noise_is_specified_at_two_metres() -> None:
    assert noise_factor(level_db(2.0, 1.0, 1.0, ABSORPTION), ABSORPTION) == pytest.approx(1.0)
    assert noise_factor(0.0, ABSORPTION) == 0.5
    assert noise_factor(-60.0, ABSORPTION) == 4.0
