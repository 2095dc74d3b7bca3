"""Free motion: consistent derivatives, rest at both ends, and random motions of a size and a speed."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.simulate.physics.free_motion import FACING_UP, FreeMotionSource, random_motion
from tests.simulate.physics.test_station_displacement import central_differences, ticks_s


def tumbling(rate_hz: float = 50.0) -> tuple[Floats, FreeMotionSource]:
    """Two stations that move on ellipses while they tumble."""
    time_s = np.arange(round(4.0 * rate_hz) + 1) / rate_hz
    angle = time_s[:, None] * np.array([2.0, 3.0])
    position_m = np.stack([np.cos(angle), 0.5 * np.sin(angle), 0.1 * angle], axis=-1)
    turn = rotations.exp(angle[..., None] * np.array([0.6, 0.0, 0.8]))
    return time_s, FreeMotionSource(("a", "b"), time_s, position_m, turn, warm_up_s=1.0)


def test_it_goes_through_its_samples() -> None:
    time_s, source = tumbling()
    motion = source.sample_motion(time_s)
    angle = time_s[:, None] * np.array([2.0, 3.0])
    np.testing.assert_allclose(motion.position_m[..., 0], np.cos(angle), atol=1e-12)
    true = rotations.exp(angle[..., None] * np.array([0.6, 0.0, 0.8]))
    assert rotations.angle_between_rad(motion.tracker_from_station, true).max() < 1e-7
    inner = motion.turn_rad_s[20:-20] - np.array([[2.0], [3.0]]) * np.array([0.6, 0.0, 0.8])
    assert np.abs(inner).max() < 1e-4
    assert source.qpos(time_s) is None


def test_velocities_are_derivatives() -> None:
    _, source = tumbling()
    motion = source.sample_motion(1e-4 * np.arange(-5000.0, 45001.0))
    slope, spin = central_differences(motion)
    assert np.abs(slope - motion.velocity_m_s[1:-1]).max() < 2e-3  # where acceleration jumps, at the ends
    assert np.median(np.abs(slope - motion.velocity_m_s[1:-1])) < 1e-7
    assert np.abs(spin - motion.turn_rad_s[1:-1]).max() < 5e-3
    assert np.median(np.abs(spin - motion.turn_rad_s[1:-1])) < 1e-7


def test_it_rests_before_and_after() -> None:
    _, source = tumbling()
    assert source.begins_s == -1.0
    assert source.ends_s > 4.3
    before = source.sample_motion(ticks_s(-1.0, -0.41))
    assert not before.velocity_m_s.any()
    assert not before.turn_rad_s.any()
    after = source.sample_motion(ticks_s(4.31, 5.0))
    assert not after.velocity_m_s.any()


@pytest.mark.parametrize("speed_m_s", [0.0, 0.1, 0.5, 2.0])
def test_a_random_motion_has_its_size_and_speed(speed_m_s: float) -> None:
    source = random_motion(
        1, "wand", seconds=30.0, size_m=1.0, speed_m_s=speed_m_s, warm_up_s=1.0, centre_m=(0.0, 0.5, 1.0)
    )
    motion = source.sample_motion(ticks_s(0.0, 30.0))
    assert np.linalg.norm(motion.velocity_m_s[:, 0], axis=1).mean() == pytest.approx(speed_m_s, rel=0.01)
    assert np.abs(motion.position_m[:, 0] - [0.0, 0.5, 1.0]).max() < 0.5
    tilt = rotations.angle_between_rad(motion.tracker_from_station[:, 0], FACING_UP)
    assert tilt.max() < 2.0
    assert motion.turn_rad_s.any() == (speed_m_s > 0.0)


def test_another_speed_follows_the_same_path() -> None:
    slow, fast = (
        random_motion(1, "wand", seconds=30.0, size_m=1.0, speed_m_s=speed, warm_up_s=1.0).sample_motion(
            ticks_s(0.0, 30.0)
        )
        for speed in (0.2, 2.0)
    )
    apart_m = np.linalg.norm(slow.position_m[::100] - fast.position_m[:, 0], axis=-1)
    assert apart_m.min(axis=1).max() < 4e-3  # ticks of the fast one are 5 mm apart
    other = random_motion(2, "wand", seconds=30.0, size_m=1.0, speed_m_s=0.2, warm_up_s=1.0)
    assert np.abs(other.sample_motion(ticks_s(0.0, 1.0)).position_m[0] - slow.position_m[0]).max() > 0.01


def test_what_is_no_motion_is_refused() -> None:
    with pytest.raises(BadInput, match="no motion"):
        random_motion(1, "wand", seconds=1.0, size_m=0.0, speed_m_s=1.0, warm_up_s=1.0)
    with pytest.raises(BadInput, match="no motion"):
        FreeMotionSource(("a",), np.zeros(1), np.zeros((1, 1, 3)), np.ones((1, 1, 4)), warm_up_s=1.0)
    with pytest.raises(BadInput, match="outside the motion"):
        tumbling()[1].sample_motion(ticks_s(-2.0, 0.0))
