"""The humanoid on MuJoCo: bones, mounts, kinematics, retargeting."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.body.anatomy import body_geoms, body_scale, sole_points_m
    from harness.body.ground import sole_heights_m
    from harness.body.humanoid import Body, body_spec, build_body, joint_offsets_m, tpose
    from harness.body.kinematics import Kinematics, bone_poses, pose_from_qpos
    from harness.body.mounts import DEFAULT_MOUNTS, Mount, locate_mount, locate_mounts
    from harness.body.places import NAMED_PLACES, select_places
    from harness.body.rendering import BodyMesh, RenderScene
    from harness.body.retargeting import (
        RetargetReport,
        retarget_to_common_body,
        retarget_to_own_body,
        retarget_with_same_angles,
    )
    from harness.body.soft_tissue import THICKNESS_M, tissue_thickness_m
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "DEFAULT_MOUNTS",
    "NAMED_PLACES",
    "THICKNESS_M",
    "Body",
    "BodyMesh",
    "Kinematics",
    "Mount",
    "RenderScene",
    "RetargetReport",
    "body_geoms",
    "body_scale",
    "body_spec",
    "bone_poses",
    "build_body",
    "joint_offsets_m",
    "locate_mount",
    "locate_mounts",
    "pose_from_qpos",
    "retarget_to_common_body",
    "retarget_to_own_body",
    "retarget_with_same_angles",
    "select_places",
    "sole_heights_m",
    "sole_points_m",
    "tissue_thickness_m",
    "tpose",
]
