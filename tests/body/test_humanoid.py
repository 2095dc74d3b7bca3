"""The model file, and bodies scaled from it."""

import pickle  # the size of what is sent to a worker; nothing is read back
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from harness.body import anatomy, humanoid, mjcf, mounts
from harness.core import humanoid24, skeleton
from harness.core.package_data import data_folder
from harness.core.skeleton import Skeleton
from harness.core.workers import run_in_workers
from harness.errors import BadInput
from tests.body.conftest import random_qpos

MODEL = data_folder("models") / "humanoid24" / "humanoid24.xml"


def test_the_model_file_is_up_to_date() -> None:
    assert MODEL.read_text() == mjcf.humanoid_mjcf(), (
        "write it anew: python -m harness.body.mjcf > models/humanoid24/..."
    )


def test_plain_mujoco_loads_the_file_and_a_fall_ends_on_the_floor(tmp_path: Path) -> None:
    alone = tmp_path / "alone.xml"
    alone.write_bytes(MODEL.read_bytes())
    model = mujoco.MjModel.from_xml_path(str(alone))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("tpose").id)
    for _ in range(round(3.0 / model.opt.timestep)):
        mujoco.mj_step(model, data)
    assert np.isfinite(data.qpos).all()
    assert not any(warning.number for warning in data.warning)
    assert data.body("head").xpos[2] < 0.5  # it fell
    assert np.min(data.xipos[1:, 2]) > 0.0  # and not through
    assert np.max(np.abs(data.qvel)) < 3.0  # and came to rest, nearly


def test_bodies_and_hinges_are_those_of_the_paper() -> None:
    model = humanoid.build_body().model
    own = humanoid24.standard_skeleton()
    assert (model.nq, model.nv, model.njnt, model.nbody) == (55, 54, 49, 26)
    assert [model.body(b).name for b in range(1, 26)] == ["root", *own.names]
    names = np.array([model.joint(j).name for j in range(1, 49)])
    assert tuple(names[humanoid24.QPOS_OF_DOF]) == own.dof_names
    np.testing.assert_array_equal(model.jnt_qposadr[1:], np.arange(7, 55))
    np.testing.assert_allclose(humanoid.build_body().limits_rad, humanoid24.limits_rad(), atol=1e-12)
    assert model.jnt_limited[1:].all()


def test_the_standard_body_is_the_model_file() -> None:
    plain, built = mujoco.MjModel.from_xml_path(str(MODEL)), humanoid.build_body().model
    for field in ("body_pos", "body_mass", "body_inertia", "jnt_axis", "geom_pos", "geom_size", "key_qpos"):
        np.testing.assert_allclose(getattr(built, field), getattr(plain, field), atol=1e-8, err_msg=field)


def test_mujoco_and_the_core_pose_every_body_alike(lanky: Skeleton, rng: np.random.Generator) -> None:
    body, qpos = humanoid.build_body(lanky), random_qpos(rng, 40)
    pose = skeleton.forward_kinematics(lanky, *humanoid24.unpack(qpos))
    data = mujoco.MjData(body.model)
    for frame, configuration in enumerate(qpos):
        data.qpos[:] = configuration
        mujoco.mj_kinematics(body.model, data)
        np.testing.assert_allclose(data.xpos[body.bone_body_ids], pose.start_m[frame], atol=1e-12)
        found = data.xmat[body.bone_body_ids].reshape(-1, 3, 3)
        np.testing.assert_allclose(found, pose.world_from_bone[frame], atol=1e-12)


def test_flesh_grows_with_the_skeleton() -> None:
    standard = humanoid24.standard_skeleton()
    small, large = (
        humanoid.build_body(standard).model,
        humanoid.build_body(standard.with_bones(1.1 * standard.bone_m)).model,
    )
    np.testing.assert_allclose(large.geom_size[1:], 1.1 * small.geom_size[1:], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(large.geom_pos[1:], 1.1 * small.geom_pos[1:], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(large.body_subtreemass[1], 1.1**2 * small.body_subtreemass[1], rtol=1e-9)


def test_segments_weigh_what_de_leva_says() -> None:
    share = {s.name: 0.0 for s in anatomy.body_geoms(humanoid24.standard_skeleton())}
    whole = sum(s.mass_kg for s in anatomy.body_geoms(humanoid24.standard_skeleton()))
    for shape in anatomy.body_geoms(humanoid24.standard_skeleton()):
        share[shape.name] = 100.0 * shape.mass_kg / whole
    assert whole == pytest.approx(74.2, abs=0.1)
    parts = {
        6.94: ("head", "lowerneck", "upperneck"),
        15.96: ("thorax", "lclavicle", "rclavicle"),
        16.33: ("upperback", "lowerback"),
        11.17: ("pelvis", "lhipjoint", "rhipjoint"),
        2.71: ("lhumerus",),
        1.62: ("rradius", "rwrist"),
        0.61: ("lhand",),
        14.16: ("rfemur",),
        4.33: ("ltibia",),
        1.37: ("rfoot_inner", "rfoot_outer", "rfoot_instep"),
    }
    for percent, names in parts.items():
        assert sum(share[name] for name in names) == pytest.approx(percent, abs=0.02), names


def test_left_mirrors_right() -> None:
    shapes = {s.name: s for s in anatomy.body_geoms(humanoid24.standard_skeleton())}
    for name, right in shapes.items():
        if name.startswith("r"):
            left = shapes["l" + name[1:]]
            np.testing.assert_allclose(left.centre_m * [1, -1, 1], right.centre_m, atol=1e-9, err_msg=name)
            np.testing.assert_allclose(left.size_m, right.size_m, atol=1e-9)


def test_the_t_pose_stands_on_the_floor(lanky: Skeleton) -> None:
    for own in (humanoid24.standard_skeleton(), lanky):
        body = humanoid.build_body(own)
        data = mujoco.MjData(body.model)
        mujoco.mj_resetDataKeyframe(body.model, data, body.model.key("tpose").id)
        mujoco.mj_forward(body.model, data)
        ankle_m = min(data.body("lfoot").xpos[2], data.body("rfoot").xpos[2])
        assert ankle_m == pytest.approx(anatomy.sole_below_ankle_m(own), abs=1e-9)
    body = humanoid.build_body()
    data = mujoco.MjData(body.model)
    mujoco.mj_resetDataKeyframe(body.model, data, 0)
    mujoco.mj_forward(body.model, data)
    lowest = {g: _lowest_m(body.model, data, g) for g in range(body.model.ngeom) if body.model.geom(g).name != "floor"}
    assert min(lowest.values()) == pytest.approx(0.0, abs=2e-3)
    crown_m = data.geom("head").xpos[2] + body.model.geom("head").size[2]
    assert crown_m == pytest.approx(1.755, abs=0.005)  # the height that the mass rests on


def _lowest_m(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> float:
    """Lowest point of a capsule or ellipsoid: z of its centre less the extent of its support along z."""
    down, size = data.geom_xmat[geom].reshape(3, 3)[2], model.geom_size[geom]
    if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_CAPSULE:
        extent = abs(down[2]) * size[1] + size[0]
    else:
        extent = float(np.linalg.norm(down * size))
    return float(data.geom_xpos[geom, 2] - extent)


def test_a_body_is_the_same_bytes_every_time_and_in_every_process(lanky: Skeleton, tmp_path: Path) -> None:
    trackers = tuple(mounts.DEFAULT_MOUNTS.values())
    first = humanoid.build_body(lanky, trackers)
    assert humanoid.build_body(lanky, trackers) is first
    assert len(pickle.dumps(first)) < 5000  # which is how it goes there: what it is made from
    ((_, done),) = run_in_workers(save_model, [(first, tmp_path / "b")], 1)
    done.result()
    save_model(first, tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def save_model(body: humanoid.Body, path: Path) -> None:
    mujoco.mj_saveModel(body.model, str(path), None)


def test_another_skeleton_is_refused() -> None:
    standard = humanoid24.standard_skeleton()
    with pytest.raises(BadInput, match="23 bones"):
        humanoid.build_body(standard.subset(standard.names[:-1])[0])
    with pytest.raises(BadInput, match="humanoid's"):
        humanoid.build_body(replace(standard, names=("spine", *standard.names[1:])))


def test_a_bone_without_length_still_makes_a_body() -> None:
    standard = humanoid24.standard_skeleton()
    bone_m = np.array(standard.bone_m)
    bone_m[standard.index("lwrist")] = 0.0
    assert humanoid.build_body(standard.with_bones(bone_m)).model.nq == 55


def test_a_changed_spec_leaves_the_shared_body_alone() -> None:
    body = humanoid.build_body()
    spec = humanoid.body_spec(body.skeleton, body.mounts)
    np.testing.assert_array_equal(spec.compile().geom_size, body.model.geom_size)
    spec.geom("lhand").size = [0.5, 0.5, 0.5]
    assert humanoid.build_body().model.geom("lhand").size[0] < 0.2
