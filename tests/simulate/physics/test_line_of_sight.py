"""Rays against the body and the furniture."""

import mujoco
import numpy as np
import pytest

from harness.body import Body, body_spec, build_body
from harness.core.arrays import Bools, Floats
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.simulate.physics.line_of_sight import LineOfSight, ray_model
from harness.simulate.physics.room import Box, Room
from harness.simulate.trajectory import Trajectory
from tests.simulate.physics.rooms import ORIGIN_M, placed

TO_TRACKER = np.array([1.0, -1.0, -1.0])


def blocked_by_single_rays(model: mujoco.MjModel, data: mujoco.MjData, start_m: Floats, end_m: Floats) -> Bools:
    """The same question put to `mj_ray`, in world axes."""
    geom, out = np.zeros(1, dtype=np.int32), []
    for end in end_m:
        length_m = float(np.linalg.norm(end - start_m))
        hit_m = mujoco.mj_ray(model, data, start_m, (end - start_m) / length_m, None, True, -1, geom)
        out.append(0.0 <= hit_m < length_m - 0.02)
    return np.array(out)


def compare_rays(body: Body, take: BodyMotion, poses: int, rays: int) -> None:
    room = placed(Room(furniture=(Box((0.6, 0.4, 0.4), (0.5, 0.7, 0.8)),)))
    sight, model = LineOfSight(body, room), ray_model(body_spec(body.skeleton), room)
    data, rng = mujoco.MjData(model), generator(1, "rays")
    trajectory, share = Trajectory(body, take), 0.0
    for time_s in rng.uniform(0.0, trajectory.duration_s, poses):
        data.qpos = qpos = trajectory.qpos(np.array([time_s]))[0]
        mujoco.mj_kinematics(model, data)
        sight.pose_body(qpos)
        around_m = qpos[:3]
        start_m = around_m + np.array([*rng.uniform(-2.0, 2.0, 2), 1.5])
        end_m = around_m + rng.uniform(-0.9, 0.9, (rays, 3))
        got = sight.occlusion((start_m - ORIGIN_M) * TO_TRACKER, (end_m - ORIGIN_M) * TO_TRACKER)
        np.testing.assert_array_equal(got, blocked_by_single_rays(model, data, start_m, end_m))
        share += got.mean() / poses
    assert 0.05 < share < 0.95


def test_many_rays_at_once_equal_single_ones(boxer: tuple[Body, BodyMotion]) -> None:
    compare_rays(*boxer, poses=50, rays=20)


@pytest.mark.long
def test_a_hundred_thousand_rays_at_once_equal_single_ones(boxer: tuple[Body, BodyMotion]) -> None:
    compare_rays(*boxer, poses=2000, rays=50)


def test_a_geom_without_contact_flags_still_blocks() -> None:
    """MuJoCo leaves such a geom out of the bounds of its body, and rays that miss the bounds miss the geom."""
    spec = body_spec(build_body().skeleton)
    spec.body("lhand").add_geom(
        name="ball", type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=[0.0, 0.4, 0.0], size=[0.15, 0.0, 0.0], contype=0
    )
    unchanged, model = spec.copy().compile(), ray_model(spec, placed())
    hits = []
    for each in (unchanged, model):
        data = mujoco.MjData(each)
        data.qpos = each.key("tpose").qpos
        mujoco.mj_kinematics(each, data)
        ball_m = data.geom("ball").xpos
        above_m = ball_m + np.array([0.0, 0.0, 1.0])
        geom, share = np.zeros(1, dtype=np.int32), np.zeros(1)
        mujoco.mj_multiRay(each, data, above_m, ball_m - above_m, None, True, -1, geom, share, None, 1, mujoco.mjMAXVAL)
        hits.append(each.geom(geom[0]).name)
    assert hits == ["floor", "ball"]


def test_furniture_blocks_what_lies_behind_it_and_nothing_else() -> None:
    sight = LineOfSight(None, placed(Room(furniture=(Box((1.0, 0.5, 1.0), (0.4, 0.4, 0.2)),))))
    # World (1, 0.5, 1) is (1, -0.5, 1.5) in the tracker's frame, whose origin is 2.5 m above the floor.
    emitter_m = np.array([1.0, -0.5, 0.0])
    ends_m = emitter_m + np.array([[0.0, 0.0, 2.0], [0.19, -0.19, 1.7], [0.25, 0.0, 1.7], [0.0, 0.0, 1.3]])
    np.testing.assert_array_equal(sight.occlusion(emitter_m, ends_m), [True, True, False, False])


def test_furniture_stands_where_the_middle_of_the_room_says() -> None:
    room = Room(furniture=(Box((0.0, 0.0, 1.0), (0.4, 0.4, 0.2)),))
    ends_m = np.array([[0.3, -0.2, 2.0], [0.0, 0.15, 2.0]])
    for end_m, hidden in zip(ends_m, (True, False), strict=True):
        sight = LineOfSight(None, placed(room, np.array([0.3, 0.2])))
        assert sight.occlusion(end_m * [1.0, 1.0, 0.0], end_m[None]).all() == hidden


def test_a_surface_less_than_two_centimetres_before_the_end_does_not_block() -> None:
    sight = LineOfSight(None, placed(Room(furniture=(Box((0.0, 0.0, 0.5), (1.0, 1.0, 1.0)),))))
    ends_m = np.array([[0.0, 0.0, 1.519], [0.0, 0.0, 1.521]])
    np.testing.assert_array_equal(sight.occlusion(np.zeros(3), ends_m), [False, True])


def test_the_floor_does_not_block() -> None:
    sight = LineOfSight(build_body(), placed())
    assert not sight.occlusion(np.array([2.0, 2.0, 0.0]), np.array([[2.0, 2.0, 5.0]])).any()


def test_the_body_casts_its_shadow_where_it_stands() -> None:
    body = build_body()
    sight, qpos = LineOfSight(body, placed()), np.array(body.model.key("tpose").qpos)
    emitter_m, behind_m = np.array([2.0, 0.0, 1.4]), np.array([[-1.0, 0.0, 1.4]])
    sight.pose_body(qpos)
    assert sight.occlusion(emitter_m, behind_m).all()
    qpos[1] += 2.0
    sight.pose_body(qpos)
    assert not sight.occlusion(emitter_m, behind_m).any()


def test_the_bodys_own_model_stays_as_it_is() -> None:
    body = build_body()
    LineOfSight(body, placed())
    assert body.model.geom("floor").contype[0] == 0
    assert body.model.geom("lhand").contype[0] == 1
