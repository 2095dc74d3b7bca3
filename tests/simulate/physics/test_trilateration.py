"""The first guess of the place of a lost station."""

import numpy as np
import pytest

from harness.core.arrays import Bools, Floats
from harness.simulate.physics.trilateration import EmitterCones, find_shortest, guess_places, latest_ranges, trilaterate
from tests.simulate.physics.free_station import EMITTER_M, NORMAL

CONES = EmitterCones(EMITTER_M, NORMAL, 4.0, 0.342)
PLACE: Floats = np.array([0.3, -0.2, -1.1])


def measured(*rows: tuple[float, float, int]) -> Floats:
    """Ranges (N, 12) of times [s], ranges [m] and emitters."""
    out = np.zeros((len(rows), 12))
    for row, (time_s, range_m, emitter) in zip(out, rows, strict=True):
        row[0], row[1], row[11] = time_s, range_m, emitter
    return out


def shortest_of(ranges: Floats) -> Bools:
    flags = np.zeros(len(ranges), dtype=bool)
    find_shortest(ranges, flags)
    return flags


def guess(latest_m: Floats, age_s: Floats, count: int = 3) -> tuple[Floats, list[list[int]]]:
    places, supports = np.zeros((count, 3)), np.zeros((count, len(latest_m)), dtype=bool)
    found = guess_places(CONES, np.stack([latest_m, age_s], axis=1), places, supports)
    return places[:found], [np.nonzero(support)[0].tolist() for support in supports[:found]]


def test_echoes_and_lonely_ranges_are_not_the_shortest() -> None:
    ranges = measured((-0.4, 1.5, 0), (-0.3, 1.6, 0), (-0.2, 3.6, 0), (-0.1, 0.7, 0), (-0.2, 2.0, 1), (-0.1, 2.1, 1))
    assert shortest_of(ranges).tolist() == [True, True, False, False, True, True]


def test_the_latest_range_is_the_mean_of_both_microphones() -> None:
    ranges, latest = measured((-0.3, 1.4, 0), (-0.2, 1.5, 0), (-0.19, 1.6, 0), (-0.1, 3.0, 0)), np.zeros((2, 2))
    latest_ranges(ranges, np.array([True, True, True, False]), latest)
    np.testing.assert_allclose(latest[0], [1.55, 0.19])
    assert np.isnan(latest[1]).all()


def test_trilateration_gives_both_places(rng: np.random.Generator) -> None:
    points, place, both = rng.uniform(-2.0, 2.0, (3, 3)), rng.uniform(-2.0, 2.0, 3), np.empty((2, 3))
    assert trilaterate(points[0], points[1], points[2], np.linalg.norm(points - place, axis=1), both)
    assert np.linalg.norm(both - place, axis=1).min() < 1e-9
    np.testing.assert_allclose(
        np.linalg.norm(points[None] - both[:, None], axis=2), [np.linalg.norm(points - place, axis=1)] * 2
    )
    assert not trilaterate(np.zeros(3), points[0], 2.5 * points[0], np.ones(3), both)


@pytest.mark.parametrize("late", [(), (0,), (0, 4, 8), (2, 3, 5, 7, 8)])
def test_the_guess_is_where_no_range_is_early(late: tuple[int, ...]) -> None:
    latest_m = np.linalg.norm(EMITTER_M - PLACE, axis=1)
    latest_m[list(late)] += 1.8
    places, supports = guess(latest_m, np.zeros(9))
    best = int(np.argmax([len(support) for support in supports]))
    np.testing.assert_allclose(places[best], PLACE, atol=1e-9)
    assert supports[best] == [j for j in range(9) if j not in late]


def test_an_old_range_of_a_station_that_moves_does_not_refute_a_place() -> None:
    latest_m, age_s = np.linalg.norm(EMITTER_M - PLACE, axis=1), np.zeros(9)
    latest_m[3] -= 0.6
    assert all(np.linalg.norm(place - PLACE) > 0.1 for place in guess(latest_m, age_s)[0])
    age_s[3] = 0.2
    assert any(np.linalg.norm(place - PLACE) < 0.1 for place in guess(latest_m, age_s)[0])


def test_a_place_out_of_reach_is_no_guess() -> None:
    far = np.array([0.0, 0.0, 1.7])
    latest_m = np.linalg.norm(EMITTER_M - far, axis=1)
    assert latest_m.min() > CONES.reach_m + 0.1
    assert not len(guess(latest_m, np.zeros(9))[0])
    aside = np.array([3.0, 0.0, -2.0])
    assert not len(guess(np.linalg.norm(EMITTER_M - aside, axis=1), np.zeros(9))[0])
