"""The humanoid on MuJoCo: bones, mounts, kinematics, retargeting."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.body.anatomy import body_geoms as body_geoms
    from harness.body.anatomy import body_scale as body_scale
    from harness.body.anatomy import sole_points_m as sole_points_m
    from harness.body.ground import sole_heights_m as sole_heights_m
    from harness.body.humanoid import Body as Body
    from harness.body.humanoid import body_spec as body_spec
    from harness.body.humanoid import build_body as build_body
    from harness.body.humanoid import joint_offsets_m as joint_offsets_m
    from harness.body.humanoid import tpose as tpose
    from harness.body.kinematics import Kinematics as Kinematics
    from harness.body.kinematics import bone_poses as bone_poses
    from harness.body.kinematics import pose_from_qpos as pose_from_qpos
    from harness.body.mounts import DEFAULT_MOUNTS as DEFAULT_MOUNTS
    from harness.body.mounts import Mount as Mount
    from harness.body.mounts import locate_mount as locate_mount
    from harness.body.mounts import locate_mounts as locate_mounts
    from harness.body.places import NAMED_PLACES as NAMED_PLACES
    from harness.body.places import select_places as select_places
    from harness.body.rendering import BodyMesh as BodyMesh
    from harness.body.rendering import RenderScene as RenderScene
    from harness.body.retargeting import RetargetReport as RetargetReport
    from harness.body.retargeting import retarget_to_common_body as retarget_to_common_body
    from harness.body.retargeting import retarget_to_own_body as retarget_to_own_body
    from harness.body.retargeting import retarget_with_same_angles as retarget_with_same_angles
    from harness.body.soft_tissue import THICKNESS_M as THICKNESS_M
    from harness.body.soft_tissue import tissue_thickness_m as tissue_thickness_m
else:
    __getattr__, __dir__ = lazy_names(__name__)
