"""Angles without jumps: the same rotations, near the frame before, and no turns too many."""

import time

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.core.skeleton import forward_kinematics, unwrap_angles


def _smooth(frames: int, size: float, rng: np.random.Generator) -> Floats:
    t = np.linspace(0.0, 4.0, frames)[:, None]
    skeleton = standard_skeleton()
    return size * np.sin(t + rng.uniform(0.0, 6.0, size=len(skeleton.axes)))


def _scrambled(angles: Floats, rng: np.random.Generator) -> Floats:
    """The same rotations as a file might write them: any twin, any whole turns."""
    skeleton = standard_skeleton()
    out = np.array(angles)
    for where in skeleton.dof_of_bone:
        if where.stop - where.start == 3:
            twins = rng.random(len(out)) < 0.5
            out[twins, where] = out[twins, where] * [1.0, -1.0, 1.0] + np.pi
    return out + 2.0 * np.pi * rng.integers(-2, 3, size=out.shape)


def test_unwrapping_finds_smooth_angles_again(rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    smooth = _smooth(300, 0.7, rng)
    np.testing.assert_allclose(unwrap_angles(skeleton, _scrambled(smooth, rng)), smooth, atol=1e-9)


@pytest.mark.parametrize("size", [0.5, 1.5, 3.0])
def test_unwrapping_changes_no_rotation(size: float, rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    angles = _scrambled(_smooth(50, size, rng), rng)
    root, turn = np.zeros((50, 3)), np.tile(rotations.IDENTITY, (50, 1))
    before, after = (forward_kinematics(skeleton, root, turn, a) for a in (angles, unwrap_angles(skeleton, angles)))
    np.testing.assert_allclose(after.world_from_bone, before.world_from_bone, atol=1e-9)


@pytest.mark.parametrize("size", [0.5, 1.5, 3.0])
def test_no_step_is_longer_than_before(size: float, rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    smooth = _smooth(400, size, rng)
    steps = np.abs(np.diff(unwrap_angles(skeleton, _scrambled(smooth, rng)), axis=0))
    assert steps.max() < np.abs(np.diff(smooth, axis=0)).max() + 1e-9


def test_the_median_of_each_column_is_within_a_half_turn(rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    drifting = _smooth(300, 0.3, rng) + np.linspace(0.0, 40.0, 300)[:, None]
    median = np.median(unwrap_angles(skeleton, drifting), axis=0)
    assert np.all(median > -np.pi)
    assert np.all(median <= np.pi)


def test_a_bad_first_frame_does_not_choose_for_the_clip(rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    smooth = _smooth(200, 0.3, rng)
    spoilt = np.array(smooth)
    spoilt[0] = rng.uniform(-np.pi, np.pi, size=spoilt.shape[1])
    np.testing.assert_allclose(unwrap_angles(skeleton, spoilt)[50:], smooth[50:], atol=1e-9)


def test_a_single_frame_takes_what_is_nearest_to_zero() -> None:
    skeleton = standard_skeleton()
    zero = np.zeros((1, len(skeleton.axes)))
    far = np.array(zero)
    femur = skeleton.dof_of_bone[skeleton.index("lfemur")]
    far[0, femur] = np.pi
    np.testing.assert_allclose(unwrap_angles(skeleton, far), zero, atol=1e-12)


def test_a_long_clip_takes_no_time(rng: np.random.Generator) -> None:
    angles = _scrambled(_smooth(20_000, 1.0, rng), rng)
    start_s = time.process_time()
    unwrap_angles(standard_skeleton(), angles)
    assert time.process_time() - start_s < 2.0  # a loop over frames takes 8 s
