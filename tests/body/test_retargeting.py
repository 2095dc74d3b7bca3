"""Retargeting of clips to the performer's own body and to a common one."""

from collections.abc import Iterator
from dataclasses import fields, replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from harness.body import anatomy, ground, humanoid, kinematics, retargeting
from harness.body.retargeting import RetargetReport
from harness.core import humanoid24, rotations, skeleton
from harness.core.arrays import Floats
from harness.core.motion import Clip
from harness.core.skeleton import Pose, Skeleton
from harness.errors import BadInput, UnknownName
from harness.mocap import MotionLibrary, read_clip
from tests.body.conftest import clip_on, random_qpos

STANDARD = humanoid24.standard_skeleton()


def amcs(mocap: Path) -> list[Path]:
    return [entry.path for entry in MotionLibrary(mocap).entries() if entry.format == "amc"]


def as_recorded(path: Path) -> Clip:
    return read_clip(path, 120.0)


def unwrapped(clip: Clip) -> Clip:
    return replace(clip, angles_rad=skeleton.unwrap_angles(clip.skeleton, clip.angles_rad))


def own_body_errors(clip: Clip, frames: range) -> tuple[float, float]:
    """Largest distance [m] and angle [rad] between MuJoCo's bodies and direct ASF kinematics of the 30 bones."""
    body, take = retargeting.retarget_to_own_body(unwrapped(clip))
    direct = skeleton.forward_kinematics(
        clip.skeleton, clip.root_m[frames], clip.world_from_root[frames], clip.angles_rad[frames]
    )
    kept = [clip.skeleton.index(name) for name in humanoid24.BONES]
    turns = rotations.from_matrix(direct.world_from_bone[:, kept])
    kin, metres, radians = kinematics.Kinematics(body), 0.0, 0.0
    for row, frame in enumerate(frames):
        kin.set(take.qpos[frame])
        joint_m, turn = kin.bone_poses()
        end_m = joint_m + rotations.rotate(turn, body.skeleton.bone_m)
        metres = max(metres, *np.linalg.norm(joint_m - direct.start_m[row, kept], axis=1))
        metres = max(metres, *np.linalg.norm(end_m - direct.end_m[row, kept], axis=1))
        radians = max(radians, *rotations.angle_between_rad(turn, turns[row]))
    return metres, radians


@pytest.mark.long
def test_staged_clips_are_exact_on_their_own_bodies(mocap: Path) -> None:
    """Every third clip; `make test-slow` checks every frame of all clips."""
    for path in amcs(mocap)[::3]:
        clip = as_recorded(path)
        metres, radians = own_body_errors(clip, range(0, len(clip), max(1, len(clip) // 8)))
        assert metres < 1e-3, path.stem
        assert radians < np.deg2rad(0.1), path.stem


@pytest.mark.slow
def test_every_frame_of_every_staged_clip_is_exact_on_its_own_body(
    mocap: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    errors = {}
    for path in amcs(mocap):
        clip = as_recorded(path)
        errors[path.stem] = own_body_errors(clip, range(len(clip)))
    metres, radians = np.max(list(errors.values()), axis=0)
    with capsys.disabled():
        print(
            f"\n{len(errors)} clips on their own bodies: at most {1e3 * metres:.2e} mm, {np.rad2deg(radians):.2e} deg"
        )
    assert metres < 1e-3
    assert radians < np.deg2rad(0.1)


def test_own_body_keeps_the_clip_to_the_bit(lanky: Skeleton, rng: np.random.Generator) -> None:
    qpos = random_qpos(rng, 5)
    body, take = retargeting.retarget_to_own_body(clip_on(lanky, qpos))
    np.testing.assert_array_equal(take.qpos, qpos)
    np.testing.assert_array_equal(body.skeleton.bone_m, lanky.bone_m)
    assert (take.name, take.rate_hz) == ("made_up", 60.0)


def test_clips_without_the_humanoids_bones_or_hinges_are_refused(rng: np.random.Generator) -> None:
    clip = clip_on(STANDARD, random_qpos(rng, 3))
    small, dofs = STANDARD.subset(STANDARD.names[:-1])
    with pytest.raises(UnknownName, match="rfoot"):
        retargeting.retarget_to_own_body(replace(clip, skeleton=small, angles_rad=clip.angles_rad[:, dofs]))
    stiff = Skeleton(STANDARD.names, STANDARD.parents, STANDARD.bone_m, (*STANDARD.hinges[:-1], ()), STANDARD.axes[:-2])
    with pytest.raises(BadInput, match="46 hinges"):
        retargeting.retarget_to_own_body(replace(clip, skeleton=stiff, angles_rad=clip.angles_rad[:, :-2]))


def walking_in_place(own: Skeleton, rate_hz: float = 60.0) -> Clip:
    """Four seconds of alternate knee bends; the hips follow the foot in stance."""
    time_s = np.arange(0.0, 4.0, 1.0 / rate_hz)
    qpos = np.tile(humanoid.tpose(own), (len(time_s), 1))
    root_m, turns, angles = humanoid24.unpack(qpos)
    angles = np.array(angles)
    for side, sign in (("l", 1.0), ("r", -1.0)):
        lift = np.maximum(0.0, sign * np.sin(np.pi * time_s))
        angles[:, own.dof_names.index(f"{side}femur.rx")] = -0.6 * lift
        angles[:, own.dof_names.index(f"{side}tibia.rx")] = 1.0 * lift
    pose = skeleton.forward_kinematics(own, root_m, turns, angles)
    root_m = root_m - np.min(ground.sole_heights_m(own, pose), axis=1)[:, None] * np.array([0.0, 0.0, 1.0])
    return clip_on(own, humanoid24.pack(root_m, turns, angles), rate_hz)


def test_a_body_of_the_same_shape_loses_nothing() -> None:
    clip = walking_in_place(STANDARD.with_bones(1.1 * STANDARD.bone_m))
    take, report = retargeting.retarget_to_common_body(clip, STANDARD)
    assert report.leg_scale == pytest.approx(1 / 1.1)
    assert max(report.deviation_mm, report.proportions_mm, report.float_mm, report.sink_mm) < 1e-3
    np.testing.assert_allclose(humanoid24.unpack(take.qpos)[2], clip.angles_rad, atol=1e-9)
    np.testing.assert_allclose(take.qpos[:, :3], clip.root_m / 1.1, atol=1e-6)


def test_a_raised_clip_comes_down_to_the_floor() -> None:
    clip = walking_in_place(STANDARD)
    raised = replace(clip, root_m=clip.root_m + np.array([0.0, 0.0, 0.04]))
    take, report = retargeting.retarget_to_common_body(raised, STANDARD)
    assert report.floor_m == pytest.approx(0.04, abs=1e-3)
    assert report.float_plain_mm == pytest.approx(40.0, abs=1.0)
    assert max(report.float_mm, report.sink_mm) < 0.1
    np.testing.assert_allclose(take.qpos, retargeting.retarget_to_common_body(clip, STANDARD)[0].qpos, atol=1e-4)


def test_other_proportions_are_met_as_far_as_they_allow() -> None:
    bone_m = np.array(STANDARD.bone_m)
    for bone, stretch in {"hipjoint": 1.2, "femur": 1.1, "tibia": 0.92, "foot": 1.1, "clavicle": 0.9}.items():
        for side in "lr":
            bone_m[STANDARD.index(side + bone)] *= stretch
    bone_m[STANDARD.index("lclavicle")] += [0.03, 0.0, 0.02]
    take, report = retargeting.retarget_to_common_body(walking_in_place(STANDARD.with_bones(bone_m)), STANDARD)
    assert report.stance_share > 0.9
    assert report.float_plain_mm > 10.0
    assert report.deviation_mm < report.deviation_plain_mm
    assert max(report.float_mm, report.sink_mm) < 5.0
    pose = kinematics.pose_from_qpos(STANDARD, take.qpos)
    lowest_mm = 1e3 * np.min(ground.sole_heights_m(STANDARD, pose), axis=1)
    assert np.max(np.abs(lowest_mm)) < 8.0


def test_a_common_body_may_keep_every_angle() -> None:
    own = STANDARD.with_bones(1.1 * STANDARD.bone_m)
    clip = walking_in_place(own)
    raised = replace(clip, root_m=clip.root_m + np.array([0.0, 0.0, 0.04]))
    take, report = retargeting.retarget_with_same_angles(raised, STANDARD)
    np.testing.assert_array_equal(humanoid24.unpack(take.qpos)[2], clip.angles_rad)
    np.testing.assert_array_equal(take.qpos[:, 3:7], clip.world_from_root)
    np.testing.assert_allclose(take.qpos[:, :3], clip.root_m / 1.1, atol=1e-3)
    assert report.deviation_mm < 1.0
    assert max(report.float_mm, report.sink_mm) < 1.0


def test_the_root_s_path_grows_with_the_legs_and_soles_stand_on_the_floor(lanky: Skeleton) -> None:
    clip = walking_in_place(lanky)
    take, report = retargeting.retarget_with_same_angles(clip, STANDARD)
    np.testing.assert_allclose(take.qpos[:, :2], report.leg_scale * clip.root_m[:, :2], atol=1e-12)
    np.testing.assert_allclose(np.diff(take.qpos[:, 2]), report.leg_scale * np.diff(clip.root_m[:, 2]), atol=1e-12)
    pose = kinematics.pose_from_qpos(STANDARD, take.qpos)
    standing = ground.detect_stance(
        lanky, kinematics.pose_from_qpos(lanky, retargeting.retarget_to_own_body(clip)[1].qpos), clip.rate_hz
    )
    assert np.median(ground.sole_heights_m(STANDARD, pose)[standing]) == pytest.approx(0.0, abs=5e-3)


def test_angles_of_files_are_kept_on_the_common_body(mocap: Path) -> None:
    """Angles are equal to the bit; unwrapping them before does not change the rotation of any bone."""
    for path in amcs(mocap)[::20]:
        clip = as_recorded(path)
        own, dofs = clip.skeleton.subset(humanoid24.BONES)
        np.testing.assert_allclose(own.axes, STANDARD.axes, atol=1e-9)
        kept = humanoid24.unpack(retargeting.retarget_with_same_angles(clip, STANDARD)[0].qpos)[2]
        np.testing.assert_array_equal(kept, clip.angles_rad[:, dofs])
        take, _ = retargeting.retarget_with_same_angles(unwrapped(clip), STANDARD)
        recorded = skeleton.forward_kinematics(STANDARD, clip.root_m, clip.world_from_root, clip.angles_rad[:, dofs])
        found = kinematics.pose_from_qpos(STANDARD, take.qpos)
        np.testing.assert_allclose(found.world_from_bone, recorded.world_from_bone, atol=1e-9)


def test_feet_that_never_stand_are_not_measured() -> None:
    clip = walking_in_place(STANDARD)
    flying = replace(clip, root_m=clip.root_m + 3.0 * np.arange(len(clip))[:, None] / clip.rate_hz)
    report = retargeting.retarget_to_common_body(flying, STANDARD)[1]
    assert report.stance_share == 0.0
    assert np.isnan([report.float_mm, report.sink_mm, report.float_plain_mm, report.sink_plain_mm]).all()
    assert np.isfinite(report.deviation_mm)


def onto_standard(paths: list[Path], mocap: Path) -> Iterator[RetargetReport]:
    for path in paths:
        yield retargeting.retarget_to_common_body(unwrapped(as_recorded(path)), STANDARD)[1]


def hold(reports: list[RetargetReport]) -> None:
    """Check the statements in the README of the model."""
    for report in reports:
        assert report.deviation_mm < 35.0, report
        assert report.deviation_mm < report.deviation_plain_mm + 5.0, report
        assert report.deviation_mm < 1.75 * report.proportions_mm, report
        if report.stance_share:
            assert max(report.float_mm, report.sink_mm) < 20.0, report
    measured = [r for r in reports if r.stance_share]
    assert len(measured) >= 0.95 * len(reports)
    assert np.mean([max(r.float_mm, r.sink_mm) for r in measured]) < 8.0
    assert np.mean([r.deviation_mm for r in reports]) < 0.9 * np.mean([r.deviation_plain_mm for r in reports])


def table(reports: list[RetargetReport]) -> str:
    names = [field.name for field in fields(RetargetReport)]
    rows = [names] + [[_shown(getattr(r, name)) for name in names] for r in reports]
    for label, of in (("mean", np.nanmean), ("largest", np.nanmax)):
        rows.append([label] + [_shown(float(of([getattr(r, name) for r in reports]))) for name in names[1:]])
    widths = [max(len(row[column]) for row in rows) for column in range(len(names))]
    return "\n".join("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)


def _shown(value: str | float) -> str:
    if isinstance(value, str):
        return value
    return "not measured" if np.isnan(value) else f"{value:.3f}" if abs(value) < 2.0 else f"{value:.1f}"


@pytest.mark.long
def test_one_clip_of_each_subject_on_the_standard_body(mocap: Path) -> None:
    first = {path.stem.split("_")[0]: path for path in reversed(amcs(mocap))}
    hold(list(onto_standard(sorted(first.values()), mocap)))


@pytest.mark.slow
def test_every_staged_clip_on_the_standard_body(mocap: Path, capsys: pytest.CaptureFixture[str]) -> None:
    reports = list(onto_standard(amcs(mocap), mocap))
    with capsys.disabled():
        print("\n" + table(reports))
    hold(reports)


def test_the_root_needs_no_unit_quaternion_sign(rng: np.random.Generator) -> None:
    clip = walking_in_place(STANDARD.with_bones(1.05 * STANDARD.bone_m))
    flipped = replace(clip, world_from_root=-clip.world_from_root)
    one, other = (retargeting.retarget_to_common_body(c, STANDARD)[0].qpos for c in (clip, flipped))
    np.testing.assert_allclose(one[:, 7:], other[:, 7:], atol=1e-12)
    np.testing.assert_allclose(one[:, :3], other[:, :3], atol=1e-12)


def test_a_retargeted_take_poses_in_mujoco(lanky: Skeleton) -> None:
    take, _ = retargeting.retarget_to_common_body(walking_in_place(lanky), STANDARD)
    model = humanoid.build_body().model
    data = mujoco.MjData(model)
    data.qpos[:] = take.qpos[10]
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.body("root").xpos, take.qpos[10, :3])


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
    np.testing.assert_allclose(retargeting.match_bone_directions(lanky, qpos, lanky), angles_rad, atol=1e-6)
    longer = lanky.with_bones(1.2 * lanky.bone_m)
    np.testing.assert_allclose(retargeting.match_bone_directions(lanky, qpos, longer), angles_rad, atol=1e-6)


def test_three_hinges_point_exactly_and_fewer_come_nearer(lanky: Skeleton, rng: np.random.Generator) -> None:
    qpos = random_qpos(rng, 200)
    _, _, kept_rad = humanoid24.unpack(qpos)
    meant = directions(lanky, qpos, kept_rad)
    before, after = (
        np.linalg.norm(directions(STANDARD, qpos, angles) - meant, axis=2).mean(axis=0)
        for angles in (kept_rad, retargeting.match_bone_directions(lanky, qpos, STANDARD))
    )
    assert np.max(after[FREE]) < 1e-7
    np.testing.assert_allclose(after[RIGID], before[RIGID])
    assert np.mean(after) < 0.5 * np.mean(before)


def test_a_correction_never_leaves_the_limits(rng: np.random.Generator) -> None:
    bone_m = np.array(STANDARD.bone_m)
    bone_m[STANDARD.index("lclavicle")] = [0.15, 0.12, 0.0]  # 55 deg off: more than the clavicle's hinges allow
    qpos = random_qpos(rng, 50)
    fitted = retargeting.match_bone_directions(STANDARD.with_bones(bone_m), qpos, STANDARD)
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
            np.abs(retargeting.match_bone_directions(small, qpos, STANDARD)[:, _one_hinge()] - smooth[:, _one_hinge()])
        )
        < 0.1
    )
    fitted = retargeting.match_bone_directions(small, qpos, STANDARD)
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
