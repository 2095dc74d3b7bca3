"""Matching of bone directions, and contact of the feet with the floor."""

import numpy as np
import pytest

from harness.body import anatomy, bone_directions, ground, humanoid
from harness.core import humanoid24, skeleton
from harness.core.arrays import Floats
from harness.core.skeleton import Pose, Skeleton
from tests.body.conftest import random_qpos

STANDARD = humanoid24.standard_skeleton()
FREE = [len(channels) == 3 for channels in STANDARD.hinges]
RIGID = [len(channels) == 0 for channels in STANDARD.hinges]


def directions(own: Skeleton, qpos: Floats, angles_rad: Floats) -> Floats:
    pose = skeleton.forward_kinematics(own, qpos[:, :3], qpos[:, 3:7], angles_rad)
    span = pose.end_m - pose.start_m
    out: Floats = span / np.linalg.norm(span, axis=2, keepdims=True)
    return out


def test_equal_bodies_keep_their_angles(lanky: Skeleton, rng: np.random.Generator) -> None:
    qpos = random_qpos(rng, 30)
    _, _, angles_rad = humanoid24.unpack(qpos)
    np.testing.assert_allclose(bone_directions.match_bone_directions(lanky, qpos, lanky), angles_rad, atol=1e-6)
    longer = lanky.with_bones(1.2 * lanky.bone_m)
    np.testing.assert_allclose(bone_directions.match_bone_directions(lanky, qpos, longer), angles_rad, atol=1e-6)


def test_three_hinges_point_exactly_and_fewer_come_nearer(lanky: Skeleton, rng: np.random.Generator) -> None:
    qpos = random_qpos(rng, 200)
    _, _, kept_rad = humanoid24.unpack(qpos)
    meant = directions(lanky, qpos, kept_rad)
    before, after = (
        np.linalg.norm(directions(STANDARD, qpos, angles) - meant, axis=2).mean(axis=0)
        for angles in (kept_rad, bone_directions.match_bone_directions(lanky, qpos, STANDARD))
    )
    assert np.max(after[FREE]) < 1e-7
    np.testing.assert_allclose(after[RIGID], before[RIGID])
    assert np.mean(after) < 0.5 * np.mean(before)


def test_a_correction_never_leaves_the_limits(rng: np.random.Generator) -> None:
    bone_m = np.array(STANDARD.bone_m)
    bone_m[STANDARD.index("lclavicle")] = [0.15, 0.12, 0.0]  # 55 deg off: more than the clavicle's hinges allow
    qpos = random_qpos(rng, 50)
    fitted = bone_directions.match_bone_directions(STANDARD.with_bones(bone_m), qpos, STANDARD)
    where = STANDARD.dof_of_bone[STANDARD.index("lclavicle")]
    low, high = humanoid24.limits_rad()[where].T
    assert np.all((fitted[:, where] >= low) & (fitted[:, where] <= high))
    assert np.mean(np.any((fitted[:, where] == low) | (fitted[:, where] == high), axis=1)) > 0.9


def test_angles_stay_near_the_own_ones_across_turns_and_twins(lanky: Skeleton, rng: np.random.Generator) -> None:
    smooth = np.cumsum(rng.normal(scale=0.05, size=(400, 48)), axis=0) + 5.0
    qpos = humanoid24.pack(np.zeros((400, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (400, 1)), smooth)
    small = STANDARD.with_bones(0.98 * STANDARD.bone_m + 0.02 * lanky.bone_m)
    assert (
        np.max(
            np.abs(
                bone_directions.match_bone_directions(small, qpos, STANDARD)[:, _one_hinge()] - smooth[:, _one_hinge()]
            )
        )
        < 0.1
    )
    fitted = bone_directions.match_bone_directions(small, qpos, STANDARD)
    assert np.max(np.abs(fitted - smooth)) < np.pi + 0.1


def _one_hinge() -> list[int]:
    return [STANDARD.dof_of_bone[b].start for b, channels in enumerate(STANDARD.hinges) if len(channels) == 1]


def hopping(height_m: float, rate_hz: float = 100.0) -> tuple[Pose, Floats]:
    """One second standing, 0.6 s on a ballistic arc, one second standing, all raised by `height_m`."""
    time_s = np.arange(0.0, 2.6, 1.0 / rate_hz)
    flight_s = np.clip(time_s - 1.0, 0.0, 0.6)
    qpos = np.tile(humanoid.tpose(STANDARD), (len(time_s), 1))
    qpos[:, 2] += height_m + 0.5 * 9.81 * flight_s * (0.6 - flight_s)
    return skeleton.forward_kinematics(STANDARD, *humanoid24.unpack(qpos)), flight_s


@pytest.mark.parametrize("height_m", [0.0, -0.03, 0.05])
def test_stance_and_floor_of_a_jump(height_m: float) -> None:
    pose, flight_s = hopping(height_m)
    soles_m, standing = ground.sole_heights_m(STANDARD, pose), ground.detect_stance(STANDARD, pose, 100.0)
    airborne = (flight_s > 0.08) & (flight_s < 0.52)
    assert not standing[airborne].any()  # not at the top either
    assert standing[(flight_s == 0.0) | (flight_s == 0.6)].mean() > 0.95
    assert ground.floor_m(soles_m, standing) == pytest.approx(height_m, abs=2e-3)
    assert np.min(soles_m) == pytest.approx(height_m, abs=1e-5)


def test_a_high_place_is_not_taken_for_the_floor() -> None:
    pose, _ = hopping(0.24)
    soles_m, standing = ground.sole_heights_m(STANDARD, pose), ground.detect_stance(STANDARD, pose, 100.0)
    assert ground.floor_m(soles_m, standing) == 0.0


def test_one_frame_has_no_stance() -> None:
    pose = skeleton.forward_kinematics(STANDARD, *humanoid24.unpack(humanoid.tpose(STANDARD)[None]))
    assert not ground.detect_stance(STANDARD, pose, 100.0).any()


def test_the_settled_error_follows_slow_change_and_ignores_flight() -> None:
    time_s = np.arange(0.0, 8.0, 0.01)
    drift_m = 0.02 * np.sin(2 * np.pi * time_s / 20.0)
    standing = np.stack([time_s % 1.0 < 0.4, time_s % 1.0 > 0.6], axis=1)
    error_m = np.where(standing, drift_m[:, None], 9.0)
    settled_m = ground.smooth_sole_error(error_m, standing, 100.0)
    assert np.max(np.abs(settled_m - drift_m)) < 0.004
    assert np.max(np.abs(np.diff(settled_m))) * 100.0 < 0.02  # m/s
    np.testing.assert_array_equal(ground.smooth_sole_error(error_m, np.zeros_like(standing), 100.0), 0.0)


def test_sole_points_lie_on_the_soles_of_the_flesh(lanky: Skeleton) -> None:
    for own in (STANDARD, lanky):
        shapes = {s.name: s for s in anatomy.body_geoms(own)}
        for side, points_m in zip("lr", anatomy.sole_points_m(own), strict=True):
            down = own.bone_m[own.index(f"{side}tibia")] / own.length_m[own.index(f"{side}tibia")]
            soles = [shapes[f"{side}foot_{edge}"] for edge in ("inner", "outer")]
            deepest = max(float(s.centre_m @ down + s.size_m[0]) for s in soles)
            np.testing.assert_allclose(points_m @ down, deepest, atol=1e-9)
            assert deepest == pytest.approx(anatomy.sole_below_ankle_m(own), abs=1e-9)
