"""Mounts of trackers on the surface of the body."""

import math

import mujoco
import numpy as np
import pytest

from harness.body import anatomy, humanoid, mounts
from harness.body.mounts import DEFAULT_MOUNTS, Mount
from harness.core import humanoid24, rotations
from harness.core.arrays import Floats
from harness.core.skeleton import BodyGeom, Skeleton
from harness.errors import BadInput, UnknownName

STANDARD = humanoid24.standard_skeleton()


def depth(shape: BodyGeom, point_m: Floats) -> float:
    """Negative inside a geom, 0 on its surface; in metres for a capsule, relative for an ellipsoid."""
    local = rotations.rotate(rotations.inverse(shape.bone_from_shape), point_m - shape.centre_m)
    if shape.kind == "capsule":
        core = np.array([0.0, 0.0, np.clip(local[2], -shape.size_m[1], shape.size_m[1])])
        return float(np.linalg.norm(local - core) - shape.size_m[0])
    return float(np.linalg.norm(local / shape.size_m) - 1.0)


@pytest.mark.parametrize("station", DEFAULT_MOUNTS)
def test_the_default_trackers_lie_on_the_skin(station: str, lanky: Skeleton) -> None:
    mount = DEFAULT_MOUNTS[station]
    for own in (STANDARD, lanky):
        bare = Mount(mount.station, mount.bone, mount.along, mount.around_rad, 0.0)
        skin_m, turn = mounts.locate_mount(own, bare)
        near = {mount.bone, "root"} if mount.bone == "lhipjoint" else {mount.bone}
        depths = [depth(s, skin_m) for s in anatomy.body_geoms(own) if s.bone in near]
        assert min(depths) == pytest.approx(0.0, abs=1e-6)
        outward = rotations.rotate(turn, np.array([0.0, 0.0, 1.0]))
        np.testing.assert_allclose(mounts.locate_mount(own, mount)[0], skin_m + mount.stand_off_m * outward, atol=1e-12)


def test_station_axes_are_along_the_bone_and_outward(lanky: Skeleton, rng: np.random.Generator) -> None:
    for bone in ("lradius", "rtibia", "thorax", "rfoot", "head"):
        mount = Mount("s", bone, 0.5, float(rng.uniform(-math.pi, math.pi)), 0.02)
        origin_m, turn = mounts.locate_mount(lanky, mount)
        axes = rotations.to_matrix(turn).T
        bone_m = lanky.bone_m[lanky.index(bone)]
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(axes[0], bone_m / np.linalg.norm(bone_m), atol=1e-12)
        off_axis = origin_m - 0.5 * bone_m
        np.testing.assert_allclose(axes[2], off_axis / np.linalg.norm(off_axis), atol=1e-12)


def outward(bone: str, around_deg: float) -> Floats:
    _, turn = mounts.locate_mount(STANDARD, Mount("s", bone, 0.5, math.radians(around_deg)))
    out: Floats = rotations.rotate(turn, np.array([0.0, 0.0, 1.0]))
    return out


@pytest.mark.parametrize(
    ("bone", "around_deg", "direction"),
    [
        ("lradius", 90.0, (0, 0, -1)),
        ("rradius", 90.0, (0, 0, 1)),
        ("rradius", 0.0, (1, 0, 0)),
        ("thorax", 0.0, (1, 0, 0)),
        ("thorax", 90.0, (0, 1, 0)),
        ("ltibia", 90.0, (0, -1, 0)),
        ("rfoot", 0.0, (0, 0, 1)),
    ],
)
def test_the_angle_around_a_bone_is_the_documented_one(
    bone: str, around_deg: float, direction: tuple[float, ...]
) -> None:
    assert outward(bone, around_deg) @ np.array(direction) > math.cos(math.radians(25.0))


def test_left_and_right_defaults_mirror_each_other() -> None:
    for name, mount in DEFAULT_MOUNTS.items():
        if name.startswith("left_"):
            left_m, _ = mounts.locate_mount(STANDARD, mount)
            right_m, _ = mounts.locate_mount(STANDARD, DEFAULT_MOUNTS["right_" + name[5:]])
            np.testing.assert_allclose(left_m * [1, -1, 1], right_m, atol=1e-9)


def test_the_pelvis_tracker_sits_in_the_middle_of_the_back() -> None:
    origin_m, _ = mounts.locate_mount(STANDARD, DEFAULT_MOUNTS["pelvis"])
    assert origin_m[0] < -0.1
    assert abs(origin_m[1]) < 0.002


def test_trackers_are_sites_of_the_model_at_that_pose(lanky: Skeleton) -> None:
    model = humanoid.build_body(lanky, DEFAULT_MOUNTS.values()).model
    assert [model.site(s).name for s in range(model.nsite)] == sorted(
        DEFAULT_MOUNTS, key=lambda s: humanoid24.BONES.index(DEFAULT_MOUNTS[s].bone)
    )
    for station, mount in DEFAULT_MOUNTS.items():
        site, (origin_m, turn) = model.site(station), mounts.locate_mount(lanky, mount)
        assert model.body(site.bodyid[0]).name == mount.bone
        np.testing.assert_allclose(site.pos, origin_m, atol=1e-12)
        assert float(rotations.angle_between_rad(site.quat, turn)) < 1e-9


def test_a_place_off_the_bone_is_refused() -> None:
    with pytest.raises(BadInput, match="misses its bone"):
        mounts.locate_mount(STANDARD, Mount("s", "lradius", 3.0))
    with pytest.raises(UnknownName, match="ltibia"):
        mounts.locate_mount(STANDARD, Mount("s", "ltibbia"))
    bone_m = np.array(STANDARD.bone_m)
    bone_m[STANDARD.index("lwrist")] = 0.0
    with pytest.raises(BadInput, match="no length"):
        mounts.locate_mount(STANDARD.with_bones(bone_m), DEFAULT_MOUNTS["left_wrist"])


def test_two_trackers_of_one_name_are_refused() -> None:
    with pytest.raises(BadInput, match="has two mounts"):
        humanoid.build_body(None, [Mount("a", "head", 1.0), Mount("a", "thorax")])


def test_rays_see_the_flesh() -> None:
    """Occlusion of ultrasound: the chest lies between the spine and a point in front of it."""
    model = humanoid.build_body().model
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    hit = np.zeros(1, dtype=np.int32)
    eye_m = data.body("thorax").xpos + np.array([1.0, 0.0, 0.06])
    mujoco.mj_ray(model, data, eye_m, np.array([-1.0, 0.0, 0.0]), None, 1, -1, hit)
    assert model.geom(int(hit[0])).name == "thorax"


def test_a_place_that_was_found_before_cannot_be_changed() -> None:
    for array in mounts.locate_mount(STANDARD, DEFAULT_MOUNTS["head"]):
        with pytest.raises(ValueError, match="WRITEABLE"):
            array.flags.writeable = True
