"""Coverage by place, beside plain computations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.simulate.physics.constellation import Constellation, ConstellationSettings, load_constellation
from harness.simulate.physics.coverage import PLAN_POINTS, dilution_of_precision, emitter_coverage, grid_m, plan_axes_m
from harness.stream.codec.replies import Emitter


def cave(cone_deg: float = 70.0, range_m: float = 4.0) -> Constellation:
    return load_constellation(ConstellationSettings(name="cave", cone_deg=cone_deg, range_m=range_m))


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), emitters=st.integers(1, 9))
def test_dilution_is_that_of_the_inverted_matrix(seed: int, emitters: int) -> None:
    rng = np.random.default_rng(seed)
    unit = rng.normal(size=(5, emitters, 3))
    unit /= np.linalg.norm(unit, axis=-1, keepdims=True)
    heard = rng.random((5, emitters)) < 0.7
    found = dilution_of_precision(unit, heard)
    for row in range(5):
        g = unit[row, heard[row]]
        if len(g) < 3:
            assert np.isnan(found[row])
        elif np.linalg.cond(g.T @ g) < 1e6:
            np.testing.assert_allclose(found[row], np.sqrt(np.trace(np.linalg.inv(g.T @ g))), rtol=1e-6)


def test_dilution_of_known_arrangements() -> None:
    axes = np.eye(3)
    assert dilution_of_precision(axes, np.ones(3, bool)) == pytest.approx(3.0**0.5)
    assert dilution_of_precision(np.concatenate([axes, -axes]), np.ones(6, bool)) == pytest.approx(1.5**0.5)
    in_a_plane = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.6, 0.8, 0.0]])
    assert np.isnan(dilution_of_precision(in_a_plane, np.ones(3, bool)))


def test_places_are_heard_in_range_and_cone() -> None:
    places_m = np.array([[0.0, 0.0, 1.5], [0.0, 0.0, 4.0], [0.0, 0.0, 4.1], [0.0, 0.0, -0.5], [0.0, 0.0, 0.3]])
    found = emitter_coverage(cave(), places_m)
    assert found.heard.tolist() == [9, 1, 0, 0, 3]
    assert (found.share, found.fixed_share) == pytest.approx((0.4, 0.2))
    assert found.median_heard == 1.0
    assert np.isfinite(found.dilution[0])
    assert np.isnan(found.dilution[1:]).all(), "three emitters of one bar and the place lie in a plane"
    assert found.median_dilution == pytest.approx(found.dilution[0])
    assert np.isnan(emitter_coverage(cave(), places_m[1:]).median_dilution)


def test_a_place_at_an_emitter_is_no_error() -> None:
    assert emitter_coverage(cave(), np.zeros((1, 3))).heard.tolist() == [0]


def test_a_narrower_cone_and_a_shorter_range_are_heard_less() -> None:
    grid = np.stack(np.meshgrid(*[np.linspace(-1.5, 1.5, 7)] * 2, np.linspace(0.5, 2.5, 5)), axis=-1).reshape(-1, 3)
    whole = emitter_coverage(cave(), grid).heard
    for less in (cave(cone_deg=40.0), cave(range_m=2.5)):
        heard = emitter_coverage(less, grid).heard
        assert np.all(heard <= whole)
        assert heard.sum() < whole.sum()


def test_an_emitter_that_faces_away_is_not_heard() -> None:
    up = [Emitter(n, (0.1 * n, 0.02 * n * n, 0.0), (0.0, 0.0, -1.0), n) for n in (1, 2, 3)]
    assert emitter_coverage(Constellation.of_emitters(up, 1.2, 4.0), np.array([[0.0, 0.0, 1.0]])).heard.tolist() == [0]


def test_a_plan_view_shows_the_emitters_and_two_metres_around() -> None:
    x_m, y_m = plan_axes_m(cave().shifted(np.array([1.0, 0.0, 0.0])))
    assert (len(x_m), len(y_m)) == (PLAN_POINTS, PLAN_POINTS)
    np.testing.assert_allclose([x_m[0], x_m[-1], y_m[0], y_m[-1]], [-1.9144, 3.9144, -2.6096, 2.6096])


def test_a_grid_has_each_place_once() -> None:
    places = grid_m(np.array([0.0, 1.0]), np.array([2.0, 3.0, 4.0]), np.array([5.0]))
    assert places.tolist() == [[x, y, 5.0] for x in (0.0, 1.0) for y in (2.0, 3.0, 4.0)]
