"""Room and mounts in closed form."""

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.measure.handeye import (
    PosePairs,
    most_likely_hand_eye,
    pair_residuals,
    second_spread_rad,
    solve_hand_eye,
)
from harness.measure.registration_model import OWN, SHARED, RegistrationState


def pair_poses(
    rng: np.random.Generator, room: Floats, origin_m: Floats, mount: Floats, mount_m: Floats,
    *, turns: Floats | None = None, noise: float = 0.0,
) -> PosePairs:  # fmt: skip
    """Poses of one station; `turns` are rotation vectors (N, 3) of its body [rad]."""
    turns = rng.normal(size=(40, 3)) if turns is None else turns
    body, body_m = rotations.exp(turns), rng.normal(size=(len(turns), 3))
    at_m = rotations.rotate(room, body_m + rotations.rotate(body, mount_m) - origin_m)
    turn = rotations.multiply(rotations.multiply(room, body), mount)
    turn = rotations.multiply(rotations.exp(noise * rng.normal(size=turns.shape)), turn)
    return PosePairs(at_m + noise * rng.normal(size=at_m.shape), turn, body_m, body)


ANGLES = [0.0, 1e-9, 1e-4, 1.0, np.pi - 1e-6, np.pi]


@pytest.mark.parametrize("room_rad", ANGLES)
@pytest.mark.parametrize("mount_rad", ANGLES)
def test_exact_poses_give_room_and_mounts(room_rad: float, mount_rad: float, rng: np.random.Generator) -> None:
    axes = rng.normal(size=(3, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    room, origin_m = rotations.exp(room_rad * axes[0]), np.array([0.3, -1.0, 2.5])
    mounts, places = rotations.exp(mount_rad * axes[1:]), rng.normal(size=(2, 3))
    pairs = [pair_poses(rng, room, origin_m, mounts[s], places[s]) for s in range(2)]
    found = solve_hand_eye(pairs)
    assert rotations.angle_between_rad(found.tracker_from_world, room) < 1e-7
    assert rotations.angle_between_rad(found.body_from_station, mounts).max() < 1e-7
    np.testing.assert_allclose(found.tracker_origin_m, origin_m, atol=1e-8)
    np.testing.assert_allclose(found.mount_m, places, atol=1e-8)
    assert found.scale == 0.0


def test_motion_about_one_axis_is_refused_with_what_it_does_not_show(rng: np.random.Generator) -> None:
    identity, zero = rotations.IDENTITY, np.zeros(3)
    axis = np.array([0.0, 0.6, 0.8])
    turns = np.linspace(-1.0, 1.0, 50)[:, None] * axis
    with pytest.raises(BadInput, match=r"one axis only.*\n?.*Not observable: each mount's rotation about this axis"):
        solve_hand_eye([pair_poses(rng, identity, zero, identity, zero, turns=turns)])


def test_one_body_that_turns_about_two_axes_shows_the_room_for_all(rng: np.random.Generator) -> None:
    room, origin_m = rotations.exp(np.array([0.3, 1.0, 0.2])), np.array([0.3, -1.0, 2.5])
    mount, place = rotations.exp(np.array([0.5, -0.2, 0.7])), np.array([0.1, 0.2, 0.3])
    hinge = np.linspace(-1.0, 1.0, 50)[:, None] * np.array([0.0, 0.6, 0.8])
    pairs = [
        pair_poses(rng, room, origin_m, mount, place, turns=hinge),
        pair_poses(rng, room, origin_m, rotations.inverse(mount), -place),
    ]
    found = solve_hand_eye(pairs)
    assert rotations.angle_between_rad(found.body_from_station[0], mount) < 1e-7


def test_a_body_that_stays_in_place_shows_the_room(rng: np.random.Generator) -> None:
    room, zero = rotations.exp(np.array([0.3, 1.0, 0.2])), np.zeros(3)
    moving = pair_poses(rng, room, np.array([0.3, -1.0, 2.5]), rotations.IDENTITY, zero)
    still_m = rotations.rotate(room, np.tile([-0.3, 1.0, -2.5], (40, 1)))
    still = PosePairs(still_m, moving.tracker_from_station, np.zeros((40, 3)), moving.world_from_body)
    assert rotations.angle_between_rad(solve_hand_eye([still]).tracker_from_world, room) < 1e-7


@pytest.mark.parametrize("count", [1, 2])
def test_the_refined_solution_is_the_most_likely_one(count: int, rng: np.random.Generator) -> None:
    """A gradient by differences vanishes there, but not at the closed form; each part weighs by its own residuals."""
    room, origin_m = rotations.exp(np.array([0.4, -0.2, 1.0])), np.array([0.3, -1.0, 2.5])
    mounts, places = rotations.exp(rng.normal(size=(2, 3))), rng.normal(size=(2, 3))
    pairs = [pair_poses(rng, room, origin_m, mounts[s], places[s], noise=1e-2) for s in range(count)]

    def cost(state: RegistrationState, weights: Floats) -> float:
        parts = [pair_residuals(one, state, s) for s, one in enumerate(pairs)]
        return float(sum(weight * np.sum(part[i] ** 2) for part in parts for i, weight in enumerate(weights)))

    def slopes(state: RegistrationState) -> Floats:
        weights = np.array([1.0 / cost(state, np.eye(2)[i]) for i in (0, 1)])
        steps = 1e-5 * np.eye(SHARED + count * OWN)[[*range(6), *range(SHARED, SHARED + count * OWN)]]
        return np.array([cost(state.moved(step), weights) - cost(state.moved(-step), weights) for step in steps]) / 2e-5

    closed, refined = solve_hand_eye(pairs), most_likely_hand_eye(pairs)
    assert refined.scale == refined.offset_s == 0.0
    assert np.abs(slopes(refined)).max() < 1e-5 < 1e-2 < np.abs(slopes(closed)).max()


def test_spread_is_that_about_the_second_axis() -> None:
    angle = np.linspace(-0.3, 0.3, 1001)
    turns = np.stack([2.0 * angle, np.zeros_like(angle), np.roll(angle, 300)], axis=1)
    assert second_spread_rad(rotations.exp(turns)) == pytest.approx(np.sqrt(np.mean(angle**2)), rel=0.15)
    assert second_spread_rad(np.empty((0, 4))) == 0.0


@pytest.mark.long
def test_opencv_agrees(rng: np.random.Generator) -> None:
    """Shah's method of OpenCV on the same noisy poses of one station, whose scale is exact."""
    cv2 = pytest.importorskip("cv2")
    room, origin_m = rotations.exp(np.array([0.4, -0.2, 1.0])), np.array([0.3, -1.0, 2.5])
    mount, place = rotations.exp(np.array([0.5, -0.2, 0.7])), np.array([0.1, 0.2, 0.3])
    pairs = pair_poses(rng, room, origin_m, mount, place, noise=1e-3)
    ours = solve_hand_eye([pairs])
    # OpenCV: A X = Z B with A = cam_from_world, X = world_from_base, Z = cam_from_gripper, B = gripper_from_base. Ours
    # is station_from_tracker * tracker_from_world = station_from_body * body_from_world.
    from_station, from_body = rotations.inverse(pairs.tracker_from_station), rotations.inverse(pairs.world_from_body)
    turn_x, shift_x, turn_z, shift_z = cv2.calibrateRobotWorldHandEye(
        list(rotations.to_matrix(from_station)), list(-rotations.rotate(from_station, pairs.position_m)),
        list(rotations.to_matrix(from_body)), list(-rotations.rotate(from_body, pairs.body_m)),
        method=cv2.CALIB_ROBOT_WORLD_HAND_EYE_SHAH,
    )  # fmt: skip
    theirs = rotations.from_matrix(np.array([turn_x, turn_z]))
    station_from_body = rotations.inverse(ours.body_from_station[0])
    tracker_from_world = ours.tracker_from_world
    assert rotations.angle_between_rad(theirs[0], tracker_from_world) < 1e-3
    assert rotations.angle_between_rad(theirs[1], station_from_body) < 1e-3
    ours_x_m = -rotations.rotate(tracker_from_world, ours.tracker_origin_m)
    ours_z_m = -rotations.rotate(station_from_body, ours.mount_m[0])
    np.testing.assert_allclose(shift_x.ravel(), ours_x_m, atol=2e-3)
    np.testing.assert_allclose(shift_z.ravel(), ours_z_m, atol=2e-3)


@pytest.mark.long
def test_evo_agrees_on_the_alignment_of_a_trajectory(rng: np.random.Generator) -> None:
    """Umeyama's alignment in evo of a station in the body's origin."""
    geometry = pytest.importorskip("evo.core.geometry")
    room, origin_m, zero = rotations.exp(np.array([0.4, -0.2, 1.0])), np.array([0.3, -1.0, 2.5]), np.zeros(3)
    pairs = pair_poses(rng, room, origin_m, rotations.IDENTITY, zero, noise=1e-4)
    found = solve_hand_eye([pairs])
    turn, shift, _ = geometry.umeyama_alignment(pairs.position_m.T, pairs.body_m.T, with_scale=False)
    assert rotations.angle_between_rad(rotations.inverse(found.tracker_from_world), rotations.from_matrix(turn)) < 2e-4
    np.testing.assert_allclose(found.tracker_origin_m, shift, atol=1e-3)
