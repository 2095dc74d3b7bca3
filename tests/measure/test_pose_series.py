"""References between their poses."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.measure.pose_series import MeasuredPoses, TruthPoses, TruthSpline, require_pairs

RATE_HZ = 120.0


def truth_at(time_s: Floats) -> TruthPoses:
    """A body on a circle of 0.3 m at 1 Hz that turns back and forth about a skew axis."""
    angle = 2.0 * np.pi * time_s
    place = 0.3 * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=1)
    turn = rotations.exp(3.0 * np.sin(angle)[:, None] * np.array([0.0, 0.6, 0.8]))
    return TruthPoses(time_s, place, np.where(np.arange(len(time_s))[:, None] % 7 == 0, -turn, turn))


def test_between_its_poses_a_reference_is_smooth() -> None:
    spline = TruthSpline(truth_at(np.arange(0.0, 3.0, 1.0 / RATE_HZ)))
    middle_s = np.arange(0.5, 2.5, 0.0137)
    expected = truth_at(middle_s)
    place, turn = spline.poses(middle_s)
    np.testing.assert_allclose(place, expected.position_m, atol=1e-6)
    assert rotations.angle_between_rad(turn, expected.world_from_body).max() < 2e-5
    _, _, velocity, omega = spline.motion(middle_s)
    angle = 2.0 * np.pi * middle_s
    np.testing.assert_allclose(velocity[:, 0], -0.6 * np.pi * np.sin(angle), atol=1e-3)
    axis = np.array([0.0, 0.6, 0.8])
    np.testing.assert_allclose(omega, 6.0 * np.pi * np.cos(angle)[:, None] * axis, atol=2e-2)


def test_gaps_and_ends_are_not_covered() -> None:
    time_s = np.arange(0.0, 3.0, 1.0 / RATE_HZ)
    poses = truth_at(time_s)
    place = poses.position_m.copy()
    place[120:180] = np.nan  # half a second
    spline = TruthSpline(TruthPoses(time_s, place, poses.world_from_body))
    found = spline.covers(np.array([-0.01, 0.0, 0.99, 1.01, 1.45, 1.51, 2.99, 3.01]))
    np.testing.assert_array_equal(found, [False, True, True, False, False, True, True, False])


def test_bad_references_are_refused() -> None:
    with pytest.raises(BadInput, match=r"has 3 pose\(s\)"):
        TruthSpline(truth_at(np.arange(3.0)))
    with pytest.raises(BadInput, match="do not rise"):
        truth_at(np.array([0.0, 1.0, 1.0, 2.0]))


def test_pairs_must_exist() -> None:
    station = MeasuredPoses(np.zeros(1), np.zeros((1, 3)), rotations.IDENTITY[None], np.ones(1, bool))
    truths = {"hand": truth_at(np.arange(4.0))}
    require_pairs({"left": station}, truths, {"left": "hand"})
    for pairs, message in (({"right": "hand"}, "no station 'right'"), ({"left": "foot"}, "no body 'foot'")):
        with pytest.raises(BadInput, match=message):
            require_pairs({"left": station}, truths, pairs)
    with pytest.raises(BadInput, match="No station has a body"):
        require_pairs({"left": station}, truths, {})


def test_records_whose_stamps_repeat_or_fall_are_left_out() -> None:
    stamp_s = np.array([0.0, 1.0, 1.0, np.nan, 0.5, 2.0, 3.0])
    valid = np.array([True, True, True, True, True, False, True])
    poses = MeasuredPoses(stamp_s, np.zeros((7, 3)), np.tile(rotations.IDENTITY, (7, 1)), valid)
    assert poses.rising_rows().tolist() == [0, 1, 6]
