"""The eight poses: within limits, balanced, without collisions, and sufficient for the calibration."""

import mujoco
import numpy as np
import pytest

from harness.body import build_body, sole_heights_m, sole_points_m
from harness.body import pose_from_qpos as forward
from harness.calibrate.poses import POSES, CalibrationPose, pose_angles_rad, pose_configuration
from harness.core.humanoid24 import limits_rad, standard_skeleton
from harness.core.skeleton import Skeleton
from tests.calibrate.standing_model import somebody

BODIES = [standard_skeleton(), *(somebody(number) for number in range(4))]


@pytest.mark.parametrize("pose", POSES, ids=lambda pose: pose.name)
def test_angles_are_of_the_model_and_within_its_limits(pose: CalibrationPose) -> None:
    assert set(pose.angles_deg) <= set(standard_skeleton().dof_names)
    low, high = limits_rad().T
    angles = pose_angles_rad(pose, standard_skeleton())
    assert np.all(low <= angles)
    assert np.all(angles <= high)


@pytest.mark.parametrize("skeleton", BODIES, ids=range(len(BODIES)))
@pytest.mark.parametrize("pose", POSES, ids=lambda pose: pose.name)
def test_it_stands(pose: CalibrationPose, skeleton: Skeleton) -> None:
    """The lower sole is on the floor, and the weight above the ground between the soles that are, within 3 cm: people
    shift as they must."""
    qpos = pose_configuration(pose, skeleton)
    at = forward(skeleton, qpos[None])
    assert sole_heights_m(skeleton, at).min() == pytest.approx(0.0, abs=1e-12)
    soles = [
        at.start_m[0, bone] + points @ at.world_from_bone[0, bone].T
        for bone, points in zip(
            (skeleton.index("lfoot"), skeleton.index("rfoot")), sole_points_m(skeleton), strict=True
        )
    ]
    standing = np.concatenate([points for points in soles if points[:, 2].min() < 0.02])[:, :2]
    body = build_body(skeleton)
    data = mujoco.MjData(body.model)
    data.qpos[:] = qpos
    mujoco.mj_forward(body.model, data)
    weight = data.subtree_com[0][:2]
    assert np.all(standing.min(axis=0) - 0.03 < weight)
    assert np.all(weight < standing.max(axis=0) + 0.03)


@pytest.mark.parametrize("pose", POSES, ids=lambda pose: pose.name)
def test_no_limb_is_inside_another_part_of_the_body(pose: CalibrationPose) -> None:
    """Bodies more than three joints apart overlap by at most 5 mm."""
    body = build_body()
    model, data = body.model, mujoco.MjData(body.model)
    data.qpos[:] = pose_configuration(pose, body.skeleton)
    mujoco.mj_forward(model, data)
    worst_m = 0.0
    for a in range(model.ngeom):
        for b in range(a):
            if _apart(model, int(model.geom_bodyid[a]), int(model.geom_bodyid[b])) > 3:
                worst_m = min(worst_m, mujoco.mj_geomDistance(model, data, a, b, 0.1, None))
    assert worst_m > -0.005


def _apart(model: mujoco.MjModel, a: int, b: int) -> int:
    """Number of joints between two bodies."""
    chains = []
    for body in (a, b):
        chain = [body]
        while chain[-1] > 0:
            chain.append(int(model.body_parentid[chain[-1]]))
        chains.append(chain)
    common = next(body for body in chains[0] if body in chains[1])
    return chains[0].index(common) + chains[1].index(common)


def test_the_first_is_the_t_pose_and_all_are_different() -> None:
    skeleton = standard_skeleton()
    assert len(POSES) == 8
    assert POSES[0].name == "T-pose"
    legs = {name for name, angle in POSES[0].angles_deg.items() if angle}
    assert legs == {"lfemur.rz", "rfemur.rz"}
    angles = np.array([pose_angles_rad(pose, skeleton) for pose in POSES])
    for a in range(8):
        for b in range(a):
            assert np.rad2deg(np.linalg.norm(angles[a] - angles[b])) > 45.0


def test_every_joint_that_leads_to_a_station_of_the_first_paper_bends() -> None:
    """But the clavicle's, which moves by a few degrees in anybody: what stays straight cannot be told."""
    skeleton = standard_skeleton()
    angles = np.array([pose_angles_rad(pose, skeleton) for pose in POSES])
    spans = dict(zip(skeleton.dof_names, np.rad2deg(np.ptp(angles, axis=0)), strict=True))
    trunk = ("lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head")
    for bone in trunk:
        for channel in ("rx", "ry", "rz"):
            assert spans[f"{bone}.{channel}"] >= 10.0, (bone, channel)
    for limb in ("humerus.rx", "humerus.rz", "radius.rx", "femur.rx", "tibia.rx"):
        assert min(spans[f"l{limb}"], spans[f"r{limb}"]) >= 20.0, limb


def test_the_angles_are_those_that_recordings_were_made_with() -> None:
    """The sum of each pose's angles without their signs [deg]: a changed angle spoils the recordings of the poses."""
    assert [sum(map(abs, pose.angles_deg.values())) for pose in POSES] == [40, 383, 323, 410, 434, 416, 995, 488]
