"""Coverage by place, beside plain computations."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.body import Mount, build_body, retarget_to_own_body
from harness.core.motion import BodyMotion
from harness.experiment.scenarios import Station, read_station_sets
from harness.mocap import synthetic
from harness.simulate.link import TrackerConfig
from harness.simulate.physics.constellation import Constellation, ConstellationSettings, load_constellation
from harness.simulate.physics.coverage import (
    MOST_SAMPLES,
    PLAN_POINTS,
    StationCoverage,
    audible_emitters,
    dilution_of_precision,
    emitter_coverage,
    grid_m,
    plan_axes_m,
    station_coverage,
)
from harness.simulate.physics.room import Box, Room
from harness.simulate.physics.sound import Sound
from harness.simulate.simulation import exact_calibration
from harness.stream.polhemus.codec import Emitter


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
    assert found.emitters.tolist() == [9, 1, 0, 0, 3]
    assert (found.share, found.fix_share) == pytest.approx((0.4, 0.2))
    assert found.median_emitters == 1.0
    assert np.isfinite(found.dilution[0])
    assert np.isnan(found.dilution[1:]).all(), "three emitters of one bar and the place lie in a plane"
    assert found.median_dilution == pytest.approx(found.dilution[0])
    assert np.isnan(emitter_coverage(cave(), places_m[1:]).median_dilution)


def test_a_place_at_an_emitter_is_no_error() -> None:
    assert emitter_coverage(cave(), np.zeros((1, 3))).emitters.tolist() == [0]


def test_a_narrower_cone_and_a_shorter_range_are_heard_less() -> None:
    grid = np.stack(np.meshgrid(*[np.linspace(-1.5, 1.5, 7)] * 2, np.linspace(0.5, 2.5, 5)), axis=-1).reshape(-1, 3)
    whole = emitter_coverage(cave(), grid).emitters
    for less in (cave(cone_deg=40.0), cave(range_m=2.5)):
        heard = emitter_coverage(less, grid).emitters
        assert np.all(heard <= whole)
        assert heard.sum() < whole.sum()


def test_an_emitter_that_faces_away_is_not_heard() -> None:
    up = [Emitter(n, (0.1 * n, 0.02 * n * n, 0.0), (0.0, 0.0, -1.0), n) for n in (1, 2, 3)]
    assert emitter_coverage(Constellation.of_emitters(up, 1.2, 4.0), np.array([[0.0, 0.0, 1.0]])).emitters.tolist() == [
        0
    ]


def test_a_plan_view_shows_the_emitters_and_two_metres_around() -> None:
    x_m, y_m = plan_axes_m(cave().translate(np.array([1.0, 0.0, 0.0])))
    assert (len(x_m), len(y_m)) == (PLAN_POINTS, PLAN_POINTS)
    np.testing.assert_allclose([x_m[0], x_m[-1], y_m[0], y_m[-1]], [-1.9144, 3.9144, -2.6096, 2.6096])


def test_a_grid_has_each_place_once() -> None:
    places = grid_m(np.array([0.0, 1.0]), np.array([2.0, 3.0, 4.0]), np.array([5.0]))
    assert places.tolist() == [[x, y, 5.0] for x in (0.0, 1.0) for y in (2.0, 3.0, 4.0)]


CAVE = load_constellation(ConstellationSettings(name="cave"))
FACING_UP = np.array([[0.0, 1.0, 0.0, 0.0]])
"""Half a turn about x: the station's z points against the tracker's, up to the ceiling."""


def test_a_station_hears_what_it_faces() -> None:
    at_m = np.array([[0.0, 0.0, 1.5]])
    assert audible_emitters(CAVE, at_m, FACING_UP, Sound(), None).all()
    facing_down = np.array([[1.0, 0.0, 0.0, 0.0]])
    assert not audible_emitters(CAVE, at_m, facing_down, Sound(), None).any()
    forward = np.array([[np.cos(np.pi / 4), 0.0, np.sin(np.pi / 4), 0.0]])
    heard = audible_emitters(CAVE, np.array([[0.0, 0.0, 0.6]]), forward, Sound(), None)[0]
    assert heard[3:].sum() > heard[:6].sum(), "emitters in front are louder than those behind"


def still(seconds: float = 1.0) -> BodyMotion:
    _, motion = retarget_to_own_body(synthetic.generate("boxing", "p1", 1, seed=1, duration_s=1.0, rate_hz=40.0))
    return BodyMotion("still", "p1", "test", "boxing", 40.0, np.tile(motion.qpos[:1], (round(40.0 * seconds) + 1, 1)))


def test_the_body_and_furniture_shadow_a_station() -> None:
    body = build_body(synthetic.performer_skeleton("p1"))
    mounts = [Mount("chest", "thorax", 0.5, 0.0), Mount("back", "thorax", 0.5, np.pi)]
    calibration = exact_calibration(body, mounts, TrackerConfig())
    open_room, shadow = Room(shadow=False), Room()
    free = station_coverage(CAVE, body, still(), calibration, room=open_room)
    worn = station_coverage(CAVE, body, still(), calibration, room=shadow)
    assert free.stations == ("chest", "back")
    assert free.emitters.shape == (11, 2)
    assert np.all(worn.emitters <= free.emitters)
    assert worn.emitters.sum() < free.emitters.sum()
    roof = Box(centre_m=(0.0, 0.0, 2.3), size_m=(4.0, 4.0, 0.1))
    assert station_coverage(CAVE, body, still(), calibration, room=Room(furniture=(roof,))).emitters.sum() == 0


def test_the_constellation_stands_above_the_path() -> None:
    body = build_body(synthetic.performer_skeleton("p1"))
    calibration = exact_calibration(body, [Mount("head", "head", 1.0, 0.0)], TrackerConfig())
    motion = still()
    qpos = np.array(motion.qpos)
    qpos[:, :2] += [30.0, -20.0]
    far = BodyMotion("far", "p1", "test", "boxing", 40.0, qpos)
    near_heard, far_heard = (station_coverage(CAVE, body, each, calibration).emitters for each in (motion, far))
    np.testing.assert_array_equal(near_heard, far_heard)
    assert near_heard.min() > 0


def test_a_long_clip_is_sampled() -> None:
    body = build_body(synthetic.performer_skeleton("p1"))
    calibration = exact_calibration(body, [Mount("head", "head", 1.0, 0.0)], TrackerConfig())
    assert len(station_coverage(CAVE, body, still(90.0), calibration).emitters) == MOST_SAMPLES


def test_shares_sum_to_one() -> None:
    heard = np.array([[0, 3], [1, 5], [2, 9], [4, 3]])
    coverage = StationCoverage(("a", "b"), heard, np.array([[np.nan, 2.0], [np.nan, 3.0], [np.nan, 5.0], [np.nan] * 2]))
    assert coverage.shares(0) == (0.25, 0.25, 0.25, 0.25)
    assert coverage.shares(1) == (0.0, 0.0, 0.0, 1.0)
    assert np.isnan(coverage.median_dilution(0))
    assert coverage.median_dilution(1) == 3.0
    assert (coverage.fix_share(0), coverage.fix_share(1)) == (0.0, 0.75)


def walker_coverage(seed: int) -> dict[str, StationCoverage]:
    """Performer -> coverage of his stations under `hall` in the first 10 s of his takes, one after the other."""
    sets = read_station_sets()
    stations = {**sets["liu2011"], "pelvis": sets["kim2012"]["pelvis"]}
    mounts = [Station(**station).nominal_mount(name) for name, station in stations.items()]
    hall, out = load_constellation(ConstellationSettings(name="hall")), {}
    for performer in synthetic.REFERENCE_PERFORMERS:
        parts = []
        for take in range(1, 7):
            body, motion = retarget_to_own_body(synthetic.generate("walking", performer, take, seed=seed))
            first = BodyMotion(motion.name, performer, "test", "walking", motion.rate_hz, motion.qpos[:1201])
            parts.append(station_coverage(hall, body, first, exact_calibration(body, mounts, TrackerConfig())))
        heard, dilution = (np.concatenate([getattr(part, name) for part in parts]) for name in ("emitters", "dilution"))
        out[performer] = StationCoverage(parts[0].stations, heard, dilution)
    return out


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_stations_of_walkers_hear_three_emitters_of_hall(seed: int) -> None:
    coverage = walker_coverage(seed)
    assert set(coverage) == set(synthetic.REFERENCE_PERFORMERS)
    for performer, found in coverage.items():
        for row, station in enumerate(found.stations):
            assert found.shares(row)[3] >= 0.9, (performer, station)
            assert found.fix_share(row) >= 0.9, (performer, station)
