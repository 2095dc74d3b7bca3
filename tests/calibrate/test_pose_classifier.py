"""Distances of a hold from the poses, against geometry by hand, and the limits of a match."""

from functools import cache

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS, Body, Kinematics, build_body, locate_mounts
from harness.calibrate.hold import HoldReadings
from harness.calibrate.pose_classifier import PoseClassifier
from harness.calibrate.poses import POSES, pose_configuration
from harness.calibrate.tpose_calibration import LEVEL_FROM_TRACKER
from harness.core import rotations
from harness.core.arrays import Floats

MOUNTS = [DEFAULT_MOUNTS[name] for name in ("left_wrist", "right_wrist", "left_ankle", "head")]


@cache
def body() -> Body:
    return build_body()


def poses() -> list[Floats]:
    return [pose_configuration(pose, body().skeleton) for pose in POSES]


@cache
def classifier() -> PoseClassifier:
    return PoseClassifier(body(), MOUNTS, poses())


def stations(pose: int) -> tuple[Floats, Floats]:
    """Positions (S, 3) and orientations (S, 4) in a pose held exactly, z up."""
    kinematics = Kinematics(body())
    kinematics.set(poses()[pose])
    return kinematics.station_poses(*locate_mounts(body().skeleton, MOUNTS))


def hold(pose: int, size: float = 1.0, turn: Floats = rotations.IDENTITY, facing_rad: float = 0.7) -> HoldReadings:
    """Readings of a performer of another size who faces elsewhere; `turn` (S, 4) turns stations further."""
    place_m, turned = stations(pose)
    room = rotations.multiply(rotations.inverse(LEVEL_FROM_TRACKER), rotations.about_z(facing_rad))
    place_m = rotations.rotate(room, size * place_m + [3.0, -1.0, 0.2])
    turned = rotations.multiply(room, rotations.multiply(turn, turned))
    return HoldReadings(3.0, place_m, turned, np.zeros(len(MOUNTS)), np.zeros(len(MOUNTS)))


def spread_m(pose: int) -> float:
    """RMS distance of the stations from their mean."""
    place_m, _ = stations(pose)
    return float(np.sqrt(np.mean(np.sum((place_m - place_m.mean(axis=0)) ** 2, axis=1))))


@pytest.mark.parametrize("size", [0.86, 1.0, 1.14])
@pytest.mark.parametrize("pose", [0, 3, 7])
def test_a_pose_is_itself_anywhere_and_at_any_size_of_people(pose: int, size: float) -> None:
    now, first = hold(pose, size), hold(0, size)
    assert classifier().distances_m(now)[pose] < 1e-6
    assert classifier().distances_m(now, first)[pose] < 1e-6
    assert classifier().nearest(now, first) == pose
    assert classifier().matches(pose, now, first)
    assert not classifier().matches((pose + 1) % 8, now, first)


@pytest.mark.parametrize(("size", "nearest_size"), [(0.75, 0.85), (1.35, 1.15)])
def test_other_sizes_are_as_far_as_they_exceed_the_range(size: float, nearest_size: float) -> None:
    far_m = classifier().distances_m(hold(2, size))[2]
    assert far_m == pytest.approx(abs(size - nearest_size) * spread_m(2))
    at_m, away_m = classifier().aligned_m(2, hold(2, size).position_m)
    assert np.sqrt(np.mean(away_m**2)) == pytest.approx(far_m)
    place_m, _ = stations(2)
    middle_m = place_m.mean(axis=0)
    facing = at_m - middle_m
    np.testing.assert_allclose(np.linalg.norm(facing, axis=1), size / nearest_size * _radius_m(place_m))
    np.testing.assert_allclose(facing[:, 2], size / nearest_size * (place_m - middle_m)[:, 2], atol=1e-9)


def _radius_m(place_m: Floats) -> Floats:
    return np.asarray(np.linalg.norm(place_m - place_m.mean(axis=0), axis=1))


@pytest.mark.parametrize("since", ["both", "now"])
def test_a_rotation_since_the_first_pose_counts_with_its_lever(since: str) -> None:
    """One of four stations turned by 0.8 rad: 0.3 m x 0.8 rad / sqrt(4). Turned before, it is how it is worn."""
    turn = np.tile(rotations.IDENTITY, (4, 1))
    turn[1] = rotations.exp(np.array([0.0, 0.8, 0.0]))
    now = hold(4, turn=turn, facing_rad=-2.0)
    far_m = classifier().distances_m(now, hold(0))[4]
    assert far_m == pytest.approx(0.3 * 0.8 / 2.0, abs=1e-6)
    worn = HoldReadings(3.0, hold(0).position_m, _worn(hold(0)), np.zeros(4), np.zeros(4))
    both = HoldReadings(3.0, now.position_m, _worn(hold(4, facing_rad=-2.0)), np.zeros(4), np.zeros(4))
    assert classifier().distances_m(both, worn)[4] < 1e-6


def _worn(readings: HoldReadings) -> Floats:
    """Orientations of stations that are strapped on another way."""
    return rotations.multiply(readings.tracker_from_station, rotations.exp(np.array([0.0, 0.8, 0.0])))


@pytest.mark.parametrize(
    ("later", "far_m", "nearest", "matching"),
    [
        (False, [0.260, 0.279, 0.281], 0, [0]),
        (False, [0.261, 0.265, 0.280], None, []),
        (False, [0.119, 0.100, 0.121], 1, [0, 1]),
        (True, [0.410, 0.400, 0.500], 1, [1]),
        (True, [0.401, 0.402, 0.500], None, []),
        (True, [0.305, 0.300, 0.315], 1, [0, 1, 2]),
    ],
)
def test_limits(
    later: bool, far_m: list[float], nearest: int | None, matching: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """0.26 m for the first pose, 0.40 m for the others, and 2 cm more than the nearest."""
    found, now = classifier(), hold(0)
    monkeypatch.setattr(PoseClassifier, "distances_m", lambda *_: np.array(far_m))
    first = now if later else None
    assert found.nearest(now, first) == nearest
    assert [pose for pose in range(3) if found.matches(pose, now, first)] == matching
