"""Angles without jumps: the same rotations, near the frame before, and no turns too many."""

import time

import numpy as np
import pytest

from harness.body import build_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import BONES, QPOS_OF_DOF, limits_rad, pack, standard_skeleton, unpack
from harness.core.skeleton import (
    are_gimbal,
    equivalent_euler_angles,
    forward_kinematics,
    hinge_angles,
    hinge_rotation,
    unwrap_angles,
)
from harness.reconstruct.solver import HingeLimits
from harness.score import wrap_difference


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


@pytest.mark.parametrize("size", [0.5, 1.5])
def test_no_step_is_longer_than_before(size: float, rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    smooth = _smooth(400, size, rng)
    steps = np.abs(np.diff(unwrap_angles(skeleton, _scrambled(smooth, rng)), axis=0))
    assert steps.max() < np.abs(np.diff(smooth, axis=0)).max() + 1e-9


@pytest.mark.parametrize("seed", range(20))
def test_random_courses_jump_only_at_the_pole_and_leave_it_on_the_near_branch(seed: int) -> None:
    """A course through all rotations, with steps of at most `step`; the twin can be nearer only that near the pole."""
    rng, skeleton = np.random.default_rng(seed), standard_skeleton()
    turns = [rotations.IDENTITY[None]]
    rate = rng.normal(size=(600, 3))
    rate = np.stack([np.convolve(column, np.ones(60) / 60, mode="same") for column in rate.T], axis=-1)
    rate *= 0.1 / np.linalg.norm(rate, axis=1).max()
    for step in rate:
        turns.append(rotations.multiply(rotations.exp(step[None]), turns[-1]))
    shoulder = skeleton.dof_of_bone[skeleton.index("rhumerus")]
    angles = np.zeros((601, len(skeleton.axes)))
    angles[:, shoulder] = hinge_angles(skeleton.axes[shoulder], np.concatenate(turns))
    out = unwrap_angles(skeleton, _scrambled(angles, rng))
    before, after = (hinge_rotation(skeleton.axes[shoulder], a[:, shoulder]) for a in (angles, out))
    assert rotations.angle_between_rad(before, after).max() < 1e-7
    middle = out[:, shoulder.start + 1]
    assert np.all(np.abs(middle) <= np.deg2rad(100.0))
    jumps = np.flatnonzero(np.abs(np.diff(out[:, shoulder], axis=0)).max(axis=1) > np.deg2rad(120.0))
    from_pole = np.abs(np.abs(middle) - 0.5 * np.pi)
    assert np.all(np.minimum(from_pole[jumps], from_pole[jumps + 1]) < 0.1)


def _raised_shoulder(highest_deg: float, frames: int = 241) -> tuple[Floats, slice]:
    """Angles of a right shoulder whose middle hinge turns to `highest_deg` in half the time, and stays there."""
    skeleton = standard_skeleton()
    shoulder = skeleton.dof_of_bone[skeleton.index("rhumerus")]
    smooth = np.zeros((frames, len(skeleton.axes)))
    smooth[:, shoulder] = np.deg2rad([20.0, 0.0, -30.0])
    smooth[:, shoulder.start + 1] = np.deg2rad(highest_deg * np.minimum(np.linspace(0.0, 2.0, frames), 1.0))
    return smooth, shoulder


@pytest.mark.parametrize("highest_deg", [121.0, 151.0, -151.0, 247.0])
def test_a_shoulder_past_the_pole_is_on_the_near_branch(highest_deg: float, rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    smooth, shoulder = _raised_shoulder(highest_deg)
    out = unwrap_angles(skeleton, _scrambled(smooth, rng))
    past = np.cos(smooth[:, shoulder.start + 1]) < 0.0
    assert np.count_nonzero(past) > 120  # more than half: the medians alone would choose the other branch
    np.testing.assert_allclose(out[~past, shoulder], smooth[~past, shoulder], atol=1e-9)
    assert np.all(np.abs(out[:, shoulder.start + 1]) <= 0.5 * np.pi)


@pytest.mark.parametrize(("highest_deg", "continuous"), [(97.0, True), (-99.0, True), (102.0, False)])
def test_a_track_that_passes_the_pole_by_little_stays_continuous(
    highest_deg: float, continuous: bool, rng: np.random.Generator
) -> None:
    skeleton = standard_skeleton()
    rising, _ = _raised_shoulder(highest_deg)
    smooth = np.concatenate([rising, rising[::-1]])
    out = unwrap_angles(skeleton, _scrambled(smooth, rng))
    largest_step_rad = np.abs(np.diff(out, axis=0)).max()
    assert (largest_step_rad < 0.1) == continuous
    if continuous:
        np.testing.assert_allclose(out, smooth, atol=1e-9)


def test_solvers_and_unwrapped_truth_use_one_branch(rng: np.random.Generator) -> None:
    """D1 compares hinge angles, so the same rotations must have the same angles on both sides."""
    skeleton = standard_skeleton()
    smooth, shoulder = _raised_shoulder(151.0)
    truth = unwrap_angles(skeleton, _scrambled(smooth, rng))
    qpos_angles = np.empty_like(truth)
    qpos_angles[:, QPOS_OF_DOF] = smooth
    answer = HingeLimits(build_body(skeleton)).principal(qpos_angles)[:, QPOS_OF_DOF]
    away = np.abs(np.abs(truth[:, shoulder.start + 1]) - 0.5 * np.pi) > np.deg2rad(10.0)
    assert np.count_nonzero(away) > 200
    np.testing.assert_allclose(wrap_difference(answer - truth)[away], 0.0, atol=1e-9)


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


@pytest.mark.parametrize("bone", ["lfemur", "lhand", "lclavicle", "rtibia", "lwrist", "lhipjoint"])
def test_angles_of_any_bone_come_back(bone: str, rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    axes = skeleton.axes[skeleton.dof_of_bone[skeleton.index(bone)]]
    angles = rng.uniform(-1.5, 1.5, size=(200, len(axes)))
    found = hinge_angles(axes, hinge_rotation(axes, angles))
    assert found.shape == angles.shape
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * angles), atol=1e-9)


@pytest.mark.parametrize("bone", ["lfemur", "lhand", "rclavicle", "rtibia", "lwrist"])
def test_no_other_angles_come_nearer(bone: str, rng: np.random.Generator) -> None:
    skeleton = standard_skeleton()
    axes = skeleton.axes[skeleton.dof_of_bone[skeleton.index(bone)]]
    wanted = rotations.exp(rng.normal(size=(40, 3)))
    best = hinge_angles(axes, wanted)
    error = rotations.angle_between_rad(hinge_rotation(axes, best), wanted)
    for _ in range(300):
        other = best + rng.normal(size=best.shape) * rng.choice([0.01, 0.3, 3.0])
        assert np.all(rotations.angle_between_rad(hinge_rotation(axes, other), wanted) > error - 1e-9)


@pytest.mark.parametrize("middle_rad", [np.pi / 2, -np.pi / 2])
def test_gimbal_lock_still_gives_the_rotation(middle_rad: float) -> None:
    axes = np.eye(3)
    locked = hinge_rotation(axes, np.array([[0.4, middle_rad, -0.7]]))
    again = hinge_rotation(axes, hinge_angles(axes, locked))
    assert rotations.angle_between_rad(again, locked).max() < 1e-7


def test_twins_are_one_rotation(rng: np.random.Generator) -> None:
    angles = rng.uniform(-3.0, 3.0, size=(50, 3))
    apart = rotations.angle_between_rad(
        *(hinge_rotation(np.eye(3), a) for a in (angles, equivalent_euler_angles(angles)))
    )
    assert apart.max() < 1e-7


def test_three_square_hinges_are_a_gimbal() -> None:
    skew = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    assert are_gimbal(np.eye(3)[[2, 0, 1]])
    assert not are_gimbal(np.eye(3)[:2])
    assert not are_gimbal(skew)


@pytest.mark.parametrize("shape", [(), (7,), (3, 4)])
def test_unpack_undoes_pack(shape: tuple[int, ...], rng: np.random.Generator) -> None:
    parts = tuple(rng.normal(size=(*shape, size)) for size in (3, 4, 48))
    qpos = pack(*parts)
    assert qpos.shape == (*shape, 55)
    for found, given in zip(unpack(qpos), parts, strict=True):
        np.testing.assert_array_equal(found, given)


def test_hinges_of_a_bone_run_outermost_first() -> None:
    names = np.array(standard_skeleton().dof_names)[QPOS_OF_DOF]
    assert names[:4].tolist() == ["lowerback.rz", "lowerback.ry", "lowerback.rx", "upperback.rz"]
    assert names[-4:].tolist() == ["rfemur.rx", "rtibia.rx", "rfoot.rz", "rfoot.rx"]
    np.testing.assert_array_equal(QPOS_OF_DOF[QPOS_OF_DOF], np.arange(48))


def test_the_skeleton_is_that_of_the_paper() -> None:
    skeleton = standard_skeleton()
    assert (len(BONES), len(skeleton.axes)) == (24, 48)
    np.testing.assert_allclose(np.linalg.norm(skeleton.axes, axis=1), 1.0, atol=1e-12)
    low, high = limits_rad().T
    assert np.all(low < 0.0)
    assert np.all(high > 0.0)
    mirrored = skeleton.bone_m[[skeleton.index(n) for n in BONES if n.startswith("l") and "r" + n[1:] in BONES]]
    right = skeleton.bone_m[[skeleton.index(n) for n in BONES if n.startswith("r")]]
    np.testing.assert_allclose(mirrored * [1, -1, 1], right, atol=1e-12)
