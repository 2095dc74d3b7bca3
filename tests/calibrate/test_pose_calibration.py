"""Skeleton, mounts and room from eight poses, against the truth."""

import pickle  # of our own, as a worker process sends it
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from harness.calibrate import pose_checks
from harness.calibrate.bundle_adjustment import BundleAdjustment
from harness.calibrate.bundle_fit import fit_bundle
from harness.calibrate.hold import UnusableHold
from harness.calibrate.pose_calibration import PoseCalibration, calibrate_poses
from harness.calibrate.poses import POSES, pose_angles_rad
from harness.calibrate.tpose_calibration import LEVEL_FROM_TRACKER
from harness.calibrate.unknowns import SharedUnknowns
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.errors import BadInput
from harness.stream import TrackerFrame
from tests.calibrate.standing_model import FIVE, SIX, Model, reordered, somebody, space, turned

BEYOND = ("head", "lwrist", "rwrist", "lhand", "rhand", "ltibia", "rtibia", "lfoot", "rfoot", "lradius", "rradius")
"""Bones on which no reading depends: those beyond the last tracker, and the split of the forearms."""


def found_of(model: Model) -> PoseCalibration:
    return calibrate_poses(model.held(), space(), model.mounts)


def elbow_off_m(found: PoseCalibration, model: Model) -> Floats:
    """(S,) errors of mounts; of a tracker on a wrist from the elbow, see docs/calibration.md."""
    off_m = found.calibration.mount_m - model.truth.mount_m
    for row, bone in enumerate(found.calibration.bones):
        if bone.endswith("wrist"):
            radius = model.skeleton.index(f"{bone[0]}radius")
            off_m[row] += found.skeleton.bone_m[radius] - model.skeleton.bone_m[radius]
    return np.asarray(np.linalg.norm(off_m, axis=1))


def turned_deg(found: PoseCalibration, model: Model) -> Floats:
    return np.rad2deg(rotations.angle_between_rad(found.calibration.bone_from_station, model.truth.bone_from_station))


def rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.asarray(values) ** 2)))


@pytest.mark.parametrize(("number", "own_directions"), [(0, False), (1, True)])
def test_clean_poses_give_the_truth(number: int, own_directions: bool) -> None:
    """Calibration of a performer outside the prior's population, with random mounts and strap orientations."""
    model = Model(somebody(number, own_directions), beside_m=0.01, seed=number)
    found, truth = found_of(model), model.truth
    off_m = np.abs(found.skeleton.length_m - model.skeleton.length_m)
    determined = [name for name, prior in zip(found.skeleton.names, found.from_prior, strict=True) if not prior]
    assert set(BEYOND).isdisjoint(determined)
    assert {"lhumerus", "rhumerus", "lfemur", "rfemur", "lclavicle", "rclavicle", "thorax"} <= set(determined)
    assert off_m[~found.from_prior].max() < 0.002
    assert elbow_off_m(found, model).max() < 0.005
    assert turned_deg(found, model).max() < 0.1
    assert rotations.angle_between_rad(found.calibration.world_from_tracker, truth.world_from_tracker) < 1e-3
    origin_m = found.calibration.tracker_origin_m - truth.tracker_origin_m
    assert np.linalg.norm(origin_m[:2]) < 0.003
    assert abs(origin_m[2]) < 0.06  # how far soles are below the trackers is of the prior
    assert found.residual_m.max() < 1e-3
    assert np.rad2deg(found.hinge_error_rad) < 0.05
    assert found.calibration.kind == "poses"


@pytest.mark.parametrize(
    ("miss_deg", "mount_mm", "mount_deg", "length_mm"), [(1.0, 8.0, 1.0, 8.0), (5.0, 25.0, 4.0, 9.5)]
)
def test_poses_that_are_missed(miss_deg: float, mount_mm: float, mount_deg: float, length_mm: float) -> None:
    """Root mean squares over two performers: the miss is found, and everything is nearer than the mean
    skeleton. Of twenty: tests/bench/test_calibration_accuracy.py."""
    lengths, mean, mounts, turns, misses = [], [], [], [], []
    for seed in range(2):
        model = Model(somebody(seed), SIX, float(np.deg2rad(miss_deg)), 0.0015, 0.006, beside_m=0.01, seed=seed)
        found = found_of(model)
        lengths.append(found.skeleton.length_m - model.skeleton.length_m)
        mean.append(found.mean_m - model.skeleton.length_m)
        mounts.append(elbow_off_m(found, model))
        turns.append(turned_deg(found, model))
        misses.append(found.hinge_error_rad)
    assert np.rad2deg(np.mean(misses)) == pytest.approx(miss_deg, rel=0.2)
    assert 1e3 * rms(np.array(mounts)) < mount_mm
    assert rms(np.array(turns)) < mount_deg
    assert 1e3 * rms(np.array(lengths)) < min(length_mm, 0.8 * 1e3 * rms(np.array(mean)))


def test_where_the_room_lies_and_how_straps_sit_does_not_matter() -> None:
    """Another room and other strap orientations give the same body and the same mount positions."""
    one = Model(somebody(2), SIX, 0.02, beside_m=0.01, yaw_rad=0.3)
    other = replace(one, yaw_rad=-2.9, shift_m=(-4.0, 9.0, -1.0), straps=False)
    first, second = found_of(one), found_of(other)
    np.testing.assert_allclose(first.skeleton.bone_m, second.skeleton.bone_m, atol=1e-4)
    np.testing.assert_allclose(first.calibration.mount_m, second.calibration.mount_m, atol=1e-4)
    np.testing.assert_allclose(turned_deg(first, one), turned_deg(second, other), atol=0.05)
    assert second.hinge_error_rad == pytest.approx(first.hinge_error_rad, rel=1e-2)
    for found, model in ((first, one), (second, other)):
        origin_m = found.calibration.tracker_origin_m - model.truth.tracker_origin_m
        assert np.linalg.norm(origin_m) < 0.25  # a few degrees of heading at nine metres


def test_the_order_of_stations_does_not_matter() -> None:
    model, rows = Model(somebody(3), SIX, 0.02), [4, 2, 0, 5, 1, 3]
    plain, held = found_of(model), reordered(model.held(), rows)
    found = calibrate_poses(held, space(), [model.mounts[row] for row in rows])
    assert found.calibration.stations == tuple(SIX[row] for row in rows)
    np.testing.assert_allclose(found.calibration.mount_m, plain.calibration.mount_m[rows], atol=1e-4)
    np.testing.assert_allclose(found.skeleton.length_m, plain.skeleton.length_m, atol=1e-4)


@pytest.mark.parametrize(
    ("stations", "unseen"),
    [
        (SIX[:4], ("lowerneck", "upperneck", "head", "ltibia", "lfoot", "lhand", "lradius", "thorax")),
        (FIVE, ("lowerneck", "upperneck", "head", "ltibia", "rtibia", "lfoot", "lhand", "rhand")),
        (("left_wrist", "right_wrist", "head"), ("lfemur", "rfemur", "ltibia", "lhipjoint", "rhipjoint", "rfoot")),
    ],
)
def test_what_few_stations_do_not_tell_is_named(stations: tuple[str, ...], unseen: tuple[str, ...]) -> None:
    model = Model(somebody(4), stations, float(np.deg2rad(1.0)), 0.0015, 0.006)
    found = found_of(model)
    told = dict(zip(found.skeleton.names, found.from_prior, strict=True))
    assert all(told[name] for name in unseen)
    assert rms(found.skeleton.length_m - model.skeleton.length_m) < 0.02


def test_uncertainty_is_reported() -> None:
    model = Model(somebody(5), SIX, float(np.deg2rad(1.0)), 0.0015, 0.006, beside_m=0.01)
    found = found_of(model)
    prior = np.sqrt(np.diag(space().covariance_m2))
    assert np.all(found.length_sd_m <= prior + 1e-9)
    assert np.all(found.length_sd_m <= found.length_bound_m + 1e-9)
    assert np.all(found.mount_sd_m <= found.mount_bound_m + 1e-9)
    assert np.all((found.variance_reduction >= -1e-6) & (found.variance_reduction <= 1.0))
    assert np.all(np.isinf(found.length_bound_m[[found.skeleton.index(bone) for bone in ("lhand", "rfoot", "head")]]))
    assert np.all(np.isfinite(found.length_bound_m[[found.skeleton.index(bone) for bone in ("lhumerus", "rhumerus")]]))
    assert np.isfinite(found.condition)


def test_a_strap_put_on_the_other_way_round_gives_a_hint() -> None:
    """A nominal strap gives no hint; a rotated one gives a hint, and the calibration is as good."""
    model = Model(somebody(6), straps=False)
    assert found_of(model).hints == ()
    held = [
        [
            replace(
                frame,
                tracker_from_station=np.concatenate(
                    [
                        frame.tracker_from_station[:2],
                        rotations.multiply(frame.tracker_from_station[2:3], rotations.about_z(np.pi / 2)),
                        frame.tracker_from_station[3:],
                    ]
                ),
            )
            for frame in frames
        ]
        for frames in model.held()
    ]
    found = calibrate_poses(held, space(), model.mounts)
    assert len(found.hints) == 1
    assert "station 3 (left_ankle) is rotated by 90 deg about z on its strap" in found.hints[0]
    assert turned_deg(found, model)[[0, 1, 3, 4, 5]].max() < 0.1


def refusal(held: Sequence[Sequence[TrackerFrame]], model: Model) -> str:
    with pytest.raises(UnusableHold) as caught:
        calibrate_poses(held, space(), model.mounts)
    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)  # noqa: S301  # our own
    return str(caught.value)


@pytest.mark.parametrize(("station", "axis", "deg"), [(0, 2, 90.0), (2, 2, 90.0), (4, 2, -60.0), (5, 0, 90.0)])
def test_a_boresight_left_on_is_found(station: int, axis: int, deg: float) -> None:
    model = Model(somebody(7), SIX, float(np.deg2rad(2.5)), 0.0015, 0.006)
    told = refusal(turned(model.held(), station, rotations.exp(np.deg2rad(deg) * np.eye(3)[axis])), model)
    assert f"station {station + 1} ({SIX[station]}) " in told
    assert f"deg about {'xyz'[axis]}" in told
    size = float(told.split(f"({SIX[station]}) ")[1].split(" deg")[0])
    assert size == pytest.approx(deg, abs=12.0)
    assert f"send b{station + 1})" in told


@pytest.mark.parametrize(
    ("rows", "told"),
    [
        ([0, 1, 3, 2, 4, 5], ["'left_ankle' with 'right_ankle'"]),
        ([1, 0, 3, 2, 4, 5], ["'left_wrist' with 'right_wrist'", "'left_ankle' with 'right_ankle'"]),
    ],
)
def test_exchanged_stations_are_named(rows: list[int], told: list[str]) -> None:
    model = Model(somebody(8), SIX, float(np.deg2rad(2.5)), 0.0015, 0.006)
    message = refusal(reordered(model.held(), rows), model)
    assert message.startswith("Stations look exchanged")
    assert all(words in message for words in told)


def test_a_pose_that_was_not_held_is_named() -> None:
    model = Model(somebody(9), SIX, float(np.deg2rad(1.0)), 0.0015, 0.006)
    held = model.held()
    held[4] = held[0]
    message = refusal(held, model)
    assert "Pose 5 (left leg up) was not held as shown" in message
    assert "mm" in message


def test_a_performer_who_moved_learns_in_which_pose() -> None:
    model = Model(somebody(10))
    held = model.held()
    held[3] = [replace(frame, position_m=frame.position_m + 0.2 * k * np.eye(6, 3)) for k, frame in enumerate(held[3])]
    message = refusal(held, model)
    assert "'left_wrist' moved" in message
    assert "(arms bent)" in message


def test_stations_that_do_not_tell_the_heading_are_refused() -> None:
    """A fit whose heading is too uncertain is refused."""
    model = Model(somebody(11), ("torso", "head"))
    nominal_rad = np.array([pose_angles_rad(pose, standard_skeleton()) for pose in POSES])
    still = [rows[0] for rows in model.held()]
    place_m = rotations.rotate(LEVEL_FROM_TRACKER, np.array([frame.position_m for frame in still]))
    turn = rotations.multiply(LEVEL_FROM_TRACKER, np.array([frame.tracker_from_station for frame in still]))
    shared = SharedUnknowns(standard_skeleton(), space(), model.mounts)
    bundle = BundleAdjustment(shared, nominal_rad, place_m, rotations.to_matrix(turn))
    found = fit_bundle(bundle, 0.001, 0.005)
    pose_checks.require_poses_held(bundle, found, range(8))
    with pytest.raises(UnusableHold, match="torso, head do not determine which way the performer faces"):
        pose_checks.require_poses_held(bundle, replace(found, heading_sd_rad=0.4), range(8))


def test_poses_may_be_left_out_but_for_the_first() -> None:
    """Five poses find the mounts of a noise-free performer; each pose is compared with itself."""
    model = Model(somebody(3))
    held = [rows if number in (0, 1, 3, 5, 6) else [] for number, rows in enumerate(model.held())]
    found = calibrate_poses(held, space(), model.mounts)
    assert found.pose_numbers == (0, 1, 3, 5, 6)
    assert found.pose_error_rad.shape == (5,)
    assert found.hinge_error_rad < np.deg2rad(0.5)
    off_rad = rotations.angle_between_rad(found.calibration.bone_from_station, model.truth.bone_from_station)
    assert np.rad2deg(off_rad).max() < 2.0
    for without in (range(1, 8), range(4)):
        with pytest.raises(UnusableHold, match="the first and 4 others are needed"):
            calibrate_poses([rows if n in without else [] for n, rows in enumerate(held)], space(), model.mounts)


def test_other_numbers_of_poses_or_stations_are_refused() -> None:
    model = Model(somebody(12))
    with pytest.raises(BadInput, match="7 poses were held; 8 are needed"):
        calibrate_poses(model.held()[:7], space(), model.mounts)
    with pytest.raises(BadInput, match="Frames of 6 stations, but 4 are worn"):
        calibrate_poses(model.held(), space(), model.mounts[:4])


def test_a_reading_that_is_far_off_hardly_matters() -> None:
    """One station 3 cm elsewhere in one pose, as devices are for seconds (docs/is900.md 13.1): t-distributed readings
    leave it alone."""
    model = Model(somebody(13), noise_m=0.001, noise_rad=0.004)
    held = model.held()
    off = np.zeros((6, 3))
    off[3] = [0.0, 0.03, 0.0]
    held[5] = [replace(frame, position_m=frame.position_m + off) for frame in held[5]]
    plain, found = found_of(model), calibrate_poses(held, space(), model.mounts)
    assert np.linalg.norm(found.calibration.mount_m - plain.calibration.mount_m, axis=1).max() < 0.01
    assert np.abs(found.skeleton.length_m - plain.skeleton.length_m).max() < 0.01


def test_the_hinges_of_the_standard_skeleton_are_kept() -> None:
    found = found_of(Model(somebody(14)))
    assert found.skeleton.dof_names == standard_skeleton().dof_names
    np.testing.assert_array_equal(found.skeleton.axes, standard_skeleton().axes)
