"""Ticks of times, and which emitter fires in each slot."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.simulate.physics.constellation import ConstellationSettings, load_constellation
from harness.simulate.physics.schedule import NEAR_EMITTERS, FiringOrder, Schedule

HALL_M: Floats = load_constellation(ConstellationSettings(name="hall")).position_m
CAVE_M: Floats = load_constellation(ConstellationSettings(name="cave")).position_m


def standing(slots: int, x: float = 0.0, y: float = 0.0) -> Floats:
    """A performer who stands below the ceiling of the emitters."""
    return np.tile([x, y, 1.5], (slots, 1))


def test_a_time_that_is_off_by_its_last_bits_has_the_same_tick() -> None:
    """400 ticks per second: 0.575 s are tick 230, though 0.575 * 400 is 229.99999999999997 in 64 bits."""
    schedule = Schedule(400.0, 9)
    for seconds, tick in ((0.575, 230), (3 / 120, 10), (1.0 - 0.975, 10), (1e4 + 0.1, 4_000_040), (-0.0125, -5)):
        for time_s in (seconds, np.nextafter(seconds, -np.inf), np.nextafter(seconds, np.inf)):
            found, fraction = schedule.ticks_at(np.array([[time_s]]))
            assert (found.item(), fraction.item()) == (tick, 0.0)


def test_a_time_between_ticks_keeps_its_place() -> None:
    tick, fraction = Schedule(400.0, 9).ticks_at(np.array([0.0012, 0.0037, 0.0049999]))
    np.testing.assert_array_equal(tick, [0, 1, 1])
    np.testing.assert_allclose(fraction, [0.48, 0.48, 0.99996], atol=1e-8)


def test_few_emitters_fire_in_a_fixed_turn_wherever_the_performer_is() -> None:
    order = FiringOrder(CAVE_M, 9, -2)
    near, far = order.next_emitters(standing(7)), order.next_emitters(standing(12, 40.0, -3.0))
    np.testing.assert_array_equal(np.concatenate([near, far]), np.arange(-2, 17) % 9)
    assert Schedule(400.0, 9).turn_slots == 9


def test_of_many_emitters_the_nearest_fire_in_turn() -> None:
    fired = FiringOrder(HALL_M, NEAR_EMITTERS, 0).next_emitters(standing(5 * NEAR_EMITTERS, 1.3, -2.1))
    away_m = np.linalg.norm(HALL_M - [1.3, -2.1, 1.5], axis=1)
    nearest = set(np.argsort(away_m)[:NEAR_EMITTERS].tolist())
    for turn in fired.reshape(5, NEAR_EMITTERS):
        assert set(turn.tolist()) == nearest
        np.testing.assert_array_equal(turn, fired[:NEAR_EMITTERS])
    assert Schedule(400.0, len(HALL_M)).turn_slots == NEAR_EMITTERS


def test_of_emitters_that_are_equally_far_the_first_fire() -> None:
    around_m = [[np.cos(a), np.sin(a), 0.0] for a in np.pi / 2.0 * np.arange(4)]
    fired = FiringOrder(np.array(around_m).round(9), 3, 0).next_emitters(standing(9))
    np.testing.assert_array_equal(fired, np.arange(9) % 3)


def test_a_new_emitter_fires_first_where_the_performer_walks() -> None:
    order = FiringOrder(HALL_M, NEAR_EMITTERS, 0)
    before = order.next_emitters(standing(2 * NEAR_EMITTERS))
    after = order.next_emitters(standing(NEAR_EMITTERS, 2.5))
    new = set(after.tolist()) - set(before.tolist())
    assert 0 < len(new) < NEAR_EMITTERS
    assert set(after[: len(new)].tolist()) == new


@pytest.mark.parametrize("slots", [1, 7, 50])
def test_the_order_does_not_depend_on_the_size_of_the_blocks(slots: int) -> None:
    walk_m = np.linspace([-4.0, 2.0, 1.5], [4.0, -3.0, 1.5], 400)
    whole = FiringOrder(HALL_M, NEAR_EMITTERS, -30).next_emitters(walk_m)
    pieces = FiringOrder(HALL_M, NEAR_EMITTERS, -30)
    parts = [pieces.next_emitters(walk_m[first : first + slots]) for first in range(0, 400, slots)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    assert len(set(whole.tolist())) > 2 * NEAR_EMITTERS
