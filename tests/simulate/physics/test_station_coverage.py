"""Coverage by station of performers under the shipped constellations."""

import numpy as np
import pytest

from harness.body.humanoid import build_body
from harness.body.mounts import Mount
from harness.body.retargeting import retarget_to_own_body
from harness.core.motion import BodyMotion
from harness.experiment.clip_evaluation import mount_of
from harness.experiment.scenario import Station, read_station_sets
from harness.mocap import synthetic
from harness.simulate.link import TrackerConfig
from harness.simulate.physics.constellation import ConstellationSettings, load_constellation
from harness.simulate.physics.coverage import MOST_SAMPLES, StationCoverage, heard_emitters, station_coverage
from harness.simulate.physics.room import Box, Room
from harness.simulate.physics.sound import Sound
from harness.simulate.simulation import exact_calibration

CAVE = load_constellation(ConstellationSettings(name="cave"))
FACING_UP = np.array([[0.0, 1.0, 0.0, 0.0]])
"""Half a turn about x: the station's z points against the tracker's, up to the ceiling."""


def test_a_station_hears_what_it_faces() -> None:
    at_m = np.array([[0.0, 0.0, 1.5]])
    assert heard_emitters(CAVE, at_m, FACING_UP, Sound(), None).all()
    facing_down = np.array([[1.0, 0.0, 0.0, 0.0]])
    assert not heard_emitters(CAVE, at_m, facing_down, Sound(), None).any()
    forward = np.array([[np.cos(np.pi / 4), 0.0, np.sin(np.pi / 4), 0.0]])
    heard = heard_emitters(CAVE, np.array([[0.0, 0.0, 0.6]]), forward, Sound(), None)[0]
    assert heard[3:].sum() > heard[:6].sum(), "emitters in front are louder than those behind"


def still(seconds: float = 1.0) -> BodyMotion:
    _, motion = retarget_to_own_body(synthetic.generate("boxing", "p1", 1, seed=1, duration_s=seconds, rate_hz=40.0))
    return BodyMotion("still", "p1", "test", "boxing", 40.0, np.tile(motion.qpos[:1], (len(motion), 1)))


def test_the_body_and_furniture_shadow_a_station() -> None:
    body = build_body(synthetic.performer_skeleton("p1"))
    mounts = [Mount("chest", "thorax", 0.5, 0.0), Mount("back", "thorax", 0.5, np.pi)]
    calibration = exact_calibration(body, mounts, TrackerConfig())
    open_room, shadow = Room(shadow=False), Room()
    free = station_coverage(CAVE, body, still(), calibration, room=open_room)
    worn = station_coverage(CAVE, body, still(), calibration, room=shadow)
    assert free.stations == ("chest", "back")
    assert free.heard.shape == (11, 2)
    assert np.all(worn.heard <= free.heard)
    assert worn.heard.sum() < free.heard.sum()
    roof = Box(centre_m=(0.0, 0.0, 2.3), size_m=(4.0, 4.0, 0.1))
    assert station_coverage(CAVE, body, still(), calibration, room=Room(furniture=(roof,))).heard.sum() == 0


def test_the_constellation_stands_above_the_path() -> None:
    body = build_body(synthetic.performer_skeleton("p1"))
    calibration = exact_calibration(body, [Mount("head", "head", 1.0, 0.0)], TrackerConfig())
    motion = still()
    qpos = np.array(motion.qpos)
    qpos[:, :2] += [30.0, -20.0]
    far = BodyMotion("far", "p1", "test", "boxing", 40.0, qpos)
    near_heard, far_heard = (station_coverage(CAVE, body, each, calibration).heard for each in (motion, far))
    np.testing.assert_array_equal(near_heard, far_heard)
    assert near_heard.min() > 0


def test_a_long_clip_is_sampled() -> None:
    body = build_body(synthetic.performer_skeleton("p1"))
    calibration = exact_calibration(body, [Mount("head", "head", 1.0, 0.0)], TrackerConfig())
    assert len(station_coverage(CAVE, body, still(90.0), calibration).heard) == MOST_SAMPLES


def test_shares_sum_to_one() -> None:
    heard = np.array([[0, 3], [1, 5], [2, 9], [4, 3]])
    coverage = StationCoverage(("a", "b"), heard, np.array([[np.nan, 2.0], [np.nan, 3.0], [np.nan, 5.0], [np.nan] * 2]))
    assert coverage.shares(0) == (0.25, 0.25, 0.25, 0.25)
    assert coverage.shares(1) == (0.0, 0.0, 0.0, 1.0)
    assert np.isnan(coverage.median_dilution(0))
    assert coverage.median_dilution(1) == 3.0
    assert (coverage.fixed_share(0), coverage.fixed_share(1)) == (0.0, 0.75)


def walker_coverage(seed: int) -> dict[str, StationCoverage]:
    """Performer -> coverage of his stations under `hall` in the first 10 s of his takes, one after the other."""
    sets = read_station_sets()
    stations = {**sets["liu2011"], "pelvis": sets["kim2012"]["pelvis"]}
    mounts = [mount_of(name, Station(**station)) for name, station in stations.items()]
    hall, out = load_constellation(ConstellationSettings(name="hall")), {}
    for performer in synthetic.REFERENCE_PERFORMERS:
        parts = []
        for take in range(1, 7):
            body, motion = retarget_to_own_body(synthetic.generate("walking", performer, take, seed=seed))
            first = BodyMotion(motion.name, performer, "test", "walking", motion.rate_hz, motion.qpos[:1201])
            parts.append(station_coverage(hall, body, first, exact_calibration(body, mounts, TrackerConfig())))
        heard, dilution = (np.concatenate([getattr(part, name) for part in parts]) for name in ("heard", "dilution"))
        out[performer] = StationCoverage(parts[0].stations, heard, dilution)
    return out


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_stations_of_walkers_hear_three_emitters_of_hall(seed: int) -> None:
    coverage = walker_coverage(seed)
    assert set(coverage) == set(synthetic.REFERENCE_PERFORMERS)
    for performer, found in coverage.items():
        for row, station in enumerate(found.stations):
            assert found.shares(row)[3] >= 0.9, (performer, station)
            assert found.fixed_share(row) >= 0.9, (performer, station)
