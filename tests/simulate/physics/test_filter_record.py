"""Offsets of the enhancement modes."""

import numpy as np
import pytest

from harness.core import rotations
from harness.simulate.physics.filter_record import add_to_offset, decay_offsets


def test_an_offset_undoes_a_correction(rng: np.random.Generator) -> None:
    offset, moved, turn = np.array([0.01, 0.0, 0.0, 0.1, -0.2, 0.05]), rng.standard_normal(3), np.array([0.0, 0.1, 0.2])
    before, shown = rotations.exp(rng.standard_normal(3)), rotations.exp(offset[3:])
    shown = rotations.multiply(shown, before)
    add_to_offset(offset, moved, *turn)
    after = rotations.multiply(rotations.exp(offset[3:]), rotations.multiply(rotations.exp(turn), before))
    assert rotations.angle_between_rad(shown, after) < 1e-12
    np.testing.assert_allclose(offset[:3] + moved, [0.01, 0.0, 0.0])


@pytest.mark.parametrize(("speed_m_s", "turn_rad_s", "moving"), [(0.0, 0.0, 1.0), (0.1, 0.0, 0.78), (0.0, 0.5, 0.78)])
def test_mode_2_corrects_only_while_moving(speed_m_s: float, turn_rad_s: float, moving: float) -> None:
    offsets = np.ones((2, 6))
    for _ in range(20):
        decay_offsets(offsets, 0.0125, speed_m_s, turn_rad_s)
    np.testing.assert_allclose(offsets[0], np.exp(-1.0))
    np.testing.assert_allclose(offsets[1], moving, atol=0.002)


def test_offsets_decay_at_most_as_fast_as_the_limit() -> None:
    offsets = np.ones((2, 6))
    decay_offsets(offsets, 0.0125, 100.0, 100.0)
    np.testing.assert_allclose(offsets[1], np.exp(-0.25))
